//! Comparison of designs: several rigs, or one rig file with one of its numbers swept over a range.
//!
//! A [`Sweep`] changes the text of the rig file, so that every value is checked as if it stood there. For each
//! [`Candidate`] and law [`compare`] makes the design, its margins, one run of the firmware's controller and the
//! largest tilt. A candidate without design, or one that falls, has a row, too.

mod candidate;
mod figure;
mod row;
mod sweep;
mod table;

pub use candidate::{Candidate, Conditions, compare, jobs};
pub use figure::figure;
pub use row::{Fate, Figures, Row};
pub use sweep::{Sweep, SweepError};
pub use table::{csv, notes, table};
