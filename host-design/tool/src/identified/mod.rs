//! What an identification found: as text, as JSON, as a page, and as a rig file.

mod page;
mod rig_file;
mod text;

pub use page::page;
pub use rig_file::rig_file;
pub use text::{json, text};
