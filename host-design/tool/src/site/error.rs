//! Why the page cannot be written.

use std::path::PathBuf;

use crate::image::NoCompiler;
use upright_command::project::NoCheckout;

/// The target of the page's module.
pub(super) const TARGET: &str = "wasm32-unknown-unknown";

/// Why the page could not be made.
#[derive(Debug, thiserror::Error)]
pub enum SiteError {
    /// No compiler for WebAssembly.
    #[error(transparent)]
    NoCompiler(#[from] NoCompiler),
    /// There is no source to build from.
    #[error(transparent)]
    NoCheckout(#[from] NoCheckout),
    /// The compiler cannot be started.
    #[error("{0} cannot be started: {1}")]
    Start(&'static str, std::io::Error),
    /// The compiler reports errors.
    #[error("the page's module cannot be built; the compiler says:\n{0}")]
    Compiler(String),
    /// A file is no lab.
    #[error("{}: {why}", path.display())]
    Lab {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}
