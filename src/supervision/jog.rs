//! The jog: while a person holds a key, the motor pushes the cart a little, with the links hanging.
//!
//! Before anything is balanced, it shows whether the motor pushes in the direction in which the cart's encoder counts.
//! It also allows PWM, break input and dead-man time to be measured. The force rises slowly to
//! [`jog_force_n`](crate::table::Limits::jog_force_n). The jog ends when the key is released, when the cart has
//! moved far enough to tell the sign, or after [`LONGEST_S`]. A key that stays held after that does not begin another
//! jog.

use serde::{Deserialize, Serialize};

/// The key counts as released, and shaking ends, when the host has been silent for this time (s).
pub const SILENCE_S: f32 = 0.1;
/// Longest jog (s). A cart that has not moved by then is not moved by the motor.
pub const LONGEST_S: f32 = 1.0;
/// Rate at which the force rises, relative to the largest force (1/s).
const RISE_PER_S: f32 = 10.0;
/// The jog has found the sign once the cart has moved by more than `sign_counts` divided by this.
const PART_OF_SIGN_COUNTS: i32 = 10;

/// What is known about the motor's sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum MotorSign {
    /// Not jogged since power-up, or since a fault that puts the motor in doubt.
    #[default]
    Unchecked,
    /// The cart has moved in the direction in which the motor pushed it.
    Checked,
    /// The cart has moved in the other direction.
    Reversed,
    /// The cart has not moved far enough within [`LONGEST_S`].
    Still,
}

/// State of a jog, and the result of the last one.
#[derive(Debug, Clone)]
pub struct Jog {
    sign: MotorSign,
    /// Whether it pushes along +x.
    along: bool,
    start_counts: i32,
    /// Ticks since its beginning.
    ticks: u32,
    /// Ticks since the last command to jog.
    silent_ticks: u32,
}

impl Jog {
    /// No jog, and nothing known about the motor; `sign_counts` is how far the cart has to move in the sign check.
    /// Without a cart (0), there is nothing to check.
    pub fn new(sign_counts: i32) -> Self {
        let sign = if sign_counts == 0 { MotorSign::Checked } else { MotorSign::Unchecked };
        Self { sign, along: true, start_counts: 0, ticks: 0, silent_ticks: u32::MAX }
    }

    /// What is known about the motor's sign.
    pub fn sign(&self) -> MotorSign {
        self.sign
    }

    /// Whether the jog in progress, or the last one, pushes along +x.
    pub fn is_along(&self) -> bool {
        self.along
    }

    /// Forgets the result of the last jog. Without a cart (`sign_counts` is 0), the sign stays checked.
    pub fn forget(&mut self, sign_counts: i32) {
        if sign_counts != 0 {
            self.sign = MotorSign::Unchecked;
        }
    }

    /// Whether the key has been released; a tick takes `tick_s` (s).
    pub fn is_released(&self, tick_s: f32) -> bool {
        self.silent_ticks as f32 * tick_s >= SILENCE_S
    }

    /// A command to jog has come: the key is held.
    pub fn hold(&mut self) {
        self.silent_ticks = 0;
    }

    /// Begins a jog with the cart at `cart_counts`.
    pub fn begin(&mut self, along: bool, cart_counts: i32) {
        (self.along, self.start_counts, self.ticks) = (along, cart_counts, 0);
    }

    /// Counts a tick of silence.
    pub fn wait(&mut self) {
        self.silent_ticks = self.silent_ticks.saturating_add(1);
    }

    /// A tick of the jog with the cart at `cart_counts`. Returns the force as a signed share of the largest one, or
    /// `None` when the jog has ended. `sign_counts` as in [`new`](Self::new).
    pub fn update(&mut self, cart_counts: i32, sign_counts: i32, tick_s: f32) -> Option<f32> {
        self.wait();
        if self.is_released(tick_s) {
            return None;
        }
        let moved = cart_counts.wrapping_sub(self.start_counts);
        let moved = if self.along { moved } else { moved.wrapping_neg() };
        let enough = sign_counts / PART_OF_SIGN_COUNTS;
        let found = if moved > enough {
            MotorSign::Checked
        } else if moved < -enough {
            MotorSign::Reversed
        } else if self.ticks as f32 * tick_s >= LONGEST_S {
            MotorSign::Still
        } else {
            self.ticks += 1;
            let rise = self.ticks as f32 * tick_s * RISE_PER_S;
            let share = if rise < 1.0 { rise } else { 1.0 };
            return Some(if self.along { share } else { -share });
        };
        if sign_counts != 0 {
            self.sign = found;
        }
        None
    }
}

/// The cart's entry among the sensors' counts; 0 without sensors.
pub(crate) fn cart<const NY: usize>(counts: &[i32; NY]) -> i32 {
    counts.first().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f32 = 0.001;
    const SIGN_COUNTS: i32 = 400;

    /// Number of ticks with the motor on, and the sign found, for a key that is repeated every `repeat` ticks and a
    /// cart that moves by `speed` counts per tick.
    fn jog(along: bool, repeat: u32, speed: i32) -> (u32, MotorSign) {
        let mut jog = Jog::new(SIGN_COUNTS);
        assert!(jog.is_released(TICK_S));
        jog.hold();
        jog.begin(along, 7);
        let (mut counts, mut ticks) = (7, 0);
        for tick in 1..3000 {
            if tick % repeat == 0 {
                jog.hold();
            }
            match jog.update(counts, SIGN_COUNTS, TICK_S) {
                Some(share) => {
                    assert_eq!(share > 0.0, along);
                    assert!(share.abs() <= 1.0 && share.abs() <= 0.0101 * tick as f32, "{share}");
                }
                None => break,
            }
            ticks += 1;
            counts += speed;
        }
        (ticks, jog.sign())
    }

    #[test]
    fn it_ends_when_the_key_is_let_go_and_after_a_second() {
        assert_eq!(jog(true, 5000, 0), (99, MotorSign::Unchecked));
        assert_eq!(jog(true, 50, 0), (1000, MotorSign::Still));
    }

    #[test]
    fn the_cart_tells_the_sign() {
        assert_eq!(jog(true, 50, 10), (5, MotorSign::Checked));
        assert_eq!(jog(false, 50, -10), (5, MotorSign::Checked));
        assert_eq!(jog(true, 50, -10), (5, MotorSign::Reversed));
        assert_eq!(jog(false, 50, 10), (5, MotorSign::Reversed));
    }

    #[test]
    fn a_key_that_stays_held_is_not_released() {
        let mut jog = Jog::new(SIGN_COUNTS);
        jog.hold();
        for _ in 0..5 {
            (0..99).for_each(|_| jog.wait());
            assert!(!jog.is_released(TICK_S));
            jog.hold();
        }
        (0..100).for_each(|_| jog.wait());
        assert!(jog.is_released(TICK_S));
    }

    #[test]
    fn without_a_cart_there_is_nothing_to_check() {
        let mut jog = Jog::new(0);
        assert_eq!(jog.sign(), MotorSign::Checked);
        jog.hold();
        jog.begin(true, 0);
        assert!(jog.update(0, 0, TICK_S).is_some());
        assert_eq!(jog.update(-1, 0, TICK_S), None);
        jog.forget(0);
        assert_eq!(jog.sign(), MotorSign::Checked);
    }
}
