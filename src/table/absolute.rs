//! Absolute sensors of the joints: their zeros, and how far a link may move that is still.

use crate::table::limits::Limits;
use crate::table::part::part;

part! {
    /// The absolute sensors among `NY` sensors.
    #[derive(Copy)]
    pub struct AbsoluteZeros<NY to MY;> {
        /// Reading of each absolute sensor while the links hang at rest; -1 for a sensor that only counts (counts).
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

    /// Whether any sensor is an absolute one.
    pub fn is_any(&self) -> bool {
        self.zero_counts.iter().any(|&zero| zero >= 0)
    }

    /// Whether every zero is within a turn.
    pub(crate) fn is_sound(&self, limits: &Limits<NY>) -> bool {
        let mut zeros = self.zero_counts.iter().zip(&limits.turn_counts);
        zeros.all(|(&zero, &turn)| zero >= -1 && zero < turn.max(1))
            && self.still_counts.iter().all(|&counts| counts >= 0)
    }

    /// `home`, the positions of the sensors where the links hang, with those of absolute sensors, which read `raw`, by
    /// their own zeros; none if such a sensor is off by more than half of [`Limits::sign_counts`], so that its link
    /// does not hang or its zero is another one.
    pub fn positions(&self, home: &[i32; NY], raw: &[u32; NY], limits: &Limits<NY>) -> Option<[i32; NY]> {
        let mut away = [0; NY];
        let sensors = away.iter_mut().zip(raw).zip(&self.zero_counts).zip(&limits.rest_counts).zip(home);
        for ((((away, &raw), &zero), &rest), &home) in sensors {
            if zero >= 0 {
                *away = (raw as i32).wrapping_sub(zero).wrapping_add(rest).wrapping_sub(home);
            }
        }
        let away = limits.within_half_a_turn(&away);
        let mut positions = *home;
        for ((position, &away), &enough) in positions.iter_mut().zip(&away).zip(&limits.sign_counts) {
            if away.unsigned_abs() > enough.unsigned_abs() / 2 {
                return None;
            }
            *position = position.wrapping_add(away);
        }
        Some(positions)
    }
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
        assert!(ZEROS.is_any() && !AbsoluteZeros::<3>::none().is_any());
        assert_eq!(
            AbsoluteZeros::none().positions(&[0, 2048, 0], &[77, 12, 99], &LIMITS),
            Some([0, 2048, 0])
        );
    }

    #[test]
    fn an_impossible_zero_is_found() {
        let with = |zero| AbsoluteZeros { zero_counts: [-1, zero, -1], ..ZEROS }.is_sound(&LIMITS);
        assert!(with(0) && with(4095) && !with(4096) && !with(-2));
        assert!(!AbsoluteZeros { still_counts: [-1; 3], ..ZEROS }.is_sound(&LIMITS));
    }
}
