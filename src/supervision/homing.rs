//! Homing by the limit switches: a person pushes the cart to both, and their middle gives its position on the rail.

use serde::{Deserialize, Serialize};

use crate::board::Contacts;

/// Progress of homing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Homing {
    /// Not homed since power-up, or since a fault made the positions unknown.
    #[default]
    NotHomed,
    /// Push the cart to both limit switches; tells which have been pressed so far.
    Touch {
        /// Low end of the rail.
        low: bool,
        /// High end of the rail.
        high: bool,
    },
    /// Both were pressed; move the cart off the switches and let the links hang still.
    HoldStill,
    /// Positions are known.
    Homed,
    /// Not homed: the distance between the switches differs from the rig file's, a switch does not open, or a drive has
    /// not come to it.
    WrongTravel,
    /// As [`HoldStill`](Self::HoldStill), but a link hangs elsewhere than at its absolute sensor's zero.
    OtherZero,
}

/// Cart counts at which the limit switches were pressed.
#[derive(Debug, Clone, Default)]
pub struct Rail {
    low: Option<i32>,
    high: Option<i32>,
    /// Where a drive began to move it.
    start: Option<i32>,
}

impl Rail {
    /// Takes the cart's counts and the contacts of a tick. Once both switches have been pressed, returns the cart's
    /// position (counts). The first press of each switch counts.
    ///
    /// `travel` holds the distance between the switches and its tolerance (counts); `middle` is the position of their
    /// middle (counts).
    ///
    /// # Errors
    /// [`WrongTravel`] if both are pressed at once, or the distance is out of tolerance.
    #[inline(always)]
    pub fn update(
        &mut self,
        cart: i32,
        contacts: &Contacts,
        travel: [i32; 2],
        middle: i32,
    ) -> Result<Option<i32>, WrongTravel> {
        if contacts.limit_low && contacts.limit_high {
            return Err(WrongTravel);
        }
        if contacts.limit_low {
            self.low.get_or_insert(cart);
        }
        if contacts.limit_high {
            self.high.get_or_insert(cart);
        }
        let (Some(low), Some(high)) = (self.low, self.high) else { return Ok(None) };
        let [wanted, tolerance] = travel;
        let found = high.wrapping_sub(low);
        if found.wrapping_sub(wanted).unsigned_abs() > tolerance.unsigned_abs() {
            return Err(WrongTravel);
        }
        Ok(Some(position(cart, [low, high], middle)))
    }

    /// Where a drive has to move the cart: the direction, -1 to the low switch first, then 1 to the high one, and then
    /// to position 0; and from then on the distance from there (counts). `travel` and `middle` as in
    /// [`update`](Self::update).
    ///
    /// # Errors
    /// [`WrongTravel`] if the high switch is pressed first, or no switch within the length of the rail.
    pub fn way(
        &mut self,
        cart: i32,
        travel: [i32; 2],
        middle: i32,
    ) -> Result<(i32, Option<i32>), WrongTravel> {
        let start = *self.start.get_or_insert(cart);
        let [wanted, tolerance] = travel;
        let is_near =
            |from: i32| cart.wrapping_sub(from).unsigned_abs() <= (wanted + tolerance).unsigned_abs();
        match (self.low, self.high) {
            (None, None) if is_near(start) => Ok((-1, None)),
            (Some(low), None) if is_near(low) => Ok((1, None)),
            (Some(low), Some(high)) => {
                let left = position(cart, [low, high], middle);
                Ok((-left.signum(), Some(left)))
            }
            _ => Err(WrongTravel),
        }
    }

    /// Which switches have been pressed, or [`Homing::HoldStill`] after both.
    pub fn progress(&self) -> Homing {
        match (self.low, self.high) {
            (Some(_), Some(_)) => Homing::HoldStill,
            (low, high) => Homing::Touch { low: low.is_some(), high: high.is_some() },
        }
    }
}

/// Position of the cart, if the switches were pressed at the counts `ends` and `middle` is the position between them.
fn position(cart: i32, [low, high]: [i32; 2], middle: i32) -> i32 {
    let middle_found = low.wrapping_add(high.wrapping_sub(low) / 2);
    cart.wrapping_sub(middle_found).wrapping_add(middle)
}

/// The distance between the switches is not that of the rig file, a switch is stuck, or the drive did not come to the
/// switch to which it was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WrongTravel;

#[cfg(test)]
mod tests {
    use super::*;

    const TRAVEL: [i32; 2] = [2000, 20];
    const OPEN: Contacts = Contacts {
        limit_low: false,
        limit_high: false,
        emergency_stop: false,
        driver_fault: false,
        overrun: false,
        clock_fault: false,
        board_fault: false,
    };

    /// Result for a cart that is pushed along these counts, with the switches pressed at `low` and below, `high` and
    /// above.
    fn push(path: &[i32], low: i32, high: i32, middle: i32) -> Result<Option<i32>, WrongTravel> {
        let mut rail = Rail::default();
        path.iter().try_fold(None, |_, &cart| {
            let contacts = Contacts { limit_low: cart <= low, limit_high: cart >= high, ..OPEN };
            rail.update(cart, &contacts, TRAVEL, middle)
        })
    }

    #[test]
    fn both_switches_give_the_position_whichever_comes_first() {
        assert_eq!(push(&[0, -700, -300, 1295, 100], -700, 1295, 0), Ok(Some(-197)));
        assert_eq!(push(&[0, 1295, 0, -700, -702, 100], -700, 1295, 50), Ok(Some(-147)));
    }

    #[test]
    fn one_switch_is_not_enough() {
        assert_eq!(push(&[0, -700, -300], -700, 1295, 0), Ok(None));
    }

    #[test]
    fn a_rail_of_another_length_a_reversed_encoder_and_a_stuck_switch_are_refused() {
        assert_eq!(push(&[0, -700, 1200], -700, 1200, 0), Err(WrongTravel));
        assert_eq!(push(&[0, 700, -1300], 700, -1300, 0), Err(WrongTravel));
        let mut rail = Rail::default();
        let both = Contacts { limit_low: true, limit_high: true, ..OPEN };
        assert_eq!(rail.update(0, &both, TRAVEL, 0), Err(WrongTravel));
    }
}
