//! The ranges that numbers of a rig file must lie in.

use std::f64::consts::PI;

/// A condition on a number or on a pair of numbers, and its wording in messages and in the documentation.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// What is accepted: `a number > 0`.
    pub accepts: &'static str,
    admits: fn(&[f64]) -> bool,
}

impl Rule {
    /// Every number of a rig file: squares and products of these stay far from overflow and underflow.
    pub(super) const SANE: Rule = Rule {
        accepts: "0, or a number of magnitude 1e-30 to 1e15",
        admits: |x| x.iter().all(|&x| x == 0.0 || (1e-30..=1e15).contains(&x.abs())),
    };
    /// No further condition.
    pub(super) const ANY: Rule = Rule::checked_by_its_section("a number");
    /// Above zero.
    pub(super) const POSITIVE: Rule =
        Rule { accepts: "a number > 0", admits: |x| x.iter().all(|&x| x > 0.0) };
    /// Zero or above.
    pub(super) const NOT_NEGATIVE: Rule =
        Rule { accepts: "a number >= 0", admits: |x| x.iter().all(|&x| x >= 0.0) };
    /// A time, or none (s).
    pub(super) const AT_MOST_A_MINUTE: Rule = Rule {
        accepts: "a number from 0 to 60 (s)",
        admits: |x| x.iter().all(|&x| (0.0..=60.0).contains(&x)),
    };
    /// Below zero.
    pub(super) const NEGATIVE: Rule =
        Rule { accepts: "a number < 0", admits: |x| x.iter().all(|&x| x < 0.0) };
    /// A control period (s).
    pub(super) const PERIOD: Rule = Rule {
        accepts: "a number from 1e-6 to 10 (s)",
        admits: |x| x.iter().all(|&x| (1e-6..=10.0).contains(&x)),
    };
    /// A share of a whole.
    pub(super) const SHARE: Rule =
        Rule { accepts: "a number from 0 to 1", admits: |x| x.iter().all(|&x| (0.0..=1.0).contains(&x)) };
    /// A share of power that is not lost.
    pub(super) const EFFICIENCY: Rule =
        Rule { accepts: "a number > 0 and <= 1", admits: |x| x.iter().all(|&x| x > 0.0 && x <= 1.0) };
    /// A share (%).
    pub(super) const PERCENT: Rule =
        Rule { accepts: "a number > 0 and < 100 (%)", admits: |x| x.iter().all(|&x| x > 0.0 && x < 100.0) };
    /// An angle up to half a turn (rad).
    pub(super) const ANGLE: Rule =
        Rule { accepts: "a number > 0 and <= pi (rad)", admits: |x| x.iter().all(|&x| x > 0.0 && x <= PI) };
    /// An angle of either sign (rad).
    pub(super) const SIGNED_ANGLE: Rule = Rule {
        accepts: "a number from -pi to pi (rad)",
        admits: |x| x.iter().all(|&x| (-PI..=PI).contains(&x)),
    };
    /// A relative excess of either sign (%).
    pub(super) const SIGNED_PERCENT: Rule = Rule {
        accepts: "a number > -100 and <= 900 (%)",
        admits: |x| x.iter().all(|&x| x > -100.0 && x <= 900.0),
    };
    /// A spread in both directions (%).
    pub(super) const SPREAD: Rule = Rule {
        accepts: "a number >= 0 and <= 90 (%)",
        admits: |x| x.iter().all(|&x| (0.0..=90.0).contains(&x)),
    };
    /// A length or an angle that a simulation can resolve.
    pub(super) const AT_LEAST_A_MILLIONTH: Rule =
        Rule { accepts: "a number >= 1e-6", admits: |x| x.iter().all(|&x| x >= 1e-6) };
    /// A time that the supervisor counts in ticks (s).
    pub(super) const DURATION: Rule =
        Rule { accepts: "a number > 0 and <= 60 (s)", admits: |x| x.iter().all(|&x| x > 0.0 && x <= 60.0) };
    /// A mean time between false alarms (h).
    pub(super) const FALSE_ALARM: Rule = Rule {
        accepts: "a number from 1 to 1e9 (h)",
        admits: |x| x.iter().all(|&x| (1.0..=1e9).contains(&x)),
    };
    /// Encoder counts per revolution.
    pub(super) const COUNTS: Rule =
        Rule { accepts: "a number >= 2", admits: |x| x.iter().all(|&x| x >= 2.0) };
    /// Bits of an absolute sensor.
    pub(super) const BITS: Rule = Rule {
        accepts: "a whole number from 10 to 18",
        admits: |x| x.iter().all(|&x| (10.0..=18.0).contains(&x) && x.fract() == 0.0),
    };
    /// Angle that a potentiometer reads.
    pub(super) const TRAVEL: Rule = Rule {
        accepts: "a number from 3.7 to 6.2 (rad)",
        admits: |x| x.iter().all(|&x| (3.7..=6.2).contains(&x)),
    };
    /// Whole and not negative.
    pub(super) const WHOLE: Rule =
        Rule { accepts: "a whole number >= 0", admits: |x| x.iter().all(|&x| x >= 0.0 && x.fract() == 0.0) };
    /// Noise of an angle with which a link still can be told to be still (rad).
    pub(super) const NOISE: Rule = Rule {
        accepts: "a number from 0 to 0.005 (rad)",
        admits: |x| x.iter().all(|&x| (0.0..=0.005).contains(&x)),
    };
    /// As [`NOISE`](Self::NOISE), of a sensor of the cart.
    pub(super) const NOISE_M: Rule = Self::NOISE.worded("a number from 0 to 0.005 (m)");
    /// A delay of no tick or of one tick.
    pub(super) const ZERO_OR_ONE: Rule =
        Rule { accepts: "0 or 1", admits: |x| x.iter().all(|&x| x == 0.0 || x == 1.0) };
    /// Two ends with the origin between them.
    pub(super) const AROUND_ZERO: Rule = Rule {
        accepts: "[a number < 0, a number > 0]",
        admits: |x| matches!(*x, [low, high] if low < 0.0 && high > 0.0),
    };

    /// The wording of a condition on a list, a text, or several keys, which the section's own code checks.
    pub(super) const fn checked_by_its_section(accepts: &'static str) -> Rule {
        Rule { accepts, admits: |_| true }
    }

    /// The same condition with another wording, for a key whose section checks more.
    pub(super) const fn worded(self, accepts: &'static str) -> Rule {
        Rule { accepts, ..self }
    }

    /// Whether a number, or a pair, is accepted.
    pub(super) fn admits(self, x: &[f64]) -> bool {
        (self.admits)(x)
    }
}
