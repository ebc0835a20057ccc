//! What an identification found: as text, as JSON, and as a rig file.

mod rig_file;
mod text;

pub use rig_file::{NotWritten, rig_file};
pub use text::{json, text};
