//! What decides whether the motor may run: states, faults, homing, limits and detection.

pub mod calibration;
pub mod detection;
pub mod envelope;
pub mod fault;
pub mod homing;
pub mod inhibits;
pub mod sign_check;
pub mod stillness;
pub mod supervisor;
pub mod watch;
