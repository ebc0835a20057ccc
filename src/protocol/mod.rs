//! Protocol: the messages between firmware and host, and how they travel over the serial line.
//!
//! [`message`] defines the requests, answers and telemetry: a new message belongs there. [`frame`] defines the frames
//! for all of them, [`serial_link`] sends and receives them beside the control task, [`queue`] connects the two, and
//! [`simulated_pins`] replaces the wires when the firmware runs with a simulation, and records them.
//!
//! ```
//! use upright::protocol::frame::{Receiver, encode};
//! use upright::protocol::message::{Command, Request};
//!
//! let command = Command { id: 1, request: Request::Disarm };
//! let (mut scratch, mut frame) = ([0; 64], [0; 64]);
//! let frame = encode(&command, &mut scratch, &mut frame).unwrap();
//! let mut receiver = Receiver::<64>::new();
//! let received = frame.iter().find_map(|&byte| receiver.push::<Command>(byte));
//! assert_eq!(received, Some(Ok(command)));
//! ```

use core::time::Duration;

/// Speed of the serial line (Bd).
pub const BAUD: u32 = 460_800;

/// Time between two keep-alives of a host, and between two commands of a key that is held.
pub const KEEP_ALIVE: Duration = Duration::from_millis(25);

/// The firmware lets go of a jog, and ends a shaking, when the host has been silent for this time (s). The limit for a
/// commanded set-point is `link_timeout_s` of the rig file.
pub use crate::supervision::jog::SILENCE_S as HOST_SILENCE_S;

// A host may lose two keep-alives in a row.
const _: () = assert!(3.0 * KEEP_ALIVE.as_secs_f32() < HOST_SILENCE_S);

/// Period of telemetry until the host sets another (s). Telemetry of a quadruple rig then takes a third of the
/// capacity of the line, the longest telemetry three quarters.
const TELEMETRY_S: f32 = 0.01;

/// The initial period of telemetry in ticks of `tick_s` (s), at least two: a board sends a message in a tick, and
/// replies need a place.
pub fn telemetry_ticks(tick_s: f32) -> u16 {
    // Rounded up, unless only the rounding of the division has made it more than a whole number.
    ((TELEMETRY_S / tick_s + 0.999) as u16).max(2)
}

pub mod frame;
pub mod message;
pub mod queue;
pub mod serial_link;
pub mod simulated_pins;
pub mod tick_log;

#[cfg(test)]
mod tests;
