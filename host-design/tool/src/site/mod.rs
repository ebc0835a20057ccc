//! The whole of it in a page: designs rigs and runs their closed loops in a browser, with nothing to install and no
//! network.
//!
//! The page computes with a WebAssembly module of the crate `upright-page`, which is compiled here. Its answers have
//! the bits of this computer's.
//!
//! ```
//! let page = upright_tool::site::page(b"the module", &[], &[]);
//! assert!(page.contains("default-src 'none'"));
//! ```

mod error;
mod examples;
mod files;
mod labs;
mod module;
mod motions;
mod page;
mod twin;

pub use error::SiteError;
pub use examples::examples;
pub(crate) use files::json_files;
pub use labs::{lab, labs};
pub use module::module;
pub use page::{Example, page};
