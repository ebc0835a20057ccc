//! Encoders: from raw counters of 16 or 32 bits, or readings of absolute sensors, to positions in SI units.

use nalgebra::SVector;

use crate::table::{Scalar, SensorRow};

/// Width of a hardware counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CounterWidth {
    /// 16 bits: wraps after 65 536 counts.
    Bits16,
    /// 32 bits.
    Bits32,
}

/// Tracks hardware counters across wrap-around and knows which count is position 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Encoders<const NY: usize> {
    /// Bit i is set if counter i has 16 bits; one word holds all of them.
    of_16_bits: u32,
    last: [u32; NY],
    /// Counts from position 0. Wraps silently after 2³¹ counts: 49 km at 23 µm per count.
    position: [i32; NY],
}

impl<const NY: usize> Encoders<NY> {
    /// Encoders at position 0 with their counters at 0.
    ///
    /// # Panics
    /// At compile time, for more than 32 counters.
    pub const fn new(widths: [CounterWidth; NY]) -> Self {
        const { assert!(NY <= 32, "at most 32 counters") };
        let mut of_16_bits = 0;
        let mut counter = 0;
        while counter < NY {
            if let CounterWidth::Bits16 = widths[counter] {
                of_16_bits |= 1 << counter;
            }
            counter += 1;
        }
        Self { of_16_bits, last: [0; NY], position: [0; NY] }
    }

    /// Sets the position (counts) at the counter readings `raw`, as found by homing.
    pub fn home(&mut self, raw: &[u32; NY], position: &[i32; NY]) {
        self.last = *raw;
        self.position = *position;
    }

    /// Takes new counter readings. A counter must move by less than half its range between two readings.
    pub fn update(&mut self, raw: &[u32; NY]) {
        for (counter, &raw) in raw.iter().enumerate() {
            self.take(counter, raw);
        }
    }

    /// Takes new counter readings and returns the positions, like [`positions`](Self::positions).
    #[inline(always)]
    pub(crate) fn measure<T: Scalar>(&mut self, raw: &[u32; NY], sensors: &[SensorRow<T>; NY]) -> [T; NY] {
        let mut y = sensors.each_ref().map(|sensor| sensor.step);
        for (counter, &raw) in raw.iter().enumerate() {
            y[counter] *= T::from_counts(self.take(counter, raw));
        }
        y
    }

    /// Takes the new reading of a counter; returns its position (counts).
    #[inline(always)]
    fn take(&mut self, counter: usize, raw: u32) -> i32 {
        let moved = raw.wrapping_sub(self.last[counter]) as i32;
        // The inner cast keeps the low 16 bits: the signed distance modulo the counter's range.
        let moved = if self.of_16_bits & (1 << counter) != 0 { i32::from(moved as i16) } else { moved };
        self.last[counter] = raw;
        self.position[counter] = self.position[counter].wrapping_add(moved);
        self.position[counter]
    }

    /// The reading of a counter that moves from its last one to this position (counts).
    pub(crate) fn reading_at(&self, counter: usize, position: i32) -> Option<u32> {
        let moved = position.wrapping_sub(*self.position.get(counter)?);
        Some(self.last.get(counter)?.wrapping_add(moved as u32))
    }

    /// Positions in counts.
    pub fn counts(&self) -> &[i32; NY] {
        &self.position
    }

    /// Positions in SI units (m or rad).
    #[inline]
    pub fn positions<T: Scalar>(&self, sensors: &[SensorRow<T>; NY]) -> SVector<T, NY> {
        SVector::from_fn(|counter, _| sensors[counter].step * T::from_counts(self.position[counter]))
    }
}

/// A sensor of a joint's absolute angle, as a counter that carries on where the sensor's reading wraps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AbsoluteSensor {
    /// Bits of a reading that are not used: see [`BITS`](Self::BITS).
    unused: u32,
    /// Bits of a counter beyond those of a turn.
    beyond: u32,
    count: u32,
}

impl AbsoluteSensor {
    /// Most bits per turn that are used; of a finer sensor, the upper ones.
    pub const BITS: u32 = 16;

    /// A sensor with this many bits per turn.
    pub const fn new(bits: u32) -> Self {
        let unused = bits.saturating_sub(Self::BITS);
        Self { unused, beyond: u32::BITS - (bits - unused), count: 0 }
    }

    /// The count for a reading. It is the reading, but for whole turns; between two readings, the joint must turn by
    /// less than half a turn.
    pub const fn count(&mut self, reading: u32) -> u32 {
        let moved = (reading >> self.unused).wrapping_sub(self.count);
        // Keeps the bits of a turn, with their sign.
        self.count = self.count.wrapping_add(((moved << self.beyond) as i32 >> self.beyond) as u32);
        self.count
    }
}

/// Whether a reading of this many bits is within a 64th of an end of its range, where it is no angle: the wiper of a
/// potentiometer is in its dead band, or a wire is open or has a short circuit.
pub const fn is_at_end(reading: u32, bits: u32) -> bool {
    matches!(reading >> bits.saturating_sub(6), 0 | 63..)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_wrap_of_the_counter_changes_nothing(start: u32, moves in prop::collection::vec(-30_000i32..30_000, 1..50)) {
            let mut encoders = Encoders::new([CounterWidth::Bits16, CounterWidth::Bits32]);
            let raw = |position: i32| [u32::from(start.wrapping_add(position as u32) as u16), start.wrapping_add(position as u32)];
            encoders.home(&raw(0), &[0, 0]);
            let mut position = 0;
            for step in moves {
                position += step;
                encoders.update(&raw(position));
                prop_assert_eq!(encoders.counts(), &[position, position]);
            }
        }
    }

    /// Largest error (counts) of the positions of a link that turns over the wrap, with `modulo` taking readings.
    fn error_over_the_wrap(bits: u32, mut modulo: impl FnMut(u32) -> u32) -> i32 {
        let reading = |position: i32| (1000u32 << (bits - 12)).wrapping_add(position as u32) % (1 << bits);
        let mut encoders = Encoders::new([CounterWidth::Bits16]);
        encoders.home(&[modulo(reading(0))], &[0]);
        let (unused, mut worst) = (bits.saturating_sub(16), 0);
        for tick in 0..400 {
            // Three turns forwards, and as many back.
            let position = ((tick.min(400 - tick) * 3) << bits) / 200;
            encoders.update(&[modulo(reading(position))]);
            worst = worst.max((encoders.counts()[0] - (position >> unused)).abs());
        }
        worst
    }

    #[test]
    fn a_link_turns_over_the_wrap_of_an_absolute_sensor() {
        for bits in 12..=18 {
            let mut sensor = AbsoluteSensor::new(bits);
            assert!(error_over_the_wrap(bits, |reading| sensor.count(reading)) <= 1, "{bits}");
            // Without the modulo, each pass of the wrap is off by a turn.
            if bits < 16 {
                assert!(error_over_the_wrap(bits, |reading| reading) >= 1 << bits, "{bits}");
            }
        }
    }

    #[test]
    fn counts_become_metres_and_radians() {
        let mut encoders = Encoders::new([CounterWidth::Bits32; 2]);
        encoders.home(&[100, 7], &[0, 50]);
        encoders.update(&[98, 8]);
        let of_step = |step| SensorRow { step, ..SensorRow::default() };
        assert_eq!(encoders.positions(&[0.5f32, 0.25].map(of_step)), SVector::from([-1.0, 12.75]));
    }
}
