//! Absolute sensors: their zeros, and how far a link or the cart may move that is still.

use crate::table::limits::Limits;
use crate::table::part::part;

part! {
    /// The absolute sensors among `NY` sensors.
    #[derive(Copy)]
    pub struct AbsoluteZeros<NY to MY;> {
        /// Reading of each absolute sensor while the links hang at rest; of the cart's, which has no zero, a turn; -1
        /// for a sensor that only counts (counts).
        pub zero_counts: [i32; NY],
        /// Largest motion of each sensor within [`Limits::still_ticks`] that is still: what noise or the edge of a step
        /// show (counts).
        pub still_counts: [i32; NY],
    }
}

impl<const NY: usize> AbsoluteZeros<NY> {
    /// Sensors that only count.
    pub const fn none() -> Self {
        Self { zero_counts: [-1; NY], still_counts: [1; NY] }
    }

    /// Whether a sensor is absolute.
    pub const fn is_absolute(&self, sensor: usize) -> bool {
        sensor < NY && self.zero_counts[sensor] >= 0
    }

    /// Counts in a turn of an absolute sensor.
    pub const fn turn_counts(&self, limits: &Limits<NY>, sensor: usize) -> u32 {
        let turns = if sensor == 0 { &self.zero_counts } else { &limits.turn_counts };
        turns[sensor].unsigned_abs()
    }

    /// Whether a sensor is a potentiometer, which does not read a whole turn: other absolute sensors have a power of
    /// two of counts in a turn.
    pub const fn is_potentiometer(&self, limits: &Limits<NY>, sensor: usize) -> bool {
        self.is_absolute(sensor) && !self.turn_counts(limits, sensor).is_power_of_two()
    }

    /// `home`, the positions of the sensors where the links hang, with those of links' absolute sensors, which read
    /// `raw`, by their own zeros. None if such a sensor is off by more than half of [`Limits::sign_counts`]: its link
    /// does not hang, or its zero is another one.
    pub fn positions(&self, home: &[i32; NY], raw: &[u32; NY], limits: &Limits<NY>) -> Option<[i32; NY]> {
        let mut positions = *home;
        let of_limits = limits.rest_counts.iter().zip(&limits.turn_counts).zip(&limits.sign_counts);
        let sensors = positions.iter_mut().zip(raw).zip(&self.zero_counts).zip(of_limits);
        for (((position, &raw), &zero), ((&rest, &turn), &enough)) in sensors {
            if zero >= 0 {
                let reading = (raw as i32).wrapping_sub(zero).wrapping_add(rest);
                *position = nearest(reading, *position, turn, enough)?;
            }
        }
        Some(positions)
    }
}

/// The position of a link's absolute sensor with this `reading` that is nearest to `home`; none if it is further away
/// than half of `enough` (counts). The cart has no `turn`, and is at `home`.
// One copy for all sensors: it is not called in a tick.
#[cold]
#[inline(never)]
fn nearest(reading: i32, home: i32, turn: i32, enough: i32) -> Option<i32> {
    let turn = turn.max(1);
    let half = turn / 2;
    let away = reading.wrapping_sub(home).wrapping_add(half).rem_euclid(turn) - half;
    (away.unsigned_abs() <= enough.unsigned_abs() / 2).then_some(home.wrapping_add(away))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits<3> = Limits {
        rest_counts: [0, 2048, 0],
        turn_counts: [0, 4096, 4095],
        sign_counts: [50, 130, 130],
        ..Limits::none()
    };
    const ZEROS: AbsoluteZeros<3> = AbsoluteZeros { zero_counts: [-1, 4000, -1], still_counts: [1; 3] };

    #[test]
    fn an_absolute_sensor_gives_its_own_position_and_is_refused_far_from_hanging() {
        let home = |raw: u32| ZEROS.positions(&[0, 2048, 0], &[77, raw, 99], &LIMITS);
        assert_eq!(home(4000), Some([0, 2048, 0]));
        assert_eq!(home(4060), Some([0, 2108, 0]));
        // 60 counts back, three turns of the sensor on.
        assert_eq!(home(3940 + 3 * 4096), Some([0, 1988, 0]));
        // More than half of 130 counts is too far; a sensor that only counts takes where the links hang.
        assert_eq!((home(4070), home(3930), home(4000 + 2048)), (None, None, None));
        assert_eq!(
            AbsoluteZeros::none().positions(&[0, 2048, 0], &[77, 12, 99], &LIMITS),
            Some([0, 2048, 0])
        );
    }
}
