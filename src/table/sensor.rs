//! The sensors: what each measures, how it reads, and its distances in counts.

use core::f32::consts::TAU;

use crate::boards::parts::{PARTS, PartInterface, SensorPart};
use crate::numbers::{Number, Scalar};
use crate::table::equilibrium::Equilibrium;
use crate::table::part::part;

part! {
    /// A sensor and what is known about its joint, or about the cart, in its counts. If it has no turns, no rest
    /// position or no sign to check (as any sensor of a `[model]`), that value is 0.
    #[derive(Copy)]
    pub struct SensorRow<; T> {
        /// Index of the state that it measures.
        pub state: u32,
        /// How it reads.
        pub kind: SensorKind,
        /// Travel per count (m or rad).
        pub step: T,
        /// Age of a reading (s): it shows the state as it was, less the next state, the rate, by this time.
        pub delay_s: T,
        /// A whole turn of the joint; 0 for the cart (counts).
        pub turn_counts: i32,
        /// Position while the links hang at rest: half a turn for the first link, else 0 (counts).
        pub rest_counts: i32,
        /// Distance that it has to be moved when its sign is checked (counts).
        pub sign_counts: i32,
        /// Largest motion within `arm_ticks` that is still slow (counts).
        pub slow_counts: i32,
        /// Largest motion within `still_ticks` that noise or the edge of a step show (counts).
        pub still_counts: i32,
    }
}

part! {
    /// How a sensor reads.
    pub enum SensorKind<> {
        /// It only counts: homing gives it its position.
        Counter = 0,
        /// It reads where it is within a turn of it.
        Absolute(reading: ReadingMap) = 1,
        /// It reads where it is, but not a whole turn: its readings do not wrap.
        Potentiometer(reading: ReadingMap) = 2,
        /// It is a part that boards know, and reads where it is within a turn of it.
        OfPart(part: PartReading) = 3,
    }
}

part! {
    /// The readings of an absolute sensor.
    #[derive(Copy)]
    pub struct ReadingMap<;> {
        /// Bits of a reading.
        pub bits: u32,
        /// Reading while the links hang at rest; 0 for the cart's, which has no zero (counts).
        pub zero_counts: i32,
    }
}

part! {
    /// The readings of a part, and its errors once and twice per turn.
    #[derive(Copy)]
    pub struct PartReading<;> {
        /// Bits of a reading, and the one while the links hang at rest.
        pub reading: ReadingMap,
        /// Number of its row in [`PARTS`](crate::boards::parts::PARTS).
        pub part: u32,
        /// Error at the angle ψ from where the links hang, which is taken out of the readings:
        /// `e(ψ) = c₁ (cos ψ - 1) + s₁ sin ψ + c₂ (cos 2ψ - 1) + s₂ sin 2ψ` with c₁, s₁, c₂ and s₂ (counts).
        pub errors: [f32; 4],
    }
}

impl PartReading {
    /// The count less the error of its reading. The error is that of the angle, which the reading is near to.
    pub fn without_error(&self, count: u32) -> u32 {
        if self.errors == [0.0; 4] {
            return count;
        }
        let ReadingMap { bits, zero_counts } = self.reading;
        let turn = 1i32 << (bits & 31);
        let turned = count.wrapping_sub(zero_counts as u32) & (turn as u32).wrapping_sub(1);
        let (turned, per_count) = (turned as f32, TAU / turn as f32);
        let error = self.error(per_count * (turned - self.error(per_count * turned)));
        let half = if error < 0.0 { -0.5 } else { 0.5 };
        count.wrapping_sub((error + half) as i32 as u32)
    }

    /// Its error at this angle from where the links hang (rad, counts).
    fn error(&self, angle: f32) -> f32 {
        let ([sin], [cos]) = f32::sines_and_cosines(&[angle]);
        let [c1, s1, c2, s2] = self.errors;
        c1 * (cos - 1.0) + s1 * sin + 2.0 * sin * (s2 * cos - c2 * sin)
    }

    /// Its row.
    pub const fn row(&self) -> Option<&'static SensorPart> {
        if (self.part as usize) < PARTS.len() { Some(&PARTS[self.part as usize]) } else { None }
    }
}

/// Takes their errors once and twice per turn out of the readings of sensors that are parts.
pub fn without_errors(sensors: &[SensorRow], raw_counts: &mut [u32]) {
    for (row, count) in sensors.iter().zip(raw_counts) {
        if let SensorKind::OfPart(part) = row.kind {
            *count = part.without_error(*count);
        }
    }
}

impl SensorKind {
    /// Its readings, if it is absolute.
    pub const fn reading(&self) -> Option<&ReadingMap> {
        match self {
            SensorKind::Counter => None,
            SensorKind::Absolute(reading) | SensorKind::Potentiometer(reading) => Some(reading),
            SensorKind::OfPart(part) => Some(&part.reading),
        }
    }

    /// The same, to change them.
    pub const fn reading_mut(&mut self) -> Option<&mut ReadingMap> {
        match self {
            SensorKind::Counter => None,
            SensorKind::Absolute(reading) | SensorKind::Potentiometer(reading) => Some(reading),
            SensorKind::OfPart(part) => Some(&mut part.reading),
        }
    }

    /// Its row, if it is a part.
    pub const fn row(&self) -> Option<&'static SensorPart> {
        match self {
            SensorKind::OfPart(part) => part.row(),
            _ => None,
        }
    }

    /// How a board reads it, if it is absolute.
    pub const fn interface(&self) -> Option<PartInterface> {
        match self {
            SensorKind::Counter => None,
            SensorKind::Absolute(_) => Some(PartInterface::Frames),
            SensorKind::Potentiometer(_) => Some(PartInterface::Analog),
            SensorKind::OfPart(part) => match part.row() {
                Some(row) => Some(row.interface),
                None => None,
            },
        }
    }
}

impl<T: Scalar> Default for SensorRow<T> {
    /// A counter of state 0 whose counts have no size.
    fn default() -> Self {
        Self {
            state: 0,
            kind: SensorKind::Counter,
            step: T::default(),
            delay_s: T::default(),
            turn_counts: 0,
            rest_counts: 0,
            sign_counts: 0,
            slow_counts: 0,
            still_counts: 0,
        }
    }
}

impl SensorRow {
    /// Whether every distance has a valid value.
    pub(crate) fn is_sound(&self) -> bool {
        let Self { turn_counts, sign_counts, slow_counts, still_counts, .. } = *self;
        let is_known = match self.kind {
            SensorKind::OfPart(part) => part.row().is_some_and(|row| row.bits == part.reading.bits),
            _ => true,
        };
        is_known
            && self.delay_s >= 0.0
            && [turn_counts, sign_counts, slow_counts, still_counts].iter().all(|&counts| counts >= 0)
    }

    /// `count` with whole turns removed from the joint, so that it is within half a turn of 0.
    pub fn within_half_a_turn(&self, count: i32) -> i32 {
        match self.turn_counts {
            turn if turn > 0 => count.wrapping_add(turn / 2).rem_euclid(turn) - turn / 2,
            _ => count,
        }
    }

    /// Whether the link hangs at rest at this count, to within half of [`sign_counts`](Self::sign_counts).
    pub fn hangs(&self, count: i32) -> bool {
        let moved = self.within_half_a_turn(count.wrapping_sub(self.rest_counts));
        self.sign_counts == 0 || moved.unsigned_abs() <= self.sign_counts.unsigned_abs() / 2
    }

    /// The position of the link when it reads `raw`: that of its own zero that is nearest to `home`, if it is absolute,
    /// else `home`. The cart has no zero, and is at `home`. None if an absolute sensor is off by more than half of
    /// [`sign_counts`](Self::sign_counts): its link does not hang, or its zero is another one.
    // One copy for all sensors: it is not called in a tick.
    #[cold]
    #[inline(never)]
    pub fn home_position(&self, home: i32, raw: u32) -> Option<i32> {
        let (Some(reading), 1..) = (self.kind.reading(), self.turn_counts) else { return Some(home) };
        let position = (raw as i32).wrapping_sub(reading.zero_counts).wrapping_add(self.rest_counts);
        let away = self.within_half_a_turn(position.wrapping_sub(home));
        (away.unsigned_abs() <= self.sign_counts.unsigned_abs() / 2).then_some(home.wrapping_add(away))
    }

    /// Counts of this `sensor`, by its number, at rest `at` an equilibrium. The first sensor is the cart's, and every
    /// joint has one.
    pub(crate) fn at_rest(&self, sensor: usize, at: Equilibrium) -> i32 {
        sensor.checked_sub(1).map_or(0, |joint| at.half_turns(joint) * (self.turn_counts / 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absolute_sensor_gives_its_own_position_and_is_refused_far_from_hanging() {
        let of_kind = |kind| SensorRow {
            kind,
            turn_counts: 4096,
            rest_counts: 2048,
            sign_counts: 130,
            ..SensorRow::default()
        };
        let reading = ReadingMap { bits: 12, zero_counts: 4000 };
        for kind in [SensorKind::Absolute(reading), SensorKind::Potentiometer(reading)] {
            let home = |raw: u32| of_kind(kind).home_position(2048, raw);
            assert_eq!(home(4000), Some(2048));
            assert_eq!(home(4060), Some(2108));
            // 60 counts back, three turns of the sensor on.
            assert_eq!(home(3940 + 3 * 4096), Some(1988));
            // More than half of 130 counts is too far.
            assert_eq!((home(4070), home(3930), home(4000 + 2048)), (None, None, None));
        }
        // A sensor that only counts takes where the links hang, and the cart's has no zero.
        assert_eq!(of_kind(SensorKind::Counter).home_position(2048, 12), Some(2048));
        let cart = SensorRow { kind: SensorKind::Absolute(reading), sign_counts: 50, ..SensorRow::default() };
        assert_eq!(cart.home_position(7, 99), Some(7));
    }

    #[test]
    fn whole_turns_are_taken_away_and_nothing_else() {
        let of_turn = |turn_counts| SensorRow { turn_counts, ..SensorRow::default() };
        for turns in -3..=3 {
            assert_eq!(of_turn(4096).within_half_a_turn(4096 * turns + 7), 7);
            assert_eq!(of_turn(4095).within_half_a_turn(4095 * turns - 9), -9);
        }
        assert_eq!(
            (of_turn(0).within_half_a_turn(5000), of_turn(4096).within_half_a_turn(2047)),
            (5000, 2047)
        );
    }

    #[test]
    fn an_impossible_distance_is_found() {
        let sound = SensorRow { turn_counts: 4096, sign_counts: 130, slow_counts: 1, ..SensorRow::default() };
        assert!(sound.is_sound());
        for unsound in [
            SensorRow { turn_counts: -1, ..sound },
            SensorRow { sign_counts: -1, ..sound },
            SensorRow { slow_counts: -1, ..sound },
            SensorRow { still_counts: -1, ..sound },
            SensorRow { delay_s: f32::NAN, ..sound },
            SensorRow { delay_s: -1e-3, ..sound },
        ] {
            assert!(!unsound.is_sound(), "{unsound:?}");
        }
    }
}
