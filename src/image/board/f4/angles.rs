//! Absolute sensors of cart and links on one bus, all read at once: on [two wires](two_wires), or AS5047D or AS5047P
//! with frames (SPI mode 1).
//!
//! Clock, select and command are the same for all of them; each has its data line, at the pin that is channel A of an
//! encoder's. The time of a tick does not depend on how many they are, or what they answer.
//!
//! A sensor answers the last command with the next frame. A tick asks for the angle, and gets its own state, which it
//! was asked for at the end of the tick before; then it gets the angle. Parity finds an odd number of wrong bits; a
//! wire at 3.3 V is an error flag; a wire at 0 V is a sensor that says that it is not ready.

use cortex_m::asm;
use cortex_m::peripheral::DWT;
use upright::boards::f4::ANGLE_BITS;
use upright::boards::parts::PartInterface;
use upright::boards::two_wires::{self, TwoWireReading, TwoWires};
use upright::boards::wiring::{Signal, Wire, wire_of};
use upright::control::encoder::AbsoluteSensor;
use upright::gains::SENSORS;

use super::chosen::BOARD;
use super::pins;
use super::sensors::{ANY_IS_ON_BUS, BITS, BUS, ON_BUS, is_on_bus};

/// In every answer: the sensor has found an error in a command. It stays until the errors are read.
const ERROR_FLAG: u16 = 1 << 14;

// Commands to read a register, with even parity (datasheet, SPI frames and volatile registers).
const READ_ANGLE: u16 = 0xffff;
const READ_STATE: u16 = 0xfffc;
const READ_ERRORS: u16 = 0x4001;

/// Of the state (DIAAGC): the magnet is missing or too far, the angle is not computed, the sensor is ready.
const MAGNET_LOW: u16 = 1 << 11;
const OVERFLOW: u16 = 1 << 9;
const READY: u16 = 1 << 8;

/// Half a period of the clock: the sensor needs 50 ns, and 51 ns for its data.
const HALF: u32 = delay(50);
/// Time between select and clock, and between two frames.
const PAUSE: u32 = delay(350);
/// Time until a sensor is ready that was powered on with the microcontroller: it needs 10 ms.
const START: u32 = delay(12_000_000);

/// What [`asm::delay`] needs for at least this time (ns): it counts two cycles for a turn of its loop, which takes
/// three.
const fn delay(ns: u64) -> u32 {
    (ns * super::CLOCK_HZ as u64 / 1_000_000_000 * 2 / 3) as u32 + 1
}

const SELECT: Wire = bus(Signal::AngleSelect);
const CLOCK: Wire = bus(Signal::AngleClock);
const COMMAND: Wire = bus(Signal::AngleCommand);

/// A wire of the bus; any wire, in an image that has no bus.
const fn bus(signal: Signal) -> Wire {
    wire_of(BOARD.wiring, if ANY_IS_ON_BUS { signal } else { Signal::Tick })
}

/// The absolute sensors.
pub(super) struct Angles {
    sensors: [AbsoluteSensor; SENSORS],
    /// What the next frame answers.
    asked: u16,
}

impl Angles {
    /// The sensors before [`set_up`](Self::set_up).
    pub(super) fn new() -> Self {
        let sensors = [const { AbsoluteSensor::new(BITS) }; SENSORS];
        Self { sensors, asked: READ_STATE }
    }

    /// Waits until the sensors are ready, and asks those with frames for their state.
    pub(super) fn set_up(&self) {
        if TWO_WIRES.is_some() {
            pins::set(CLOCK, true);
            asm::delay(START);
            return;
        }
        pins::set(SELECT, true);
        asm::delay(START);
        // What happened on the bus before the pins were set up is an error that is to be forgotten.
        transfer(READ_ERRORS);
        transfer(self.asked);
    }

    /// Reads all sensors into `raw_counts`; the counts of bad samples are not changed. Returns which are bad, by bits.
    pub(super) fn read(&mut self, raw_counts: &mut [u32; SENSORS]) -> u32 {
        let (angles, bad) = match TWO_WIRES {
            Some(part) => two_wires::read(&mut DataWires, part, ON_BUS),
            None => self.frames(),
        };
        for (number, ((count, sensor), angle)) in
            raw_counts.iter_mut().zip(&mut self.sensors).zip(angles).enumerate()
        {
            if ON_BUS & !bad & 1 << number != 0 {
                *count = sensor.count(angle.into());
            }
        }
        bad
    }

    /// The angles of sensors with frames (counts), and which are bad, by bits.
    fn frames(&mut self) -> ([u16; SENSORS], u32) {
        let mut bad = 0;
        let states = transfer(READ_ANGLE);
        let was_state = self.asked == READ_STATE;
        let has_error = states.iter().zip(0..).any(|(&state, sensor)| is_on_bus(sensor) && !is_sound(state));
        self.asked = if was_state && has_error { READ_ERRORS } else { READ_STATE };
        let mut angles = transfer(self.asked);
        for (number, (angle, state)) in angles.iter_mut().zip(states).enumerate() {
            let is_ready = state & (READY | OVERFLOW | MAGNET_LOW) == READY;
            if !is_sound(*angle) || was_state && !(is_sound(state) && is_ready) {
                bad |= 1 << number;
            }
            *angle &= (1 << ANGLE_BITS) - 1;
        }
        (angles, bad & ON_BUS)
    }
}

/// How the sensors on two wires are read, if they are.
const TWO_WIRES: Option<&TwoWireReading> = match &BUS {
    Some(PartInterface::TwoWires(reading)) => Some(reading),
    _ => None,
};

/// The wires of sensors on two wires.
struct DataWires;

impl TwoWires for DataWires {
    #[inline(always)]
    fn set_clock(&mut self, is_high: bool) {
        pins::set(CLOCK, is_high);
    }

    #[inline(always)]
    fn pull(&mut self, low: u32) {
        macro_rules! pull {
            ($($sensor:literal)*) => {
                $(if let Some(data) = const { data($sensor) } {
                    pins::set(data, low & 1 << $sensor == 0);
                })*
            };
        }
        pull!(0 1 2 3 4);
    }

    #[inline(always)]
    fn levels(&mut self) -> u32 {
        let mut levels = 0;
        macro_rules! take {
            ($($sensor:literal)*) => {
                $(if let Some(data) = const { data($sensor) } {
                    levels |= u32::from(pins::is_high(data)) << $sensor;
                })*
            };
        }
        take!(0 1 2 3 4);
        levels
    }

    #[inline(always)]
    fn wait(&self, ns: u32) {
        // Not by the turns of a loop, which take longer where the flash has to be waited for.
        let (begin, cycles) = (DWT::cycle_count(), ns * (super::CLOCK_HZ / 1_000_000) / 1000 + 1);
        while DWT::cycle_count().wrapping_sub(begin) < cycles {}
    }
}

/// Whether a frame has even parity and no error flag.
fn is_sound(frame: u16) -> bool {
    frame.count_ones().is_multiple_of(2) && frame & ERROR_FLAG == 0
}

/// Sends a command to all sensors, and returns their answers to the one before.
#[inline(never)]
fn transfer(command: u16) -> [u16; SENSORS] {
    let mut answers = [0; SENSORS];
    pins::set(SELECT, false);
    asm::delay(PAUSE);
    for bit in (0..16).rev() {
        pins::set(COMMAND, command & 1 << bit != 0);
        // Both sides change their bit with the rising edge, and take the other's with the falling one.
        pins::set(CLOCK, true);
        asm::delay(HALF);
        pins::set(CLOCK, false);
        asm::delay(HALF);
        macro_rules! take {
            ($($sensor:literal)*) => {
                $(if let (Some(answer), Some(data)) = (answers.get_mut($sensor), const { data($sensor) }) {
                    *answer = *answer << 1 | u16::from(pins::is_high(data));
                })*
            };
        }
        take!(0 1 2 3 4);
    }
    asm::delay(PAUSE);
    pins::set(SELECT, true);
    asm::delay(PAUSE);
    answers
}

/// The data line of a sensor, if it is absolute.
const fn data(sensor: usize) -> Option<Wire> {
    if is_on_bus(sensor) { Some(wire_of(BOARD.wiring, Signal::Encoder(sensor as u8, b'A'))) } else { None }
}
