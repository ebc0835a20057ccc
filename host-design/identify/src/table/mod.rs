//! Recordings of other programs: tables of measurements as text.
//!
//! - [`RecordingTable`]: the columns of a file and its rows of numbers.
//! - [`Reading`]: what the columns mean, where their names leave it open; [`Misreading`]: how that may be wrong.
//! - [`RecordingColumns`]: the columns by their meaning, checked against the rig; [`RecordingRows`]: even rows.

mod column;
mod columns;
mod error;
mod even;
mod misreading;
mod plausible;
mod reading;
mod text;

pub(crate) use columns::RecordingColumns;
pub use error::RecordingError;
pub(crate) use even::RecordingRows;
pub(crate) use misreading::FACTORS;
pub use misreading::{Misreading, SaidOfTable};
pub use reading::{AngleReference, AngleZero, Reading};
pub use text::RecordingTable;
