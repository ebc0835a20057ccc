//! Why a log cannot be read, or a machine not identified.

use std::path::PathBuf;

use crate::table::RecordingError;

/// Why a log cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LogError {
    /// The file cannot be opened or read; the text is that of the operating system.
    #[error("cannot be read ({0}); check path and permissions")]
    Unreadable(String),
    /// The file is larger than the largest one that is read.
    #[error("more than 1 GiB; a minute of four links is 800 kB, check the path")]
    TooLarge,
    /// The file contains no tick.
    #[error("holds no tick; record it again")]
    Empty,
    /// The file does not begin with the signature of a log.
    #[error("is not a log of Upright: it does not begin with UPRTLOG1; check the path")]
    Foreign,
    /// The file ends within its header or a frame.
    #[error("ends within the header or frame that begins at byte {at}; copy it again, or record it again")]
    Truncated {
        /// Offset of the header or frame (bytes).
        at: usize,
    },
    /// A checksum or a length is wrong.
    #[error("is damaged in the header or frame that begins at byte {at}; copy it again, or record it again")]
    Damaged {
        /// Offset of the header or frame (bytes).
        at: usize,
    },
    /// The number of a tick is not above that of the tick before.
    #[error(
        "the ticks of the frame at byte {at} do not follow those before; give each recording as a file of its own"
    )]
    Order {
        /// Offset of the frame (bytes).
        at: usize,
    },
}

/// Why a machine cannot be identified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// A log cannot be read.
    #[error("{}: {source}", file.display())]
    Log {
        /// Path of the log.
        file: PathBuf,
        /// Why it cannot be read.
        source: LogError,
    },
    /// A table of measurements cannot be used.
    #[error("{}: {source}", file.display())]
    Table {
        /// Path of the table.
        file: PathBuf,
        /// Why it cannot be used.
        source: RecordingError,
    },
    /// The rig file has no chain with encoders.
    #[error(
        "{0}: only links on a cart with an encoder on the cart and on every link can be identified; add encoder_step_m to [cart] and encoder_counts_per_rev to each [[link]]"
    )]
    NoEncoders(String),
    /// The log was recorded on another rig.
    #[error("{}: is a log of {found}, the rig file is {wanted}; {remedy}", file.display())]
    OtherRig {
        /// Path of the log.
        file: PathBuf,
        /// What the log states.
        found: String,
        /// What the rig file states.
        wanted: String,
        /// What to do.
        remedy: String,
    },
    /// The counts of a drive with pulses are not those of its pulses.
    #[error("{}: {found}; the board has to count the pulses that it gives, with their sign", file.display())]
    Pulses {
        /// Path of the log.
        file: PathBuf,
        /// How the counts differ.
        found: String,
    },
    /// The pieces of the log without a gap are too short in total.
    #[error("{seconds:.1} s of log without a gap, at least {least} s are needed; record more")]
    TooShort {
        /// Duration of all pieces (s).
        seconds: f64,
        /// Duration needed (s).
        least: f64,
    },
    /// A channel, which is named, does not move.
    #[error(
        "{0} does not move in the log: it is blocked, or its encoder is not connected; nothing is identified"
    )]
    Still(String),
    /// The firmware sends no log.
    #[error("the firmware has sent no log of its ticks: flash the image of this version")]
    NothingRecorded,
    /// No channel moves.
    #[error(
        "nothing moves in the log; is the motor connected and its supply on, and were the links released?"
    )]
    NothingMoves,
    /// The identified numbers are not physical: no machine has them.
    #[error("{0}")]
    Physical(String),
    /// The equations of the identification have no solution.
    #[error("the log does not determine the parameters: {0}; record a longer log with larger motion")]
    Undetermined(&'static str),
    /// The machine cannot be shaken; the text says why.
    #[error("{0}")]
    Excitation(String),
}

impl IdentifyError {
    /// Whether the files are in order, but the identification has no solution.
    pub fn is_without_solution(&self) -> bool {
        !matches!(
            self,
            IdentifyError::Log { .. }
                | IdentifyError::Table { .. }
                | IdentifyError::NoEncoders(_)
                | IdentifyError::OtherRig { .. }
                | IdentifyError::Pulses { .. }
        )
    }
}
