//! Absolute sensors outside the chip: AS5047P, with frames of 16 bits (its datasheet, SPI interface).

use crate::clock::{Time, UNITS_PER_MICROSECOND};
use crate::error::Violation;
use crate::wiring::Pin;

/// What is wrong with an absolute sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SensorDefect {
    /// Nothing.
    #[default]
    None,
    /// Its data wire is open.
    WireOpen,
    /// Its data wire has a short circuit to ground.
    WireGrounded,
    /// Its magnet is missing.
    NoMagnet,
    /// The angle is held, although the magnet turns.
    Stuck,
    /// These bits of every frame with an angle are wrong.
    FlippedBits(u16),
}

/// Time from power-on until a sensor is ready.
const START: Time = 10_000 * UNITS_PER_MICROSECOND;
/// Least time from select to the first edge of the clock, and between two frames.
const PAUSE: Time = 350 * UNITS_PER_MICROSECOND / 1000;
/// Least time between two edges of the clock.
const HALF: Time = 50 * UNITS_PER_MICROSECOND / 1000;

// Registers: errors, state (DIAAGC) and angle.
const ERRORS: u16 = 0x0001;
const STATE: u16 = 0x3ffc;
const ANGLE: u16 = 0x3fff;

// Errors: of the number of clocks, of the register, of the parity.
const FRAMING: u16 = 1;
const COMMAND: u16 = 2;
const PARITY: u16 = 4;

/// State: the magnet is missing or too far, the sensor is ready; the gain.
const MAGNET_LOW: u16 = 1 << 11;
const READY: u16 = 1 << 8;
const GAIN: u16 = 0x80;

/// Levels of the wires that a sensor hears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct AngleBus {
    pub(crate) select: bool,
    pub(crate) clock: bool,
    pub(crate) command: bool,
}

/// A sensor, with its data wire.
#[derive(Debug, Clone)]
pub(crate) struct AngleSensor {
    pub(crate) data: Pin,
    /// 14 bits.
    pub(crate) reading: u16,
    pub(crate) defect: SensorDefect,
    bus: AngleBus,
    /// The register that the next frame shows.
    asked: u16,
    sent: u16,
    received: u16,
    clocks: u32,
    errors: u16,
    /// When a wire last changed its level.
    edge: Time,
}

impl AngleSensor {
    pub(crate) fn new(data: Pin) -> Self {
        let bus = AngleBus { select: true, clock: false, command: false };
        Self {
            data,
            reading: 0,
            defect: SensorDefect::None,
            bus,
            asked: 0,
            sent: 0,
            received: 0,
            clocks: 0,
            errors: 0,
            edge: 0,
        }
    }

    /// Takes the levels of the wires; returns the level of the data wire, or none while nothing drives it.
    pub(crate) fn hear(&mut self, bus: AngleBus, now: Time) -> Result<Option<bool>, Violation> {
        let before = std::mem::replace(&mut self.bus, bus);
        let waited = now - self.edge;
        match (before.select != bus.select, before.clock != bus.clock) {
            (true, _) => {
                if waited < if bus.select { HALF } else { PAUSE } {
                    return Err(Violation::Forbidden("select of an absolute sensor too soon"));
                }
                if bus.select {
                    self.end()
                } else {
                    self.begin(now)
                }
                self.edge = now;
            }
            (_, true) => {
                let least = if self.clocks == 0 && bus.clock { PAUSE } else { HALF };
                if !bus.select && waited < least {
                    return Err(Violation::Forbidden("clock of an absolute sensor too fast"));
                }
                if bus.clock && self.clocks > 0 {
                    self.sent <<= 1;
                } else if !bus.clock {
                    (self.received, self.clocks) =
                        (self.received << 1 | u16::from(bus.command), self.clocks + 1);
                }
                self.edge = now;
            }
            _ => {}
        }
        Ok(match self.defect {
            SensorDefect::WireOpen => None,
            SensorDefect::WireGrounded => Some(false),
            _ => (!bus.select).then_some(self.sent & 0x8000 != 0),
        })
    }

    fn begin(&mut self, now: Time) {
        let errors = self.errors;
        let value = match self.asked {
            ANGLE if now < START => 0,
            ANGLE => self.reading,
            STATE if now < START => GAIN,
            STATE if self.defect == SensorDefect::NoMagnet => MAGNET_LOW | READY | 0xff,
            STATE => READY | GAIN,
            ERRORS => std::mem::take(&mut self.errors),
            _ => 0,
        };
        let flag = if errors != 0 { 1 << 14 } else { 0 };
        self.sent = with_parity(value | flag);
        if let (SensorDefect::FlippedBits(bits), ANGLE) = (self.defect, self.asked) {
            self.sent ^= bits;
        }
        (self.received, self.clocks) = (0, 0);
    }

    fn end(&mut self) {
        let command = self.received;
        if self.clocks != 16 {
            self.errors |= FRAMING;
        } else if !command.count_ones().is_multiple_of(2) {
            self.errors |= PARITY;
        } else {
            self.asked = command & 0x3fff;
            if ![ERRORS, STATE, ANGLE].contains(&self.asked) {
                self.errors |= COMMAND;
            }
        }
    }
}

/// The value with the bit that makes the parity even.
fn with_parity(value: u16) -> u16 {
    value | (value.count_ones() as u16 % 2) << 15
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wiring::pin;

    const NS: Time = UNITS_PER_MICROSECOND;

    /// Sends a frame of this many clocks; returns the answer, or what was wrong.
    fn frame(
        sensor: &mut AngleSensor,
        now: &mut Time,
        command: u16,
        clocks: u16,
        half_ns: Time,
    ) -> Result<u16, Violation> {
        let mut answer = 0;
        let mut hear = |select, clock, command, ns: Time| {
            *now += ns * NS / 1000;
            sensor.hear(AngleBus { select, clock, command }, *now)
        };
        hear(false, false, false, 400)?;
        hear(false, false, false, 400)?;
        for bit in (16 - clocks..16).rev() {
            let bit = command & 1 << bit != 0;
            hear(false, true, bit, half_ns)?;
            answer = answer << 1 | u16::from(hear(false, false, bit, half_ns)?.unwrap_or(true));
        }
        hear(true, false, false, 400)?;
        Ok(answer)
    }

    #[test]
    fn a_sensor_answers_the_last_command_and_flags_errors_until_they_are_read() {
        let (mut sensor, mut now) = (AngleSensor::new(pin('A', 0)), START);
        sensor.reading = 0x1234;
        let mut ask = |command, clocks| frame(&mut sensor, &mut now, command, clocks, 60).unwrap();
        ask(0xffff, 16);
        assert_eq!(ask(0xfffc, 16), 0x9234);
        assert_eq!(ask(0xffff, 16), 0x0180, "ready, gain");
        // One clock is missing: the flag is set until the errors are read.
        ask(0xffff, 15);
        assert_eq!(ask(0xffff, 16) & 0x4000, 0x4000);
        assert_eq!(ask(0x4001, 16) & 0x4000, 0x4000);
        assert_eq!(ask(0xffff, 16) & 0x3fff, FRAMING);
        assert_eq!(ask(0xffff, 16), 0x9234);
        // A command with odd parity.
        ask(0x7fff, 16);
        assert_eq!(ask(0x4001, 16) & 0x4000, 0x4000);
        assert_eq!(ask(0xffff, 16) & 0x3fff, PARITY);
    }

    #[test]
    fn edges_that_are_too_fast_end_the_run() {
        let (mut sensor, mut now) = (AngleSensor::new(pin('A', 0)), START);
        assert!(frame(&mut sensor, &mut now, 0xffff, 16, 51).is_ok());
        assert!(frame(&mut sensor, &mut now, 0xffff, 16, 40).is_err());
    }

    #[test]
    fn defects_show_in_the_frames() {
        let (mut sensor, mut now) = (AngleSensor::new(pin('A', 0)), START);
        let mut shown = |defect, command| {
            sensor.defect = defect;
            frame(&mut sensor, &mut now, command, 16, 60).unwrap();
            frame(&mut sensor, &mut now, command, 16, 60).unwrap()
        };
        assert_eq!(shown(SensorDefect::WireOpen, 0xffff), 0xffff);
        assert_eq!(shown(SensorDefect::WireGrounded, 0xffff), 0);
        assert_eq!(shown(SensorDefect::NoMagnet, 0xfffc) & MAGNET_LOW, MAGNET_LOW);
        assert_eq!(shown(SensorDefect::FlippedBits(1 << 3), 0xffff), 8);
        assert_eq!(shown(SensorDefect::None, 0xffff), 0);
    }
}
