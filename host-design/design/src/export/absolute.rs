//! Sensors of the header that read an angle: where their readings wrap, and where they are none.

use upright::control::encoder::is_at_end;

use super::initializer::Initializer;
use crate::rig::{LinkEncoder, Rig, Sensor};

/// How the sensors of a rig read, if one of them is absolute.
pub(super) struct Readings {
    sensors: Vec<SensorReading>,
}

/// How a sensor reads.
struct SensorReading {
    /// Counts until its reading wraps, less 1.
    range: u32,
    /// Bits of a reading that are finer than those used.
    unused_bits: u32,
    /// Lowest and highest reading that is an angle, of the bits used.
    readings: [u32; 2],
    /// What a program passes, if it is no counter.
    what: Option<String>,
}

impl Readings {
    pub(super) fn of(rig: &Rig) -> Self {
        let bits = rig.chain().into_iter().flat_map(|chain| {
            let of_links = chain.links.iter().filter_map(|link| match link.encoder? {
                LinkEncoder::Absolute { bits, .. } => Some(u32::from(bits)),
                _ => Some(0),
            });
            core::iter::once(chain.cart.sensor_bits.unwrap_or_default() as u32).chain(of_links)
        });
        Self { sensors: rig.sensors().iter().zip(bits).map(|(sensor, bits)| reading(sensor, bits)).collect() }
    }

    pub(super) fn are_absolute(&self) -> bool {
        self.sensors.iter().any(|sensor| sensor.what.is_some())
    }

    /// What a program passes, as part of a comment; nothing if all sensors are counters.
    pub(super) fn comment(&self) -> String {
        let sensors = self.sensors.iter().enumerate();
        let lines: String = sensors
            .filter_map(|(sensor, reading)| Some(format!("     raw[{sensor}]: {}\n", reading.what.as_ref()?)))
            .collect();
        if lines.is_empty() { lines } else { format!("\n   This rig has absolute sensors:\n{lines}") }
    }

    /// The members of the table, if a sensor is absolute.
    pub(super) fn initialise(&self, out: &mut Initializer) {
        if self.are_absolute() {
            out.indices("range", self.sensors.iter().map(|reading| reading.range));
            out.indices("unused_bits", self.sensors.iter().map(|reading| reading.unused_bits));
            out.pairs("readings", self.sensors.iter().map(|reading| reading.readings));
        }
    }
}

/// How this sensor reads; the file gives it so many bits.
fn reading(sensor: &Sensor, bits: u32) -> SensorReading {
    let Some(range) = sensor.absolute else {
        return SensorReading { range: u32::MAX, unused_bits: 0, readings: [0, u32::MAX], what: None };
    };
    let top = (1 << range.bits) - 1;
    if range.has_dead_band() {
        let mut read = (0..=top).filter(|&reading| !is_at_end(reading, range.bits));
        let readings = [read.next().unwrap_or_default(), read.next_back().unwrap_or(top)];
        let what = format!(
            "the potentiometer's reading of {bits} bits, 0 to {}, which does not wrap",
            (1u32 << bits) - 1
        );
        return SensorReading { range: u32::MAX, unused_bits: bits - range.bits, readings, what: Some(what) };
    }
    let what =
        format!("the sensor's reading of {bits} bits, 0 to {}; it may wrap anywhere", (1u32 << bits) - 1);
    SensorReading { range: top, unused_bits: bits - range.bits, readings: [0, u32::MAX], what: Some(what) }
}
