//! The interface to a firmware that runs in lock step with the simulated rig.

use upright::board::{Contacts, Output};
use upright::protocol::simulated_pins::PinsIn;

use super::error::HarnessError;
use upright_design::table::MAX_SENSORS;

/// The input pins of one tick, with as many counters as the firmware has sensors. Its frames are the same bytes as
/// those of the firmware's own type.
pub type Pins = PinsIn<MAX_SENSORS>;

/// Delays of the serial line of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    /// Number of ticks within which every command is answered.
    pub answer_ticks: usize,
    /// Ticks between two telemetry messages.
    pub telemetry_ticks: u16,
    /// Ticks from sending a command to the first tick that acts on it.
    pub command_ticks: usize,
}

impl Pace {
    /// Bytes take no time. They are read after the tick they came with, the command is executed in the next, and the
    /// answer comes with the one after.
    pub const LOCK_STEP: Self = Self { answer_ticks: 4, telemetry_ticks: 1, command_ticks: 3 };
}

/// A running firmware: in this process, in an emulator, or on the virtual board.
pub trait Target {
    /// Runs one tick: takes the pins, returns the output, and appends to `serial` what the firmware has sent over the
    /// serial line since the tick before. What it sends about this tick comes with the next one.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not answer.
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError>;

    /// Delays of its serial line.
    fn pace(&self) -> Pace {
        Pace::LOCK_STEP
    }

    /// Stops reading the firmware's serial line, so that its buffers fill up.
    ///
    /// # Errors
    /// [`HarnessError::Unsupported`] unless the firmware runs in this process.
    fn stop_reading(&mut self) -> Result<(), HarnessError> {
        Err(HarnessError::Unsupported("a serial line that nobody reads"))
    }
}

/// The input pins of a healthy board.
pub fn healthy(counts: &[u32], supply_v: f32) -> Pins {
    Pins {
        // At most MAX_SENSORS, as a table has.
        raw_counts: heapless::Vec::from_slice(counts).unwrap_or_default(),
        supply_v,
        contacts: Contacts::default(),
        received: heapless::Vec::new(),
        injected_fault: None,
    }
}
