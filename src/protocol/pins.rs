//! The pins of a simulated rig: what takes the place of the wires when an image runs in the loop.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::board::{Contacts, Inputs, Output};

/// Bytes of the serial line that fit into one tick.
pub const BYTES_PER_TICK: usize = 64;
/// Longest frame of [`PinsIn`] for `NY` sensors up to 15.
pub const MAX_PINS_IN: usize = 192;
/// Longest frame of [`PinsOut`].
pub const MAX_PINS_OUT: usize = 32;

/// Host to image: the inputs of one tick.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PinsIn<const NY: usize> {
    /// Raw encoder counters.
    pub counts: Vec<u32, NY>,
    /// Supply voltage (V).
    pub supply_v: f32,
    /// Contacts and flags.
    pub contacts: Contacts,
    /// What arrives on the serial line during this tick.
    pub received: Vec<u8, BYTES_PER_TICK>,
    /// What goes wrong in this tick.
    pub sabotage: Option<Sabotage>,
}

/// What can only go wrong inside the microcontroller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sabotage {
    /// A panic.
    Panic,
    /// An access to an address that does not exist.
    HardFault,
    /// A recursion without end.
    StackOverflow,
}

/// Image to host: the output of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PinsOut {
    /// The output.
    pub output: Output,
    /// Bytes that were sent over the serial line before this tick. A host that reads just these hears the same in every
    /// run, however fast it is.
    pub sent: u32,
}

impl<const NY: usize> PinsIn<NY> {
    /// The inputs of a tick without commands and without sabotage.
    pub fn of(inputs: &Inputs<NY>) -> Self {
        Self {
            counts: Vec::from_array(inputs.counts),
            supply_v: inputs.supply_v,
            contacts: inputs.contacts,
            received: Vec::new(),
            sabotage: None,
        }
    }

    /// What the firmware reads; none if the number of counters is another one.
    pub fn inputs(&self) -> Option<Inputs<NY>> {
        let counts = self.counts.as_slice().try_into().ok()?;
        Some(Inputs { counts, supply_v: self.supply_v, contacts: self.contacts })
    }
}
