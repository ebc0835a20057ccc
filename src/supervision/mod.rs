//! Supervision: may the motor run? States, faults, limits, fault detection, homing, sign check and jog.
//!
//! [`supervisor`] holds the states, [`fault`] the list of faults, [`inhibits`] the list of reasons why a command is
//! refused. A new fault starts with an entry in [`fault`]; its check goes into [`envelope`] if it is a limit on the
//! state, into [`debounce`] if it has to hold for a time, into [`detection`] if it is seen in the innovation. A new
//! step before arming goes into [`calibration`].

pub mod calibration;
pub mod debounce;
pub mod detection;
pub mod envelope;
pub mod fault;
pub mod homing;
pub mod inhibits;
pub mod jog;
pub mod shaking;
pub mod sign_check;
pub mod stillness;
pub mod supervisor;
pub mod swinging;
