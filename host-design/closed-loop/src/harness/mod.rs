//! The whole firmware in closed loop with the simulated rig, from power-up on.
//!
//! A firmware is a [`Target`]: it takes the pins of one tick and returns the output of that tick, and what it has sent
//! over its serial line. [`with_firmware`] runs the firmware's tasks in this process; an image in an emulator is
//! another target. Everything else is the same code for all targets, so that two runs of a scenario can be compared
//! bit by bit: a [`Session`] sends commands and collects telemetry, a [`World`] adds the rig and the hand at it.
//!
//! Every run is the same loop, [`World::tick`], with a list of those who take part in it, each a [`Participant`]: a
//! host, a defect, what is observed. [`record`] is one of them.
//!
//! No type here depends on the numbers of states and sensors, except the firmware itself.

mod error;
mod goals;
mod hand;
mod host;
mod in_process;
mod operator;
mod rail_ends;
mod record;
mod session;
mod target;
mod world;

pub use error::HarnessError;
pub use goals::Goals;
pub use hand::{Hand, Wish};
pub use host::Host;
pub use in_process::{endless_firmware, with_firmware, with_table};
pub use operator::Status;
pub use rail_ends::RailEnds;
pub use record::{FirmwareTick, Recording, record};
pub use session::Session;
pub use target::{Pace, Pins, Target, healthy};
pub use world::{BeforeMotion, Flow, Participant, World, until};
