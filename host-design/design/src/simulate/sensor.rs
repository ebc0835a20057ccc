//! A sensor of the simulated rig, up to the count that the firmware reads.

use upright::control::encoder::AbsoluteSensor;

use crate::rig::{AbsoluteRange, Rig, Sensor};

/// A sensor as the board reads it: an encoder with its counter, or an absolute sensor.
pub(super) struct SimulatedSensor {
    /// Index of the state that it measures.
    pub(super) state: usize,
    /// Its noise, root mean square (unit of the state).
    pub(super) noise: f64,
    step: f64,
    absolute: Option<Absolute>,
}

/// An absolute sensor, and what the board makes of its readings.
struct Absolute {
    range: AbsoluteRange,
    /// The last position (counts).
    counts: i64,
    /// The count at position 0 on the turn on which the sensor was switched on.
    at_zero: u32,
    board: AbsoluteSensor,
}

impl SimulatedSensor {
    /// The sensors of a rig that is switched on in this state. An absolute sensor of the cart reads `counter_start` at
    /// position 0.
    pub(super) fn all(rig: &Rig, counter_start: u32, state: &[f64]) -> Vec<Self> {
        rig.sensors().iter().map(|sensor| Self::of(sensor, counter_start, state[sensor.state])).collect()
    }

    fn of(sensor: &Sensor, counter_start: u32, position: f64) -> Self {
        let step: f64 = sensor.step();
        let counts = nearest(position / step);
        let absolute = sensor.absolute.map(|mut range| {
            if sensor.state == 0 {
                range.zero = counter_start % range.turn;
            }
            Absolute::switched_on(range, counts)
        });
        Self { state: sensor.state, noise: sensor.noise, step, absolute }
    }

    /// The count at this position (unit of the state), noise included. A counter reads `counter_start` at 0.
    pub(super) fn count(&mut self, position: f64, counter_start: u32) -> u32 {
        let counts = nearest(position / self.step);
        match &mut self.absolute {
            None => counter_start.wrapping_add(counts as u32),
            Some(absolute) => absolute.count(counts),
        }
    }

    /// A hand has moved the rig to this position (unit of the state). It is slower than the board.
    pub(super) fn carry(&mut self, position: f64) {
        let counts = nearest(position / self.step);
        if let Some(absolute) = &mut self.absolute {
            absolute.carry(counts);
        }
    }

    /// Counts on from where `before` is, which is the same sensor.
    pub(super) fn take_over(&mut self, before: &Self) {
        if let (Some(absolute), Some(before)) = (&mut self.absolute, &before.absolute) {
            (absolute.counts, absolute.at_zero) = (before.counts, before.at_zero);
            absolute.board.clone_from(&before.board);
        }
    }

    /// Whether a count is one in the dead band.
    pub(super) fn is_dead(&self, count: u32) -> bool {
        self.absolute.as_ref().is_some_and(|absolute| absolute.range.is_dead(count))
    }

    /// The count at position 0.
    pub(super) fn at_zero(&self, counter_start: u32) -> u32 {
        self.absolute.as_ref().map_or(counter_start, |absolute| absolute.at_zero)
    }
}

impl Absolute {
    /// A sensor whose first reading is that at `counts`.
    fn switched_on(range: AbsoluteRange, counts: i64) -> Self {
        let mut sensor = Self { range, counts, at_zero: 0, board: AbsoluteSensor::new(range.bits) };
        // A potentiometer has no count in its dead band, but a position.
        let first = if range.has_dead_band() { range.turned(counts) } else { sensor.count(counts) };
        sensor.at_zero = first.wrapping_sub(counts as u32);
        sensor
    }

    /// What the board makes of the reading at this position (counts): a potentiometer's counter is its reading.
    fn count(&mut self, counts: i64) -> u32 {
        self.counts = counts;
        let reading = self.range.reading(counts);
        if self.range.has_dead_band() { reading } else { self.board.count(reading) }
    }

    /// Goes to this position (counts) in steps of less than half a turn.
    fn carry(&mut self, counts: i64) {
        let (from, steps) = (self.counts, 4 * (counts - self.counts).abs() / i64::from(self.range.turn) + 1);
        for step in 1..=steps {
            self.count(from + (counts - from) * step / steps);
        }
    }
}

/// The nearest integer; of two equally near ones, that away from 0.
#[inline]
pub(super) fn nearest(value: f64) -> i64 {
    // Adds the largest number below a half: adding a half would round up a value just below a half.
    (value + 0.499_999_999_999_999_94_f64.copysign(value)) as i64
}

#[cfg(test)]
mod tests {
    use super::nearest;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn counts_are_rounded_as_by_the_library(value in -1e9..1e9f64, counts in -1_000_000..1_000_000i64, ulps in -2..3i64) {
            prop_assert_eq!(nearest(value), libm::round(value) as i64);
            let half = f64::from_bits((counts as f64 + 0.5).to_bits().wrapping_add_signed(ulps));
            prop_assert_eq!(nearest(half), libm::round(half) as i64);
        }
    }
}
