//! The nonlinear equations of motion of links on a cart or an arm: one source for the firmware, which predicts with
//! them in `f32`, and for the host, which simulates with them in `f64`.
//!
//! Other modules use states with relative angles, `x, ẋ, θ_1, θ̇_1, …`. The equations here use absolute angles
//! `φ_i = θ_1 + … + θ_i`, in which the mass matrix is simple.
//!
//! ```
//! use nalgebra::{Matrix1, Vector1};
//! use upright::plant::ChainState;
//! use upright::table::ChainModel;
//!
//! // A thin rod of 1 kg and 1 m on a cart of 1 kg, without friction; g = 10 m/s².
//! let rod = ChainModel::<1, f64> {
//!     inverse_mass: 0.5,
//!     a: Vector1::new(0.5),
//!     weight: Vector1::new(5.0),
//!     b: Matrix1::new(1.0 / 3.0),
//!     b_reduced: Matrix1::new(1.0 / 3.0 - 0.125),
//!     reaction: Vector1::new(0.5),
//!     cart_friction: 0.0,
//!     joint_frictions: Vector1::new(0.0),
//!     turning: None,
//! };
//! let mut state = [0.0, 0.0, 0.1, 0.0]; // cart at rest, link leaning by 0.1 rad
//! rod.predict(&mut state, 0.0, 0.001);
//! assert!(state[3] > 0.0, "it falls");
//! let rate = rod.derivative(&ChainState::upright(), 2.0, &[0.0]);
//! assert!(rate.xdot > 0.0);
//! ```

mod chain_state;
mod equations;

pub use crate::numbers::{LARGEST_RAD, in_quadrant};
pub use chain_state::ChainState;
