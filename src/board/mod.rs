//! What the firmware reads from the board and gives to it: the one boundary between control code and hardware.

use serde::{Deserialize, Serialize};

use crate::control::actuator::Drive;
use crate::control::encoder::CounterWidth;

/// Everything that is read at the start of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inputs<const NY: usize> {
    /// Raw encoder counters.
    pub raw_counts: [u32; NY],
    /// Supply voltage of the motor's power stage (V).
    pub supply_v: f32,
    /// Contacts and flags.
    pub contacts: Contacts,
}

/// Contacts and flags of a tick; all false is the healthy state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Contacts {
    /// The limit switch at the low end of the rail is pressed, or its wire is open.
    pub limit_low: bool,
    /// The limit switch at the high end of the rail is pressed, or its wire is open.
    pub limit_high: bool,
    /// The emergency stop is pressed, or its wire is open.
    pub emergency_stop: bool,
    /// The power stage has reported a fault since the last tick, however briefly.
    pub driver_fault: bool,
    /// The tick before was not finished when this one was due.
    pub overrun: bool,
    /// The processor's clock is not the one that the tick is counted in: it has failed to start.
    pub clock_fault: bool,
}

/// What goes to the power stage at the end of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Whether the power stage may switch at all; false lets the motor coast.
    pub enable: bool,
    /// The command; [`Drive::OFF`] whenever `enable` is false.
    pub drive: Drive,
}

impl Output {
    /// Motor off.
    pub const OFF: Self = Self { enable: false, drive: Drive::OFF };
}

/// The hardware, as the firmware sees it. One implementation per board, one for the image that runs in the loop with a
/// simulated rig, one in the simulations on the host.
pub trait Board<const NY: usize> {
    /// Widths of the encoders' counters.
    const WIDTHS: [CounterWidth; NY];

    /// Reads all inputs at once. Never waits.
    fn inputs(&mut self) -> Inputs<NY>;

    /// Drives the motor until the next call.
    fn drive(&mut self, output: &Output);

    /// The tick has ended. If it has done so before the next one is due, restarts the independent watchdog, which resets
    /// the microcontroller, motor off, when that does not happen in time.
    fn feed_watchdog(&mut self);

    /// A free-running counter of processor cycles.
    fn cycles(&self) -> u32;
}
