//! What an identification found: as text, as JSON, and as a page.

mod page;
mod text;

pub use page::page;
pub use text::{json, text};
