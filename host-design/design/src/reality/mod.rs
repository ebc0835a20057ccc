//! The machine as it really is: what `[reality]` of a rig file adds to the model when a run is simulated.
//!
//! - [`Bristle`]: dry friction with sticking.
//! - [`Belt`]: backlash and an elastic belt.
//! - [`real_plant`]: the chain with both and with air drag, on a tilted rail, with its real masses and lengths.
//! - [`Driver`]: motor driver and supply.
//! - [`StepMotor`]: the spring between field and rotor of a step motor.
//! - [`Timing`]: when the force of a tick begins and ends.
//! - [`RealEncoders`]: errors of encoders and of their zeros.
//! - [`Imperfection::on`](crate::rig::Imperfection::on): a machine with one imperfection alone.
//! - [`drawn_machine`], [`corner_machine`]: machines within the tolerances of `[robust]`.
//!
//! What a rig file leaves out is not simulated: the simulation then does the same operations as without `[reality]`,
//! and has the same bits. `docs/reality.md` describes the keys.

mod alone;
mod belt;
mod bristle;
mod driver;
mod encoders;
mod machine;
mod parameters;
mod step_motor;
mod timing;
mod tolerated;

pub use belt::{Belt, Rotor};
pub use bristle::{Bristle, Contact, PRESLIDING_PER_DEFLECTION};
pub use driver::Driver;
pub use encoders::{RealEncoders, hanging_by_hand, sum_of_sines};
pub use machine::{RealChain, ideal_chain, real_plant};
pub use parameters::real_chain;
pub use step_motor::StepMotor;
pub use timing::Timing;
pub use tolerated::first_mass;
pub use tolerated::{corner_machine, corners_of, drawn_machine, tolerated_machine};
