//! Recordings of other programs: tables of measurements as text.
//!
//! - [`RecordingTable`]: the columns of a file and its rows of numbers.
//! - [`Reading`]: what the columns mean, where their names leave it open.
//! - [`RecordingColumns`]: the columns by their meaning, checked against the rig.

mod column;
mod columns;
mod error;
mod reading;
mod text;

pub(super) use columns::{RecordingColumns, RecordingRows};
pub use error::RecordingError;
pub use reading::{AngleReference, AngleZero, Reading};
pub use text::RecordingTable;
