//! From a rig file to a model, gains, the const table and a verdict on the closed loop.
//!
//! The way of data is the order of the modules: [`rig`] → [`plant`] → [`design`] → [`table`] → [`simulate`] → [`verify`] →
//! [`report`], on top of [`numerics`]; [`figure`] draws. [`image`] builds the firmware, [`in_the_loop`] runs it whole, on
//! the host or in QEMU, [`campaign`] breaks the rig meanwhile, and [`monitor`] shows what a firmware says. [`compare`] puts designs side by side, [`reproduce`]
//! the results of the paper beside ours. The control law itself is not here: a simulation runs the firmware's own
//! controller from the crate `upright`.

#![forbid(unsafe_code)]

pub mod campaign;
pub mod compare;
pub mod design;
pub mod figure;
pub mod image;
pub mod in_the_loop;
pub mod monitor;
pub mod numerics;
pub mod plant;
pub mod report;
pub mod reproduce;
pub mod rig;
pub mod simulate;
pub mod table;
pub mod verify;
