//! Whether every encoder counts the right way and is plugged in at its own place.
//!
//! A person turns the links one by one, from the outermost inwards, counter-clockwise, and then pushes the cart along +x,
//! each until the sensor has moved by its [`sign_counts`](crate::table::limits::Limits::sign_counts); before each, the links hang
//! at rest. Of the sensor that is asked for and those further inwards, the one asked for has to be the first to get so
//! far, and on the positive side. (Links further out hang on, and turn the other way against the one that is turned; they
//! have been checked before.) An encoder that is reversed gets there on the negative side; of two that are swapped, the
//! inner one answers for the outer.

use serde::{Deserialize, Serialize};

/// How far the check is, with numbers of sensors (0: cart, 1: first link …).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Signs {
    /// Not begun since power-up.
    #[default]
    Unchecked,
    /// Let the links hang at rest; this one comes next.
    Rest(u8),
    /// Move this one: turn the link counter-clockwise, push the cart along +x.
    Move(u8),
    /// All are as they should be.
    Checked,
    /// This one has moved the wrong way.
    Reversed(u8),
    /// Another one has moved than was asked for.
    Swapped {
        /// The one that was asked for.
        asked: u8,
        /// The one that has moved.
        moved: u8,
    },
}

/// The check and where it began.
#[derive(Debug, Clone)]
pub struct SignCheck<const NY: usize> {
    signs: Signs,
    from: [i32; NY],
}

impl<const NY: usize> SignCheck<NY> {
    /// Before any check; done if `sign_counts` leave nothing to check.
    pub fn new(sign_counts: &[i32; NY]) -> Self {
        let signs = last(sign_counts, NY).map_or(Signs::Checked, |_| Signs::Unchecked);
        Self { signs, from: [0; NY] }
    }

    /// How far it is.
    pub fn signs(&self) -> Signs {
        self.signs
    }

    /// Begins.
    pub fn begin(&mut self, sign_counts: &[i32; NY]) {
        self.signs = last(sign_counts, NY).map_or(Signs::Checked, Signs::Rest);
    }

    /// Gives up a check that is not done.
    pub fn give_up(&mut self) {
        if matches!(self.signs, Signs::Rest(_) | Signs::Move(_)) {
            self.signs = Signs::Unchecked;
        }
    }

    /// Takes the counts of a tick, and whether the links hang at rest.
    pub fn update(&mut self, counts: &[i32; NY], at_rest: bool, sign_counts: &[i32; NY]) {
        match self.signs {
            Signs::Rest(next) if at_rest => (self.signs, self.from) = (Signs::Move(next), *counts),
            Signs::Move(asked) => self.moving(asked, counts, sign_counts),
            _ => {}
        }
    }

    fn moving(&mut self, asked: u8, counts: &[i32; NY], sign_counts: &[i32; NY]) {
        let sensors = counts.iter().zip(&self.from).zip(sign_counts).zip(0..=asked);
        let far =
            sensors.map(|(((count, from), &enough), sensor)| (count.wrapping_sub(*from), enough, sensor));
        let mut far =
            far.filter(|&(moved, enough, _)| enough > 0 && moved.unsigned_abs() >= enough.unsigned_abs());
        let Some((moved, _, sensor)) = far.next() else { return };
        self.signs = if sensor != asked {
            Signs::Swapped { asked, moved: sensor }
        } else if moved < 0 {
            Signs::Reversed(asked)
        } else {
            last(sign_counts, usize::from(asked)).map_or(Signs::Checked, Signs::Rest)
        };
    }
}

/// The last sensor before `end` that has a sign to check.
fn last<const NY: usize>(sign_counts: &[i32; NY], end: usize) -> Option<u8> {
    let sensors = sign_counts.iter().take(end).zip(0u8..);
    sensors.filter(|(counts, _)| **counts > 0).map(|(_, sensor)| sensor).last()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENOUGH: [i32; 3] = [50, 130, 130];

    /// A person moves what is asked for; `wire` is what the wiring makes of the true counts.
    fn check(wire: impl Fn([i32; 3]) -> [i32; 3]) -> Signs {
        let mut check = SignCheck::new(&ENOUGH);
        check.begin(&ENOUGH);
        for tick in 0.. {
            let moved = 1 + tick % 200;
            let counts = match check.signs() {
                Signs::Rest(_) => [0, 0, 0],
                Signs::Move(2) => [0, 0, moved],
                // The outer link hangs on.
                Signs::Move(1) => [0, moved, -moved],
                // The links swing back while the cart is pushed.
                Signs::Move(0) => [moved, 2 * moved, -2 * moved],
                end => return end,
            };
            check.update(&wire(counts), counts == [0, 0, 0], &ENOUGH);
            assert!(tick < 10_000);
        }
        Signs::Unchecked
    }

    #[test]
    fn right_wiring_is_found_right() {
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
    fn where_there_is_nothing_to_check_nothing_is_asked_for() {
        assert_eq!(SignCheck::new(&[0, 0]).signs(), Signs::Checked);
        assert_eq!(SignCheck::new(&ENOUGH).signs(), Signs::Unchecked);
    }
}
