//! A row of the table of boards.

use core::fmt;

use super::f4::{self, F4Board};
use super::rp::{self, RpBoard};
use super::wiring;

/// A board.
#[derive(Debug, PartialEq)]
pub struct BoardRow {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is sold as.
    pub product: &'static str,
    /// What only boards of its family have.
    pub family: Family,
}

/// A family of microcontrollers, which share an image but for what is in the row.
#[derive(Debug, PartialEq)]
pub enum Family {
    /// STM32F405, F407 and F446.
    F4(F4Board),
    /// RP2040 and RP2350.
    Rp(RpBoard),
}

/// Processor cycles in a tick of `tick_s` (s), for an image whose boards make ticks from the first to the second of
/// `tick_us` (µs). Any other tick becomes the longest one: the firmware compares it with the table's, and refuses that.
pub fn cycles_per_tick(tick_s: f32, clock_hz: u32, tick_us: [u32; 2]) -> u32 {
    let wanted_us = (f64::from(tick_s) * 1e6 + 0.5) as u32;
    let is_possible = wanted_us >= tick_us[0] && wanted_us <= tick_us[1];
    let tick_s = if is_possible { f64::from(tick_s) } else { f64::from(tick_us[1]) / 1e6 };
    (tick_s * f64::from(clock_hz) + 0.5) as u32
}

/// Most step pulses in a second: a driver needs 2.5 µs from a change of direction to a pulse.
pub const PULSES_HZ: f32 = 200e3;

impl BoardRow {
    /// Its microcontroller.
    pub const fn chip(&self) -> &'static str {
        match &self.family {
            Family::F4(board) => board.chip.name(),
            Family::Rp(board) => board.chip.name(),
        }
    }

    /// Number of encoders that it can count: the cart's and those of the links.
    pub const fn encoders(&self) -> usize {
        match &self.family {
            Family::F4(board) => wiring::encoders(board.wiring),
            Family::Rp(_) => rp::ENCODERS,
        }
    }

    /// Shortest and longest tick that it can make (µs).
    pub const fn tick_us(&self) -> [u32; 2] {
        match &self.family {
            Family::F4(_) => f4::TICK_US,
            Family::Rp(_) => rp::TICK_US,
        }
    }

    /// Most step pulses in a tick.
    pub const fn pulses(&self) -> u32 {
        match &self.family {
            Family::F4(_) => f4::PULSES,
            Family::Rp(_) => rp::PULSES,
        }
    }
}

impl fmt::Display for BoardRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name)
    }
}
