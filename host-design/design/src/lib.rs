#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! Data flows in this order, on top of [`numerics`]; long studies are spread over all processors by [`parallel`]:
//!
//! | module | from | to |
//! |---|---|---|
//! | [`rig`] | a file in TOML | checked values in SI units |
//! | [`plant`] | masses, lengths, friction | equations of motion, linear model |
//! | [`reality`] | plant, `[reality]` of the rig | the plant with friction, backlash, sensor and driver errors |
//! | [`design`] | linear model, weights, poles, noise | certified gains and observer |
//! | [`motion`] | | planned motions between equilibria, as the search for a swing-up makes them |
//! | [`table`] | gains and limits | the gain table of the firmware, as values and as Rust source |
//! | [`export`] | gain table | the controller as a C header |
//! | [`simulate`] | table and scenario | a run of the firmware's controller against the nonlinear plant |
//! | [`study`] | a function of a run's number | outcomes of all runs, computed here or split over several machines |
//!
//! The control law itself is not here: a simulation runs the firmware's own controller from the crate `upright`.

#![forbid(unsafe_code)]

pub mod design;
pub mod export;
pub mod motion;
pub mod number;
pub mod numerics;
pub mod parallel;
pub mod plant;
pub mod reality;
pub mod rig;
pub mod simulate;
pub mod study;
pub mod table;
