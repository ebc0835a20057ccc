//! The log of every tick, as messages of up to ten ticks.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::board::{Contacts, Output};
use crate::control::actuator::Drive;

/// Largest number of ticks in a message.
pub const TICKS: usize = 10;
/// [`LoggedTick::drive`] while the motor is off and coasts.
pub const OFF: i16 = i16::MIN;
/// Bytes of a message that its ticks may take, so that it fits into a frame for any number of sensors.
const TICK_BYTES: usize = 300;

/// A message of the log: consecutive ticks with the same contacts.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TickLog<const NY: usize> {
    /// Number of the first tick since the start of the firmware: a lost message shows as a gap.
    pub first: u32,
    /// Contacts in all of these ticks: bit 0 lower limit, 1 upper limit, 2 emergency stop, 3 driver fault.
    pub contacts: u8,
    /// Supply in the first tick (mV).
    pub supply_mv: u16,
    /// The ticks.
    pub ticks: Vec<LoggedTick<NY>, TICKS, u8>,
}

/// A tick of the log. Words are little-endian, and not packed: most need all of their bits.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LoggedTick<const NY: usize> {
    /// Low 16 bits of each sensor's counts from position 0.
    pub counts: Vec<[u8; 2], NY, u8>,
    /// Command to the motor: a duty cycle, or a share of the largest force, 32767 at full scale, or the pulses of the
    /// tick; [`OFF`] if there was none.
    pub drive: [u8; 2],
}

impl<const NY: usize> LoggedTick<NY> {
    /// A tick at these counts, with this output.
    pub fn new(counts: &[i32; NY], output: &Output) -> Self {
        let duty = output.duty;
        let drive = match output.drive {
            _ if !output.enable => OFF,
            Drive::Steps(pulses) => pulses as i16,
            _ => (f32::from(i16::MAX) * duty + f32::copysign(0.5, duty)) as i16,
        };
        Self {
            counts: counts.iter().map(|&count| (count as u16).to_le_bytes()).collect(),
            drive: drive.to_le_bytes(),
        }
    }
}

impl<const NY: usize> TickLog<NY> {
    /// A message that begins with tick `first`.
    pub fn new(first: u32, contacts: &Contacts, supply_v: f32) -> Self {
        Self { first, contacts: bits(contacts), supply_mv: (1e3 * supply_v) as u16, ticks: Vec::new() }
    }

    /// Adds the next tick, if there is room for it.
    pub fn push(&mut self, tick: LoggedTick<NY>) {
        // Full only if the caller has not asked `is_complete`.
        let _ = self.ticks.push(tick);
    }

    /// Whether a tick with these contacts begins another message.
    pub fn is_complete(&self, contacts: &Contacts) -> bool {
        let each = 3 + 2 * NY;
        self.ticks.len() >= TICKS.min(TICK_BYTES / each) || self.contacts != bits(contacts)
    }
}

fn bits(contacts: &Contacts) -> u8 {
    let Contacts { limit_low, limit_high, emergency_stop, driver_fault, .. } = *contacts;
    u8::from(limit_low)
        | u8::from(limit_high) << 1
        | u8::from(emergency_stop) << 2
        | u8::from(driver_fault) << 3
}
