//! Why an image cannot be built.

use std::path::PathBuf;

use upright::boards::{BoardRow, DEFAULT_BOARD, f4};
use upright_closed_loop::conversation::words::joint;
use upright_design::table::WriteError;

use super::elf::ElfError;
use upright_command::project::NoCheckout;

/// The target that images are compiled for: Cortex-M4 with single-precision floating point.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// No compiler for these targets is installed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "no compiler for {0}: run `rustup target add {0}`, or on Debian `apt-get install lld rustc-web cargo-web rust-web-src`"
)]
pub struct NoCompiler(pub(super) String);

/// Largest share of a period that a tick of a Pico may take (%).
pub(super) const MOST_PERCENT: f64 = 75.0;

/// Why an image could not be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// No compiler for the target.
    #[error(transparent)]
    NoCompiler(#[from] NoCompiler),
    /// The rig has more encoders than the board has timers for.
    #[error("{board} counts {} encoders, and this rig has {needed}: use another board (`upright firmware boards`)", board.encoders())]
    Encoders {
        /// Which board.
        board: &'static BoardRow,
        /// Number of the rig's sensors.
        needed: usize,
    },
    /// An absolute sensor of another kind than the board reads.
    #[error(
        "{board} reads absolute sensors of {} bits, AS5047D or AS5047P, and the {} has another sensor_bits: use \
         such a sensor, or write a board that reads it (docs/own-board.md)",
        f4::ANGLE_BITS, joint(*sensor as u8)
    )]
    AngleBits {
        /// Which board.
        board: &'static BoardRow,
        /// Number of the first such sensor (0: cart, 1: first link).
        sensor: usize,
    },
    /// A link has a potentiometer that the board does not read.
    #[error(
        "{board} reads one potentiometer, with {} bits, at link 1, and link {link} has another: use a sensor of another \
         kind there, set its sensor_bits, or write a board that reads it (docs/own-board.md)",
        f4::WIPER_BITS
    )]
    Potentiometer {
        /// Which board.
        board: &'static BoardRow,
        /// The first such link, from 1.
        link: usize,
    },
    /// An absolute sensor, and the board reads encoders alone.
    #[error(
        "this board reads encoders alone, and the {} has an absolute sensor (sensor_bits): use another board \
         (`upright firmware boards`), or write one that reads it (docs/own-board.md)",
        joint(*sensor as u8)
    )]
    AbsoluteSensor {
        /// Number of the first such sensor (0: cart, 1: first link).
        sensor: usize,
    },
    /// Absolute sensors of different kinds, which share a clock.
    #[error(
        "{board} reads absolute sensors of one kind, and the {} has another one than the {}: give both the same sensor",
        joint(sensors[1] as u8), joint(sensors[0] as u8)
    )]
    DifferentParts {
        /// Which board.
        board: &'static BoardRow,
        /// Numbers of two such sensors (0: cart, 1: first link).
        sensors: [usize; 2],
    },
    /// The board cannot make the rig's tick.
    #[error(
        "{board} makes ticks of {} to {} ms, and this rig's is {} ms: change tick.period_s, or use another board",
        f64::from(board.tick_us()[0]) / 1e3, f64::from(board.tick_us()[1]) / 1e3, rounded_ms(*tick_s)
    )]
    Tick {
        /// Which board.
        board: &'static BoardRow,
        /// The rig's tick (s).
        tick_s: f64,
    },
    /// The drive takes more pulses than the board gives.
    #[error(
        "{board} gives {most:.0} step pulses in a second at most, {} of them in a tick, and the drive of this rig may \
         take {rate:.0}: lower actuator.step_rate_limit_hz",
        board.pulses()
    )]
    Pulses {
        /// Which board.
        board: &'static BoardRow,
        /// Most pulses in a second, at the rig's tick.
        most: f64,
        /// Pulses of this rig's drive in a second, at most.
        rate: f64,
    },
    /// A tick that takes too long.
    #[error(
        "a tick {what} takes up to {cycles} cycles on a pico, {:.2} ms at {:.0} MHz: {:.0} % of this rig's {} ms, and \
         {MOST_PERCENT} % is the most: {remedy}",
        f64::from(*cycles) / clock_hz * 1e3, clock_hz / 1e6, f64::from(*cycles) / clock_hz / tick_s * 1e2, tick_s * 1e3
    )]
    Cycles {
        /// What the firmware does in it.
        what: &'static str,
        /// Cycles of the longest tick.
        cycles: u32,
        /// The processor's clock (Hz).
        clock_hz: f64,
        /// The rig's tick (s).
        tick_s: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// The virtual board does not stand for this board.
    #[error(
        "the virtual board does not stand for a {board}, but for boards such as {DEFAULT_BOARD}: use one of them"
    )]
    NotVirtual {
        /// Which board.
        board: &'static BoardRow,
    },
    /// `src/gains.rs` is not a gain table.
    #[error("{}: not a gain table; write it with `upright design RIG`", path.display())]
    NoGains {
        /// Its path.
        path: PathBuf,
    },
    /// `src/gains.rs` is made from no rig in `rigs/`.
    #[error("{}: made from no rig in rigs/: name its rig file after `firmware build`", path.display())]
    NoRig {
        /// Its path.
        path: PathBuf,
    },
    /// `src/gains.rs` is another table than the one that is designed from its rig.
    #[error("{}: not the table of {}: write it again with `upright design {}`", path.display(), rig.display(), rig.display())]
    OtherGains {
        /// Its path.
        path: PathBuf,
        /// The rig file that it is made from.
        rig: PathBuf,
    },
    /// The image cannot be read.
    #[error(transparent)]
    Elf(#[from] ElfError),
    /// There is no source to build from.
    #[error(transparent)]
    NoCheckout(#[from] NoCheckout),
    /// The compiler cannot be started.
    #[error("{0} cannot be started: {1}")]
    Start(&'static str, std::io::Error),
    /// The compiler reports errors.
    #[error("the image cannot be built; the compiler says:\n{0}")]
    Compiler(String),
    /// Its gain table, or the image itself, cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A file of the image cannot be read.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// A time in milliseconds, to the microsecond.
fn rounded_ms(time_s: f64) -> f64 {
    (time_s * 1e6).round() / 1e3
}
