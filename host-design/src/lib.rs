//! From a rig file to a model, gains, the const table and a verdict on the closed loop.
pub mod design;
pub mod numerics;
pub mod plant;
pub mod rig;
pub mod table;
