//! Supervision: may the motor run? States, faults, limits, fault detection, homing, sign check and jog.
//!
//! [`supervisor`] holds the states, [`fault`] the list of faults, [`inhibits`] the list of reasons why a command is
//! refused. A new fault starts with an entry in [`fault`]; its check goes into [`envelope`] if it is a limit on the
//! state, into [`debounce`] if it has to hold for a time, into [`detection`] if it is seen in the innovation. A new
//! step before arming goes into [`calibration`].
//!
//! ```
//! use upright::supervision::fault::{Cause, Fault};
//! use upright::supervision::inhibits::Inhibits;
//! use upright::supervision::supervisor::{State, Supervisor};
//!
//! let mut supervisor = Supervisor::new(None);
//! assert_eq!(supervisor.arm(Inhibits::NONE), Err(Inhibits::NOT_HOMED));
//! supervisor.complete_homing()?;
//! supervisor.arm(Inhibits::NONE)?;
//! supervisor.start_balancing();
//! assert!(supervisor.state().motor_is_on());
//! supervisor.trip(Cause { fault: Fault::Angle, tick: 7, sensor: None });
//! assert_eq!(supervisor.state(), State::Fault);
//! assert!(!supervisor.state().motor_is_on());
//! # Ok::<(), Inhibits>(())
//! ```

pub mod calibration;
pub mod debounce;
pub mod detection;
pub mod envelope;
pub mod fault;
pub mod finding;
pub mod homing;
pub mod inhibits;
pub mod jog;
pub mod jumps;
pub mod pushes;
pub mod rates;
pub mod shaking;
pub mod sign_check;
pub mod slow_drive;
mod state;
pub mod stilling;
pub mod stillness;
pub mod supervisor;
pub mod swinging;
