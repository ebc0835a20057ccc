//! Simulated pins: the messages that replace the wires to the rig when the firmware runs with a simulation, and with
//! which a run is recorded and replayed.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::board::{Contacts, Inputs, Output};

/// Largest number of bytes that can arrive on the serial line in one tick.
pub const BYTES_PER_TICK: usize = 64;
/// Longest frame of [`PinsIn`] for `NY` sensors up to 15.
pub const MAX_PINS_IN: usize = 192;
/// Longest frame of [`PinsOut`].
pub const MAX_PINS_OUT: usize = 32;

/// Added to the reading of a link's sensor, which has 16 bits: the sample is bad, as a board may know by parity.
pub const BAD_SAMPLE: u32 = 1 << 16;

/// Host to firmware: the inputs of one tick.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PinsIn<const NY: usize> {
    /// Raw encoder counters.
    pub raw_counts: Vec<u32, NY>,
    /// Supply voltage (V).
    pub supply_v: f32,
    /// Contacts and flags.
    pub contacts: Contacts,
    /// Bytes that arrive on the serial line during this tick.
    pub received: Vec<u8, BYTES_PER_TICK>,
    /// Fault injected in this tick.
    pub injected_fault: Option<InjectedFault>,
}

/// A fault injected inside the microcontroller, which no input could cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum InjectedFault {
    /// A panic.
    Panic,
    /// A processor fault: access to an address that does not exist.
    HardFault,
    /// Endless recursion.
    StackOverflow,
}

/// Firmware to host: the output of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PinsOut {
    /// What the motor is driven with.
    pub output: Output,
    /// Number of bytes sent over the serial line before this tick. A host that reads just these gets the same data at
    /// the same tick in every run, however fast it is.
    pub sent: u32,
}

impl<const NY: usize> PinsIn<NY> {
    /// These inputs, with nothing on the serial line and no injected fault.
    pub fn of(inputs: &Inputs<NY>) -> Self {
        Self {
            raw_counts: Vec::from_array(inputs.raw_counts),
            supply_v: inputs.supply_v,
            contacts: inputs.contacts,
            received: Vec::new(),
            injected_fault: None,
        }
    }

    /// The inputs that the firmware reads; none if the number of counters is not `NY`.
    pub fn inputs(&self) -> Option<Inputs<NY>> {
        let raw_counts = self.raw_counts.as_slice().try_into().ok()?;
        Some(Inputs { raw_counts, supply_v: self.supply_v, contacts: self.contacts })
    }
}
