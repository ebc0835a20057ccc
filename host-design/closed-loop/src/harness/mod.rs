//! The whole firmware in closed loop with the simulated rig, from power-up on.
//!
//! A firmware is a [`Target`]: it takes the pins of one tick and returns the output of that tick, and what it has sent
//! over its serial line. [`with_firmware`] runs the firmware's tasks in this process; an image in an emulator is
//! another target. Everything else is the same code for all targets, so that two runs of a scenario can be compared
//! bit by bit: a [`Session`] sends commands and collects telemetry, a [`Harness`] adds the rig and the person who
//! raises it, and [`record`] runs a scenario.
//!
//! No type here depends on the numbers of states and sensors, except the firmware itself.

mod error;
mod held_rig;
mod host;
mod in_process;
mod operator;
mod rail_ends;
mod record;
mod session;
mod start_up;
mod target;

pub use error::HarnessError;
pub use held_rig::HeldRig;
pub use host::Host;
pub use in_process::{endless_firmware, with_firmware, with_table};
pub use operator::{Operator, OperatorTick, Status};
pub use rail_ends::RailEnds;
pub use record::{FirmwareTick, Recording, goals, record};
pub use session::Session;
pub use start_up::Harness;
pub use target::{Pace, Pins, Target, healthy};
