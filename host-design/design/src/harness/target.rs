//! Something that runs the firmware in lock step with the simulated rig.

use upright::board::{Contacts, Output};
use upright::protocol::simulated_pins::PinsIn;

use super::error::HarnessError;
use crate::table::MAX_SENSORS;

/// The pins of one tick, with as many counters as the firmware has sensors. Its frames are the same bytes as those of
/// the firmware's own type.
pub type Pins = PinsIn<MAX_SENSORS>;

/// How fast the serial line of a target is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    /// Ticks in which every command is answered.
    pub answer_ticks: usize,
    /// Ticks between two telemetry messages.
    pub telemetry_ticks: u16,
    /// Ticks from sending a command to the first tick that follows it.
    pub command_ticks: usize,
}

impl Pace {
    /// Bytes take no time. They are read after the tick they came with, the command is executed in the next, and the
    /// answer comes with the one after.
    pub const LOCK_STEP: Self = Self { answer_ticks: 4, telemetry_ticks: 1, command_ticks: 3 };
}

/// The firmware, wherever it runs.
pub trait Target {
    /// One tick: takes the pins, gives the output, and appends to `serial` what the firmware has sent over the serial
    /// line since the tick before. What it sends about this tick comes with the next one.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not answer.
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError>;

    /// How fast its serial line is.
    fn pace(&self) -> Pace {
        Pace::LOCK_STEP
    }

    /// From now on nobody reads the firmware's serial line, and its buffers fill up.
    ///
    /// # Errors
    /// [`HarnessError::Unsupported`] unless the firmware runs in this process.
    fn stop_reading(&mut self) -> Result<(), HarnessError> {
        Err(HarnessError::Unsupported("a serial line that nobody reads"))
    }
}

/// The pins of a healthy board.
pub(super) fn healthy(counts: &[u32], supply_v: f32) -> Pins {
    Pins {
        // At most MAX_SENSORS, as a table has.
        raw_counts: heapless::Vec::from_slice(counts).unwrap_or_default(),
        supply_v,
        contacts: Contacts::default(),
        received: heapless::Vec::new(),
        sabotage: None,
    }
}
