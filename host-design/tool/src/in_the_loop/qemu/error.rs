//! Why an image does not run in QEMU.

use std::path::PathBuf;

/// Why an image does not run in QEMU.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// The emulator is not installed.
    #[error("qemu-system-arm is missing: install it (Debian: apt-get install qemu-system-arm)")]
    Missing,
    /// This system has no FIFOs.
    #[error(
        "QEMU with the link `files` needs Unix (Linux or macOS): use one, or run with --link usart where it is offered"
    )]
    NeedsUnix,
    /// The emulator cannot be started or connected to.
    #[error("QEMU: {what}: {source}")]
    Failed {
        /// The step that failed.
        what: &'static str,
        /// Why.
        source: std::io::Error,
    },
    /// The image does not answer.
    #[error("the image {0} does not answer: was it built for QEMU?")]
    Silent(PathBuf),
}

impl EmulatorError {
    /// An error of the system in the step `what`.
    pub(super) fn at(what: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        move |source| EmulatorError::Failed { what, source }
    }
}
