//! The control core of Upright: it balances an n-link inverted pendulum on a cart from a microcontroller.
//!
//! The way of data is `state → controller → force`. Gains come from a const table ([`gains`]) that the host tool
//! `upright design RIG` writes from one rig file; nothing is tuned by hand here. The same code runs on the target, in
//! simulations and in tests.
//!
//! ```
//! use nalgebra::SVector;
//! use upright::{controller::Controller, gains, table::Build};
//!
//! let build = Build { rig_hash: gains::RIG_HASH, tick_s: gains::TICK_S };
//! let mut controller = Controller::new(&gains::TABLE, &build)?;
//! controller.set_setpoint(0.1)?; // metres
//! let mut x = SVector::<f32, { gains::STATES }>::zeros();
//! x[2] = 0.01; // the first link leans by 0.01 rad
//! let force = controller.tick(&x);
//! assert!(force.limited.abs() <= gains::TABLE.force_limit_n);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! State order, for n links: `x, ẋ, θ₁, θ̇₁, …, θₙ, θ̇ₙ` with angles relative to the previous link, counter-clockwise
//! positive, 0 upright; force positive along +x. SI units throughout.

#![no_std]

pub mod actuator;
pub mod controller;
pub mod encoder;
pub mod gains;
pub mod observer;
pub mod state_feedback;
pub mod table;
