//! Why a run of the whole firmware fails.

use upright_closed_loop::harness::HarnessError;
use upright_identify::{IdentifyError, ShakeError};

use super::qemu::EmulatorError;

/// A run that could not be started or finished.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The firmware does not do what it should.
    #[error(transparent)]
    Harness(#[from] HarnessError),
    /// QEMU does not run the image.
    #[error(transparent)]
    Emulator(#[from] EmulatorError),
    /// The rig cannot be shaken, or does not do what it should.
    #[error(transparent)]
    Shaken(#[from] IdentifyError),
    /// The listening socket has failed.
    #[error("no client can connect: {0}")]
    Socket(#[from] std::io::Error),
}

impl RunError {
    /// Whether there is no QEMU on this computer.
    pub fn lacks_emulator(&self) -> bool {
        matches!(self, Self::Emulator(EmulatorError::Missing | EmulatorError::NeedsUnix))
    }
}

impl From<ShakeError> for RunError {
    fn from(error: ShakeError) -> Self {
        match error {
            ShakeError::Harness(error) => error.into(),
            ShakeError::Identify(error) => error.into(),
        }
    }
}
