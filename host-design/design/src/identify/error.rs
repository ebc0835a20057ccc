//! Why a log cannot be read, or a machine not identified.

use std::path::PathBuf;

/// Why a log cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LogError {
    /// The file system refuses it.
    #[error("cannot be read ({0}); check path and permissions")]
    Unreadable(String),
    /// More than is read.
    #[error("more than 1 GiB; a minute of four links is 800 kB, check the path")]
    TooLarge,
    /// It has no tick.
    #[error("holds no tick; record it again")]
    Empty,
    /// It does not begin as a log.
    #[error("is no log of Upright: it does not begin with UPRTLOG1; check the path")]
    Foreign,
    /// It ends within a header or frame.
    #[error("ends in the middle of what begins at byte {at}; copy it again, or record it again")]
    Truncated {
        /// Offset (bytes).
        at: usize,
    },
    /// A checksum or a length is wrong.
    #[error(
        "is damaged in what begins at byte {at}: its checksum is wrong; copy it again, or record it again"
    )]
    Damaged {
        /// Offset (bytes).
        at: usize,
    },
    /// A tick does not follow the one before.
    #[error(
        "the ticks of the frame at byte {at} do not follow those before; give each recording as a file of its own"
    )]
    Order {
        /// Offset (bytes).
        at: usize,
    },
}

/// Why a machine cannot be identified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// A log cannot be read.
    #[error("{}: {source}", file.display())]
    Log {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: LogError,
    },
    /// The rig file has no chain with encoders.
    #[error(
        "{0}: only links on a cart with an encoder on the cart and on every link can be identified; add encoder_step_m to [cart] and encoder_counts_per_rev to each [[link]]"
    )]
    NoEncoders(String),
    /// The log is of another rig.
    #[error("{}: is a log of {found}, the rig file is {wanted}; {remedy}", file.display())]
    OtherRig {
        /// The file.
        file: PathBuf,
        /// What the log says.
        found: String,
        /// What the rig file says.
        wanted: String,
        /// What to do.
        remedy: String,
    },
    /// Too little is left after the gaps.
    #[error("{seconds:.1} s of log without a gap, at least {least} s are needed; record more")]
    TooShort {
        /// What there is (s).
        seconds: f64,
        /// What is needed (s).
        least: f64,
    },
    /// A channel does not move.
    #[error(
        "{0} does not move in the log: it is blocked, or its encoder is not connected; nothing is identified"
    )]
    Still(String),
    /// The firmware sends no log.
    #[error("the firmware has sent no log of its ticks: build its image with --identify")]
    NothingRecorded,
    /// No channel moves.
    #[error(
        "nothing moves in the log; is the motor connected and its supply on, and were the links released?"
    )]
    NothingMoves,
    /// No machine has the numbers that were found.
    #[error("{0}")]
    Physical(String),
    /// The equations have no solution.
    #[error("the log does not determine the parameters: {0}; record a longer log with larger motion")]
    Undetermined(&'static str),
    /// The simulated machine cannot be shaken.
    #[error("{0}")]
    Excitation(String),
}

impl IdentifyError {
    /// Whether the input is readable, but has no solution.
    pub fn is_without_solution(&self) -> bool {
        !matches!(
            self,
            IdentifyError::Log { .. } | IdentifyError::NoEncoders(_) | IdentifyError::OtherRig { .. }
        )
    }
}
