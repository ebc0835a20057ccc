//! Why a run of the whole firmware fails.

use upright_closed_loop::harness::HarnessError;
use upright_identify::{IdentifyError, ShakeError};

/// A run that could not be started or finished.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The firmware does not do what it should.
    #[error(transparent)]
    Harness(#[from] HarnessError),
    /// The rig cannot be shaken, or does not do what it should.
    #[error(transparent)]
    Shaken(#[from] IdentifyError),
    /// The listening socket has failed.
    #[error("no client can connect: {0}")]
    Socket(#[from] std::io::Error),
}

impl From<ShakeError> for RunError {
    fn from(error: ShakeError) -> Self {
        match error {
            ShakeError::Harness(error) => error.into(),
            ShakeError::Identify(error) => error.into(),
        }
    }
}
