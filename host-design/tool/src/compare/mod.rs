//! Comparison of designs: several rigs, or one rig file with one of its numbers swept over a range.
//!
//! A [`Sweep`] changes the text of the rig file, so that every value is checked as if it were written there. For each
//! [`ComparedRig`] and law, [`compare`] computes the design, its margins, one run of the firmware's controller and the
//! largest tilt. A candidate that has no design or falls gets a row, too.
//!
//! ```
//! use upright_tool::compare::Sweep;
//!
//! let sweep: Sweep = "tick.period_s=0.001..0.01:10".parse()?;
//! assert_eq!((sweep.values.len(), sweep.values[9]), (10, 0.01));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod candidate;
mod figure;
mod row;
mod sweep;
mod table;

pub use candidate::{ComparedConditions, ComparedRig, compare, jobs};
pub use figure::figure;
pub use row::{ComparedRow, Fate, LawFigures};
pub use sweep::{Sweep, SweepError};
pub use table::{csv, notes, table};
