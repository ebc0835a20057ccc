//! The control core of Upright: it balances an n-link inverted pendulum on a cart from a microcontroller.
//!
//! The way of data is `encoder counts → estimate → force → motor duty`, once per tick, in the order of the modules
//! [`encoder`], [`observer`], [`state_feedback`] and [`actuator`]; [`controller`] puts them together. All constants come
//! from a gain table ([`gains`]) that the host tool `upright design RIG` writes from one rig file; nothing is tuned by
//! hand here. The same code runs on the target, in simulations and in tests.
//!
//! ```
//! use upright::control::controller::Controller;
//! use upright::control::encoder::CounterWidth;
//! use upright::gains::{RIG_HASH, SENSORS, TABLE, TICK_S};
//! use upright::table::Build;
//!
//! let build = Build { rig_hash: RIG_HASH, tick_s: TICK_S };
//! let mut controller = Controller::new(&TABLE, &build, [CounterWidth::Bits32; SENSORS])?;
//! controller.start(&[0; SENSORS])?; // upright and at rest, all counters at 0
//! controller.set_setpoint(0.1)?; // metres
//! let mut counts = [0; SENSORS];
//! counts[1] = 3; // the first link leans by three counts
//! let command = controller.control(&counts); // at the start of a tick; then drive the motor
//! controller.predict(); // any time before the next tick
//! assert!(command.applied_n != 0.0 && command.applied_n.abs() <= TABLE.force_limit_n);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! State order, for n links: `x, ẋ, θ₁, θ̇₁, …, θₙ, θ̇ₙ` with angles relative to the previous link, counter-clockwise
//! positive, 0 upright; force positive along +x. SI units throughout.

#![no_std]
#![forbid(unsafe_code)]

// A generated table names this crate as another one would: the same file serves inside and outside.
extern crate self as upright;
#[cfg(test)]
extern crate std;

pub mod board;
pub mod control;
pub mod firmware;
#[cfg(not(feature = "gains-from-env"))]
pub mod gains;
#[cfg(feature = "gains-from-env")]
/// Gains of another rig than the committed one, for an image that the host tool builds to try them.
pub mod gains {
    include!(env!("UPRIGHT_GAINS"));
}
pub mod protocol;
pub mod supervision;
pub mod table;
