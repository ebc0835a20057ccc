//! Absolute sensors of cart and links on two wires: the clock is at GP17, each has its data at phase A of an encoder.

use cortex_m::asm;
use upright::boards::two_wires::{self, TwoWires};
use upright::control::encoder::AbsoluteSensor;

use super::chip::CLOCK_HZ;
use super::pins::{self, ANGLE_CLOCK, ENCODERS};
use super::sensors::{ARE_THERE, ON_BUS, PART};
use crate::gains::SENSORS;

/// What the program needs between two edges (ns), at least.
const BETWEEN: u32 = 100;
/// Time until a sensor is ready that was powered on with the microcontroller: it needs 10 ms.
const START: u32 = delay(12_000_000);

/// What [`asm::delay`] needs for at least this time (ns): it counts two cycles for a turn of its loop, which takes
/// three.
const fn delay(ns: u64) -> u32 {
    (ns * CLOCK_HZ as u64 / 1_000_000_000 * 2 / 3) as u32 + 1
}

/// The absolute sensors.
pub(super) struct Angles {
    sensors: [AbsoluteSensor; SENSORS],
}

impl Angles {
    /// Waits until the sensors are ready.
    pub(super) fn set_up() -> Self {
        let bits = if let Some((_, bits)) = PART { bits } else { 0 };
        if ARE_THERE {
            pins::set_clock(true);
            asm::delay(START);
        }
        Self { sensors: core::array::from_fn(|_| AbsoluteSensor::new(bits)) }
    }

    /// Reads all sensors into `raw_counts`; the counts of bad samples are not changed. Returns which are bad, by bits.
    pub(super) fn read(&mut self, raw_counts: &mut [u32; SENSORS]) -> u32 {
        let Some((part, _)) = PART else { return 0 };
        let (angles, bad): ([u16; SENSORS], u32) = two_wires::read(&mut PicoWires, part, ON_BUS);
        for (number, ((count, sensor), angle)) in
            raw_counts.iter_mut().zip(&mut self.sensors).zip(angles).enumerate()
        {
            if ON_BUS & !bad & 1 << number != 0 {
                *count = sensor.count(u32::from(angle));
            }
        }
        bad
    }
}

struct PicoWires;

impl TwoWires for PicoWires {
    #[inline(always)]
    fn set_clock(&mut self, is_high: bool) {
        pins::set_clock(is_high);
    }

    #[inline(always)]
    fn pull(&mut self, low: u32) {
        pins::pull(spread(low), spread(ON_BUS & !low));
    }

    #[inline(always)]
    fn levels(&mut self) -> u32 {
        let pins = pins::levels();
        (0..SENSORS).fold(0, |levels, sensor| levels | (pins >> (ENCODERS[sensor] + 1) & 1) << sensor)
    }

    #[inline(always)]
    fn wait(&self, ns: u32) {
        asm::delay(delay(ns.saturating_sub(BETWEEN).into()));
    }
}

/// The bits of the pins of these sensors' data: phase A, every other pin.
#[inline(always)]
fn spread(sensors: u32) -> u32 {
    (0..SENSORS).fold(0, |pins, sensor| pins | (sensors >> sensor & 1) << (ENCODERS[sensor] + 1))
}

const _: () = assert!(ANGLE_CLOCK > 16, "a pin that something else uses");
