//! Recordings of other programs: tables of measurements as text.
//!
//! - [`Table`]: the columns of a file and its rows of numbers.
//! - [`Reading`]: what the columns mean, where their names leave it open.
//! - [`Columns`]: the columns by their meaning, checked against the rig.

mod column;
mod columns;
mod error;
mod reading;
mod text;

pub(super) use columns::{Columns, Rows};
pub use error::TableError;
pub use reading::{AngleReference, AngleZero, Reading};
pub use text::Table;
