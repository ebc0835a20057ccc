//! The challenge: pushes that grow until the rig falls.

use rand::RngExt;
use rand_pcg::Pcg64;
use serde::Serialize;

/// Time from one push to the next (s).
const PAUSE_S: f64 = 4.0;
/// Duration of a push (s).
const PUSH_S: f64 = 0.05;
/// The first push and its growth from one to the next, as fractions of the force limit.
const GROWTH: f64 = 0.1;

/// A challenge; the page shows its score.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Challenge {
    /// Time that the rig has been upright (s).
    upright_s: f64,
    /// Hardest push that it has survived (N).
    survived_n: f64,
    /// The latest push (N), positive along +x; before the first one, its size.
    push_n: f64,
    /// Whether the motor has gone off, which ends the challenge.
    is_over: bool,
    #[serde(skip)]
    random: Pcg64,
    #[serde(skip)]
    unit_n: f64,
    #[serde(skip)]
    since_push_s: f64,
}

impl Challenge {
    /// A challenge for a rig with this force limit (N).
    pub(crate) fn new(force_limit_n: f64, seed: u64) -> Self {
        Self {
            upright_s: 0.0,
            survived_n: 0.0,
            push_n: GROWTH * force_limit_n,
            is_over: false,
            random: Pcg64::new(u128::from(seed), 0x5eed),
            unit_n: GROWTH * force_limit_n,
            since_push_s: PUSH_S,
        }
    }

    /// Returns the force on the cart in the next tick (N). `survives`: the motor is on.
    pub(crate) fn tick(&mut self, survives: bool, period_s: f64) -> f64 {
        self.is_over |= !survives;
        if self.is_over {
            return 0.0;
        }
        self.upright_s += period_s;
        self.since_push_s += period_s;
        if self.since_push_s >= PAUSE_S {
            if self.upright_s > PAUSE_S + PUSH_S {
                self.survived_n = self.push_n.abs();
            }
            let side = if self.random.random() { 1.0 } else { -1.0 };
            self.push_n = side * (self.survived_n + self.unit_n);
            self.since_push_s = 0.0;
        }
        if self.since_push_s < PUSH_S { self.push_n } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pushes_grow_and_only_survived_ones_count() {
        let mut challenge = Challenge::new(10.0, 1);
        let mut hardest = 0.0f64;
        for _ in 0..(10.0 * 1000.0) as usize {
            hardest = hardest.max(challenge.tick(true, 1e-3).abs());
        }
        // Pushes at 3.95 and 7.95 s; the one of 7.95 s has not been survived for long enough.
        assert!((hardest - 2.0).abs() < 1e-9 && (challenge.survived_n - 1.0).abs() < 1e-9, "{challenge:?}");
        assert_eq!(challenge.tick(false, 1e-3), 0.0);
        let upright_s = challenge.upright_s;
        challenge.tick(true, 1e-3);
        assert!(challenge.is_over && challenge.upright_s == upright_s);
    }
}
