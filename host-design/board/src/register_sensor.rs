//! Absolute sensors outside the chip whose registers are read on two wires (UM10204, Fast-mode Plus), each with a data
//! wire of its own.

use crate::clock::{Time, UNITS_PER_MICROSECOND};
use crate::error::Violation;

/// Least time for which the clock is low, and high; between data and clock; and from a stop to a start (UM10204, table
/// 10).
const LOW: Time = 500 * UNITS_PER_MICROSECOND / 1000;
const HIGH: Time = 260 * UNITS_PER_MICROSECOND / 1000;
const SET_UP: Time = 50 * UNITS_PER_MICROSECOND / 1000;
const CONDITION: Time = 260 * UNITS_PER_MICROSECOND / 1000;

/// What is wrong with such a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RegisterDefect {
    /// Nothing.
    #[default]
    None,
    /// Its data wire is open.
    WireOpen,
    /// Its data wire has a short circuit to ground.
    WireGrounded,
    /// It answers at another address.
    OtherAddress,
    /// It is in the middle of a byte whose bits are low, and holds the wire, from now on.
    Holds,
}

/// What a sensor is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SlaveState {
    Nothing,
    TakesAddress,
    TakesRegister,
    TakesValue,
    Sends,
}

/// A sensor with registers, at its own data wire.
#[derive(Debug, Clone)]
pub struct RegisterSensor {
    address: u8,
    /// The registers that have a value: the first of them, and their values.
    first: u8,
    values: [u8; 5],
    defect: RegisterDefect,
    pointer: u8,
    doing: SlaveState,
    /// Rising edges of the clock in this byte.
    bits: u32,
    shift: u8,
    acknowledged: bool,
    pulls: bool,
    clock: bool,
    data: bool,
    /// When the clock, and the data wire, last changed.
    edges: [Time; 2],
}

impl RegisterSensor {
    /// A sensor at this address, whose registers from `first` on have these values.
    pub fn new(address: u8, first: u8, values: [u8; 5]) -> Self {
        Self {
            address,
            first,
            values,
            defect: RegisterDefect::None,
            pointer: 0,
            doing: SlaveState::Nothing,
            bits: 0,
            shift: 0,
            acknowledged: false,
            pulls: false,
            clock: true,
            data: true,
            edges: [0; 2],
        }
    }

    /// Changes the values of its registers.
    pub fn set_values(&mut self, values: [u8; 5]) {
        self.values = values;
    }

    /// Begins a defect.
    pub fn set_defect(&mut self, defect: RegisterDefect) {
        self.defect = defect;
        if defect == RegisterDefect::Holds {
            // It has sent two bits of a byte of zeros when a reading was broken off.
            (self.doing, self.bits, self.shift, self.pulls) = (SlaveState::Sends, 2, 0, true);
        }
    }

    /// Whether it pulls its data wire low.
    pub fn pulls(&self) -> bool {
        self.defect == RegisterDefect::WireGrounded || self.pulls && self.defect != RegisterDefect::WireOpen
    }

    /// Takes the levels of the clock and of its data wire, without its own pull.
    ///
    /// # Errors
    /// [`Violation`] if an edge comes too soon.
    pub fn hear(&mut self, clock: bool, released: bool, now: Time) -> Result<(), Violation> {
        let data = match self.defect {
            RegisterDefect::WireOpen => true,
            _ => released && !self.pulls(),
        };
        let (had_clock, had_data) = (self.clock, self.data);
        let [clocked, changed] = self.edges;
        let is_too_soon = match (had_clock != clock, had_data != data) {
            (true, _) if clock => now - clocked < LOW || now - changed < SET_UP,
            (true, _) => now - clocked < HIGH || now - changed < CONDITION && self.bits == 0,
            (false, true) if clock => now - clocked < CONDITION,
            _ => false,
        };
        if is_too_soon {
            return Err(Violation::Forbidden("an edge on two wires too soon"));
        }
        (self.clock, self.data) = (clock, data);
        if had_clock != clock {
            self.edges[0] = now;
            if clock { self.rises(data) } else { self.falls() }
        } else if clock && had_data != data {
            // A start, or a stop. One that holds its wire cannot hear them.
            (self.doing, self.bits, self.shift) =
                (if data { SlaveState::Nothing } else { SlaveState::TakesAddress }, 0, 0);
        }
        let data = released && !self.pulls();
        if had_data != data {
            self.edges[1] = now;
        }
        self.data = data || self.defect == RegisterDefect::WireOpen;
        Ok(())
    }

    fn rises(&mut self, data: bool) {
        self.bits += 1;
        match (self.bits, self.doing) {
            (9, _) => self.acknowledged = !data,
            (_, SlaveState::Nothing | SlaveState::Sends) => {}
            _ => self.shift = self.shift << 1 | u8::from(data),
        }
    }

    fn falls(&mut self) {
        match (self.bits, self.doing) {
            (_, SlaveState::Nothing) => self.pulls = false,
            (8, SlaveState::Sends) => self.pulls = false,
            (8, _) => self.take(),
            (9, _) => {
                self.bits = 0;
                self.next();
            }
            (1.., SlaveState::Sends) => self.pulls = self.shift >> (7 - self.bits) & 1 == 0,
            _ => {}
        }
    }

    /// A byte has come: acknowledges it, if it is meant.
    fn take(&mut self) {
        let address = self.address ^ u8::from(self.defect == RegisterDefect::OtherAddress);
        match self.doing {
            SlaveState::TakesAddress if self.shift >> 1 != address => self.doing = SlaveState::Nothing,
            SlaveState::TakesRegister => self.pointer = self.shift,
            _ => {}
        }
        self.pulls = self.doing != SlaveState::Nothing;
    }

    /// After an acknowledge.
    fn next(&mut self) {
        self.pulls = false;
        self.doing = match self.doing {
            SlaveState::TakesAddress if self.shift & 1 == 0 => SlaveState::TakesRegister,
            SlaveState::TakesAddress => SlaveState::Sends,
            SlaveState::Sends if !self.acknowledged => SlaveState::Nothing,
            SlaveState::Sends => SlaveState::Sends,
            SlaveState::TakesRegister | SlaveState::TakesValue => SlaveState::TakesValue,
            SlaveState::Nothing => SlaveState::Nothing,
        };
        self.shift = 0;
        if self.doing == SlaveState::Sends {
            let value = self.values.get(usize::from(self.pointer.wrapping_sub(self.first)));
            self.shift = value.copied().unwrap_or_default();
            self.pointer = self.pointer.wrapping_add(1);
            self.pulls = self.shift & 0x80 == 0;
        }
    }
}
