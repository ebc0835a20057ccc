//! The sign check: does every encoder count in the right direction, and is it plugged in at its own place?
//!
//! A person turns the links counter-clockwise one by one, from the outermost inwards, and then pushes the cart along
//! +x. Each step starts with the links hanging at rest and lasts until a sensor has moved by its
//! [`sign_counts`](crate::table::SensorRow::sign_counts). The requested sensor has to be the first to do so, among
//! itself and all sensors further inwards, and in the positive direction. (Links further out keep hanging and so turn
//! backwards against the one being turned; they were checked before.) A reversed encoder moves in the negative
//! direction; of two swapped encoders, the inner one moves instead of the outer one.

use serde::{Deserialize, Serialize};

use crate::table::SensorRow;

/// Progress of the sign check; sensors are numbered (0: cart, 1: first link …).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Signs {
    /// Not started since power-up.
    #[default]
    Unchecked,
    /// Let the links hang at rest; this sensor is next.
    Rest(u8),
    /// Move this sensor: turn the link counter-clockwise, or push the cart along +x.
    Move(u8),
    /// All signs are right.
    Checked,
    /// This sensor has moved in the wrong direction.
    Reversed(u8),
    /// A sensor other than the requested one has moved.
    Swapped {
        /// Requested sensor.
        asked: u8,
        /// Sensor that has moved.
        moved: u8,
    },
}

/// Progress of the check, and the counts at which the current step started.
#[derive(Debug, Clone)]
pub struct SignCheck<const NY: usize> {
    signs: Signs,
    start_counts: [i32; NY],
}

impl<const NY: usize> SignCheck<NY> {
    /// Unchecked, or already checked if these sensors leave nothing to check.
    pub fn new(sensors: &[SensorRow; NY]) -> Self {
        let signs = last_to_check(sensors, NY).map_or(Signs::Checked, |_| Signs::Unchecked);
        Self { signs, start_counts: [0; NY] }
    }

    /// Progress of the check.
    pub fn signs(&self) -> Signs {
        self.signs
    }

    /// Starts with the outermost link.
    pub fn start(&mut self, sensors: &[SensorRow; NY]) {
        self.signs = last_to_check(sensors, NY).map_or(Signs::Checked, Signs::Rest);
    }

    /// Cancels a check in progress; a finished one stays.
    pub fn cancel(&mut self) {
        if matches!(self.signs, Signs::Rest(_) | Signs::Move(_)) {
            self.signs = Signs::Unchecked;
        }
    }

    /// Takes the counts of a tick, and whether the links hang at rest.
    #[inline(never)]
    pub fn update(&mut self, counts: &[i32; NY], at_rest: bool, rows: &[SensorRow; NY]) {
        match self.signs {
            Signs::Rest(next) if at_rest => (self.signs, self.start_counts) = (Signs::Move(next), *counts),
            Signs::Move(asked) => self.update_move(asked, counts, rows),
            _ => {}
        }
    }

    fn update_move(&mut self, asked: u8, counts: &[i32; NY], rows: &[SensorRow; NY]) {
        let sensors = counts.iter().zip(&self.start_counts).zip(rows).zip(0..=asked);
        let far = sensors
            .map(|(((count, from), row), sensor)| (count.wrapping_sub(*from), row.sign_counts, sensor));
        let mut far =
            far.filter(|&(moved, enough, _)| enough > 0 && moved.unsigned_abs() >= enough.unsigned_abs());
        let Some((moved, _, sensor)) = far.next() else { return };
        self.signs = if sensor != asked {
            Signs::Swapped { asked, moved: sensor }
        } else if moved < 0 {
            Signs::Reversed(asked)
        } else {
            last_to_check(rows, usize::from(asked)).map_or(Signs::Checked, Signs::Rest)
        };
    }
}

/// The last sensor before `end` that has a sign to check.
#[inline(never)]
fn last_to_check<const NY: usize>(rows: &[SensorRow; NY], end: usize) -> Option<u8> {
    let sensors = rows.iter().take(end).zip(0u8..);
    sensors.filter(|(row, _)| row.sign_counts > 0).map(|(_, sensor)| sensor).last()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensors<const NY: usize>(enough: [i32; NY]) -> [SensorRow; NY] {
        enough.map(|sign_counts| SensorRow { sign_counts, ..SensorRow::default() })
    }

    /// Result when a person moves each requested sensor; `wire` turns true counts into those that the firmware reads.
    fn check(wire: impl Fn([i32; 3]) -> [i32; 3]) -> Signs {
        let enough = sensors([50, 130, 130]);
        let mut check = SignCheck::new(&enough);
        check.start(&enough);
        for tick in 0.. {
            let moved = 1 + tick % 200;
            let counts = match check.signs() {
                Signs::Rest(_) => [0, 0, 0],
                Signs::Move(2) => [0, 0, moved],
                // The outer link keeps hanging.
                Signs::Move(1) => [0, moved, -moved],
                // The links swing back while the cart is pushed.
                Signs::Move(0) => [moved, 2 * moved, -2 * moved],
                end => return end,
            };
            check.update(&wire(counts), counts == [0, 0, 0], &enough);
            assert!(tick < 10_000);
        }
        Signs::Unchecked
    }

    #[test]
    fn right_wiring_passes() {
        assert_eq!(check(|counts| counts), Signs::Checked);
        assert_eq!(check(|[x, a, b]| [x + 7, a + 2048, b]), Signs::Checked);
    }

    #[test]
    fn every_reversed_encoder_is_named() {
        assert_eq!(check(|[x, a, b]| [x, a, -b]), Signs::Reversed(2));
        assert_eq!(check(|[x, a, b]| [x, -a, b]), Signs::Reversed(1));
        assert_eq!(check(|[x, a, b]| [-x, a, b]), Signs::Reversed(0));
    }

    #[test]
    fn every_pair_of_swapped_encoders_is_named() {
        assert_eq!(check(|[x, a, b]| [x, b, a]), Signs::Swapped { asked: 2, moved: 1 });
        assert_eq!(check(|[x, a, b]| [b, a, x]), Signs::Swapped { asked: 2, moved: 0 });
        assert_eq!(check(|[x, a, b]| [a, x, b]), Signs::Swapped { asked: 1, moved: 0 });
        assert_eq!(check(|[x, a, b]| [x, -b, -a]), Signs::Swapped { asked: 2, moved: 1 });
    }

    #[test]
    fn a_rig_with_nothing_to_check_is_checked() {
        assert_eq!(SignCheck::new(&sensors([0, 0])).signs(), Signs::Checked);
        assert_eq!(SignCheck::new(&sensors([50, 130, 130])).signs(), Signs::Unchecked);
    }
}
