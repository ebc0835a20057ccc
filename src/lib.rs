//! Balances an n-link inverted pendulum on a cart from a microcontroller: controller, supervisor and serial protocol.
//!
//! Once per tick, data flows `encoder counts → estimate → force → motor duty`. All constants come from a gain table
//! that the host tool `upright design RIG` writes from one rig file. The same code runs on the target, in simulations
//! and in tests.
//!
//! | module | what is in it |
//! |---|---|
//! | [`table`] | the gain table: its fields, its checksum, limits and thresholds |
//! | [`plant`] | nonlinear equations of motion, shared with the host |
//! | [`control`] | encoders, observer, state feedback, actuator, and the controller that joins them |
//! | [`supervision`] | states, faults, what prevents arming, homing, sign check, limits, fault detection |
//! | [`protocol`] | messages, frames, the serial link |
//! | [`board`] | the trait that a board implements: inputs of a tick, output to the motor |
//! | [`boards`] | the boards that there is an image for |
//! | [`flash_image`] | the tables of a rig and the checksum in an image |
//! | [`firmware`] | one tick of all of the above, and the control task that a timer starts |
//!
//! The whole firmware, as a control task runs it: the motor stays off until nothing prevents arming any more.
//!
//! ```
//! # mod gains { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/gains.rs")); }
//! use gains::{SENSORS, SWING_UP, TABLE}; // written by `upright design`
//! use upright::board::{Contacts, Inputs};
//! use upright::control::encoder::CounterWidth;
//! use upright::firmware::Firmware;
//! use upright::protocol::message::{Answer, Command, Request, Reset};
//! use upright::supervision::inhibits::Inhibits;
//!
//! let mut firmware = Firmware::new(&TABLE, &SWING_UP, [CounterWidth::Bits32; SENSORS], Reset::Power);
//! let inputs = Inputs { raw_counts: [0; SENSORS], supply_v: 24.0, contacts: Contacts::default() };
//! let output = firmware.control(&inputs); // at the start of a tick; then drive the motor with it
//! assert!(!output.enable);
//! let arm = Command { id: 1, request: Request::Arm };
//! let (_telemetry, reply) = firmware.finish(Some(&arm), 0); // any time before the next tick
//! let Some(Answer::NotNow(inhibits)) = reply.map(|reply| reply.answer) else { panic!() };
//! assert!(inhibits.contains(Inhibits::NOT_HOMED));
//! ```
//!
//! The controller alone, from encoder counts; [`control`] shows it with positions in SI units:
//!
//! ```
//! # mod gains { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/gains.rs")); }
//! use gains::{SENSORS, TABLE}; // written by `upright design`
//! use upright::control::controller::Controller;
//! use upright::control::encoder::CounterWidth;
//!
//! let mut controller = Controller::new(&TABLE, [CounterWidth::Bits32; SENSORS])?;
//! controller.start(&[0; SENSORS])?; // upright and at rest, all counters at 0
//! controller.set_setpoint(0.1)?; // metres
//! let mut counts = [0; SENSORS];
//! counts[1] = 3; // the first link leans by three counts
//! let command = controller.control(&counts); // at the start of a tick; then drive the motor
//! controller.predict(); // any time before the next tick
//! assert!(command.applied_n != 0.0 && command.applied_n.abs() <= TABLE.drive.largest_force_n());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Where to begin
//!
//! `upright design RIG --out src/gains.rs` (of the package `upright-tool`) writes a rig's table for your crate. Your
//! board implements [`Board`](board::Board). A whole program is
//! [`examples/own-board`](https://docs.rs/crate/upright/latest/source/examples/own-board/); the repository explains
//! it in `docs/own-board.md`. `default-features = false` leaves the [controller](control) alone, without supervisor,
//! messages and their dependencies.
//!
//! State order, for n links: `x, ẋ, θ₁, θ̇₁, …, θₙ, θ̇ₙ` with angles relative to the previous link, counter-clockwise
//! positive, 0 upright; force positive along +x. SI units throughout.

#![no_std]
#![forbid(unsafe_code)]

// A generated gain table refers to this crate as `upright`, so the same file compiles inside this crate and in others.
extern crate self as upright;
#[cfg(test)]
extern crate std;

// Their types are in the signatures of this crate.
#[cfg(feature = "firmware")]
pub use heapless;
pub use nalgebra;

#[cfg(feature = "firmware")]
pub mod board;
pub mod boards;
pub mod control;
#[cfg(feature = "firmware")]
pub mod firmware;
#[cfg(feature = "firmware")]
pub mod flash_image;
#[cfg(all(test, not(feature = "image")))]
#[allow(missing_docs)]
pub mod gains;
#[cfg(feature = "image")]
/// The kind of rig that the image is for: the file that the environment variable UPRIGHT_GAINS names, of whose gain
/// table only the numbers of states and sensors and the kinds of drive and sensors count.
pub mod gains {
    include!(env!("UPRIGHT_GAINS"));
}
mod numbers;
pub mod plant;
#[cfg(feature = "firmware")]
pub mod protocol;
#[cfg(feature = "firmware")]
pub mod supervision;
pub mod table;
