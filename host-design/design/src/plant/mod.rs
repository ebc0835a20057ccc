//! The plant: links on a cart, or a given linear model, as equations of motion, linear models and simulations.
//!
//! Model (F. J. Ticona Coaquira, for n = 4; here any n >= 1). The joint angle `θ_i` of link i is relative to the
//! link before it, counter-clockwise positive, 0 upright; `φ_i = θ_1 + … + θ_i` is the absolute angle. The centre of
//! mass of link i is at
//!
//! ```text
//! ( x - Σ_{j<i} l_j sin φ_j - c_i sin φ_i,   Σ_{j<i} l_j cos φ_j + c_i cos φ_i )
//! ```
//!
//! Every state vector of this module is `x, ẋ, θ_1, θ̇_1, …, θ_n, θ̇_n` (m, m/s, rad, rad/s). Internally the equations
//! are in `x, φ`, where the mass matrix is simple (see [`ChainParameters`]).
//!
//! - [`ChainParameters`]: the constants of the equations, in any precision.
//! - [`absolute_angles`]: the angles `φ` of a state.
//! - [`torques_of_force`]: the generalised forces of a force at a point.
//! - [`linearise`]: the exact linear model about an equilibrium, in any precision.
//! - [`ChainPlant`]: the nonlinear equations in `f64`, fast, with n as a const parameter; their source is
//!   [`upright::plant`].
//! - [`Actuation`]: a force that follows the speed of its motor.
//! - [`Plant`]: the interface of a simulation of any size; [`chain_plant`] and [`LinearSimulation`] provide it.
//! - [`ChainLanes`]: several chains that advance together in the processor's SIMD vectors, with the same bits as each
//!   alone.
//! - [`reference::integrate`]: an adaptive integrator of high order, the reference for the fast one.

mod actuation;
mod angles;
mod chain;
mod error;
mod grip;
mod jacobian;
mod lanes;
mod linear;
mod linear_simulation;
mod motor;
mod parameters;
pub mod reference;
mod rk4;
mod simulation;
mod together;

pub use actuation::Actuation;
pub(crate) use actuation::{LARGEST_SHARE, MOST_STEPS, integration_steps};
pub use angles::{absolute_angles, whole_turns, without_turns};
pub use chain::{ChainPlant, Energy, WideChainState};
pub use error::PlantError;
pub use grip::torques_of_force;
pub use jacobian::Partials;
pub use linear::{LinearModel, linearise};
pub use linear_simulation::LinearSimulation;
pub use motor::MotorPlant;
pub use parameters::ChainParameters;
pub use simulation::{ChainSimulation, Plant, WithLinks, chain_plant, with_links};
pub use together::{ChainLanes, LANES, chain_lanes};
