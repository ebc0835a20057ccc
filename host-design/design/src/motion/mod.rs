//! Planned motions and the equilibria between which they lead: what the search for a swing-up makes, and the gain table
//! takes.

mod planned;
mod transition;

pub(crate) use transition::rest;

pub use planned::{MotionError, PlannedMotion, RaiseAndLower};
pub use transition::{Transition, equilibrium_named, posture_name};
