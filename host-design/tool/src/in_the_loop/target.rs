//! Something that runs the firmware in lock step.

use std::path::PathBuf;

use upright::board::Output;
use upright::protocol::frame::FrameError;
use upright::protocol::simulated_pins::PinsIn;
use upright::table::TableError;

/// The firmware with `NY` encoders, wherever it runs.
pub trait Target<const NY: usize> {
    /// One tick: gives the pins, takes the output, and appends to `serial` what the firmware has sent over the serial line
    /// since the tick before. What it sends about this tick comes with the next one.
    ///
    /// # Errors
    /// [`TargetError`] if the firmware does not answer.
    fn tick(&mut self, pins: &PinsIn<NY>, serial: &mut Vec<u8>) -> Result<Output, TargetError>;
}

/// A firmware that does not run, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum TargetError {
    /// The firmware refuses its table.
    #[error("the firmware refuses the table: {0}")]
    Table(#[from] TableError),
    /// The emulator is not there.
    #[error("qemu-system-arm is missing: install it (Debian: apt-get install qemu-system-arm)")]
    NoEmulator,
    /// The emulator cannot be started or spoken to.
    #[error("the emulator: {what}: {source}")]
    Emulator {
        /// What was tried.
        what: &'static str,
        /// Why it failed.
        source: std::io::Error,
    },
    /// The image does not answer.
    #[error("the image {0} does not answer: is it one for the loop?")]
    Silent(PathBuf),
    /// The image has ended, or says something that is no frame.
    #[error("the image has stopped in mid-run (exit status {status}){said}")]
    Stopped {
        /// The emulator's exit status; −1 if it was killed.
        status: i32,
        /// What the emulator printed.
        said: String,
    },
    /// A frame that cannot be read.
    #[error("the image's answer cannot be read: {0}")]
    Frame(#[from] FrameError),
}
