//! From a rig file to a model, certified gains, the gain table and a verdict on the closed loop.
//!
//! Data flows in the order of the modules: [`rig`] → [`plant`] → [`design`] → [`table`] → [`simulate`] → [`verify`], on top of
//! [`numerics`]. The control law itself is not here: a simulation runs the firmware's own controller from the crate
//! `upright`.

#![forbid(unsafe_code)]

pub mod design;
pub mod number;
pub mod numerics;
pub mod plant;
pub mod rig;
pub mod simulate;
pub mod table;
pub mod verify;
