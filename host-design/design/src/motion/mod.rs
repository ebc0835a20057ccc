//! Planned motions and the equilibria that they connect: what the search finds, the table stores, and the firmware
//! follows.

mod planned;
mod transition;

pub use planned::{Motion, RaiseAndLower, Shape};
pub(crate) use transition::rest;
pub use transition::{Transition, equilibrium_named, posture_name};
