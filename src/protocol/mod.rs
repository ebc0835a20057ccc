//! Protocol: the messages between firmware and host, and how they travel over the serial line.
//!
//! [`message`] defines the requests, answers and telemetry: a new message belongs there. [`frame`] defines the frames
//! for all of them, [`serial_link`] sends and receives them beside the control task, [`queue`] connects the two, and
//! [`simulated_pins`] replaces the wires when an image runs in the loop with a simulation.

/// Speed of the serial line (Bd). Telemetry of a quadruple rig at every tenth tick needs a third of it.
pub const BAUD: u32 = 460_800;

mod encoder;
pub mod frame;
pub mod message;
pub mod queue;
pub mod serial_link;
pub mod simulated_pins;
