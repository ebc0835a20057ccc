//! The control law: state feedback with precompensation, integral action, and a governor for the set-point.

use nalgebra::SVector;

use crate::table::{Late, Scalar};

/// State feedback with precompensation, `u = N r - K x` (the paper's control law).
#[inline]
#[doc(alias = "full_state_feedback")]
pub fn state_feedback<T: Scalar, const NX: usize>(n: T, r: T, k: &SVector<T, NX>, x: &SVector<T, NX>) -> T {
    let mut sum = FeedbackSum::new(n, r);
    for (k, x) in k.as_slice().chunks(2).zip(x.as_slice().chunks(2)) {
        sum.feed_back(k, x);
    }
    sum.force()
}

/// The sum `N r - K x`, built up joint by joint.
///
/// The terms are added in a fixed order, so every machine computes the same bits. Positions and rates are summed
/// separately, so that a processor can overlap them.
pub(crate) struct FeedbackSum<T> {
    positions: T,
    rates: T,
}

impl<T: Scalar> FeedbackSum<T> {
    #[inline(always)]
    pub(crate) fn new(n: T, r: T) -> Self {
        // Adding to -0 changes nothing, so the compiler can drop the first addition; with +0 it could not.
        Self { positions: n * r, rates: T::from_f32(-0.0) }
    }

    /// Adds the gains times the states of a joint: position and rate, or only a position at the end.
    #[inline(always)]
    pub(crate) fn feed_back(&mut self, k: &[T], x: &[T]) {
        match (k, x) {
            ([k_position, k_rate], [position, rate]) => {
                // Both products before both sums, so that no instruction waits for the one before it.
                let (a, b) = (*k_position * *position, *k_rate * *rate);
                self.positions -= a;
                self.rates -= b;
            }
            ([k], [x]) => self.positions -= *k * *x,
            _ => (),
        }
    }

    #[inline(always)]
    pub(crate) fn force(self) -> T {
        self.positions + self.rates
    }
}

/// Limits `u` to ±`limit`; 0 if `u` is NaN, which must never reach a motor.
#[inline]
pub fn saturate<T: Scalar>(u: T, limit: T) -> T {
    if u >= -limit && u <= limit { u } else { beyond(u, limit) }
}

/// [`saturate`] for a `u` outside the limits, or NaN.
#[cold]
fn beyond<T: Scalar>(u: T, limit: T) -> T {
    if u > limit {
        limit
    } else if u < -limit {
        -limit
    } else {
        T::default()
    }
}

/// What a control law remembers from one tick to the next.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LawState<T = f32> {
    /// Governed set-point (m), which the law follows.
    pub setpoint: T,
    /// Integrated position error z (m·s).
    pub integral: T,
    /// What earlier commands leave at the start of a tick (N): the force of the last tick, which a delay applies now,
    /// or the force from which a drive with lag approaches its command.
    pub pending: T,
}

impl<T: Scalar> LawState<T> {
    /// Moves the governed set-point towards `target` (m) by at most `step` (m), which comes from the gains.
    ///
    /// In the linear model, any such motion keeps every angle and the force within the share of their limits for which
    /// the step was designed. The reason: a response is a sum of step responses, one per tick, so
    /// `|θ| <= step · Σ |step response of θ|`.
    #[inline]
    pub fn govern(&mut self, target: T, step: T) {
        let rising = target - self.setpoint;
        let rising = if rising > step { step } else { rising };
        self.setpoint += if rising < -step { -step } else { rising };
    }

    /// Ends a tick of `tick_s` (s) at position `x` (m), with the force `requested` by the law and the force `applied`:
    /// `z⁺ = z + T (x - r)`.
    ///
    /// Anti-windup by conditional integration: while the force is limited, z moves only in the direction that reduces
    /// the excess (Åström & Hägglund, *Advanced PID Control*, section 3.5).
    #[inline]
    pub fn advance(&mut self, k_integral: T, x: T, tick_s: T, requested: T, applied: T) {
        let zero = T::default();
        if k_integral != zero {
            let moved = tick_s * (x - self.setpoint);
            let excess = requested - applied;
            // The next request changes by -k_integral·moved; hold z if that has the sign of the excess.
            if excess * (-k_integral * moved) <= zero {
                self.integral += moved;
            }
        }
    }

    /// Ends a tick with the command `applied` (N), of which a part is `late`; returns the mean force during the tick
    /// (N).
    #[inline]
    pub fn respond(&mut self, late: &Late<T>, applied: T) -> T {
        let behind = self.pending - applied;
        self.pending = applied + late.stays * behind;
        applied + late.acts * behind
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    #[test]
    fn the_law_is_n_r_minus_k_x() {
        assert_eq!(state_feedback(3.0f32, 2.0, &vector![1.0, 0.5, 2.0], &vector![4.0, -2.0, 1.0]), 1.0);
    }

    #[test]
    fn the_limit_holds_on_both_sides_and_nan_means_no_force() {
        assert_eq!(saturate(7.0f32, 5.0), 5.0);
        assert_eq!(saturate(-7.0f32, 5.0), -5.0);
        assert_eq!(saturate(4.0f32, 5.0), 4.0);
        assert_eq!(saturate(f32::INFINITY, 5.0), 5.0);
        assert_eq!(saturate(f32::NAN, 5.0), 0.0);
    }

    #[test]
    fn the_governed_setpoint_arrives_exactly_and_no_faster_than_allowed() {
        let mut state = LawState::<f32>::default();
        let mut ticks = 0;
        while state.setpoint != 1.0 {
            let before = state.setpoint;
            state.govern(1.0, 0.3);
            assert!(state.setpoint - before <= 0.300_001);
            ticks += 1;
            assert!(ticks < 10);
        }
        assert_eq!(ticks, 4);
    }

    #[test]
    fn the_integral_holds_while_the_force_is_limited_and_returns_at_once() {
        let mut state = LawState::<f32>::default();
        // Below the set-point, the law requests more force than is available: z must not wind up.
        state.advance(2.0, -1.0, 0.1, 9.0, 5.0);
        assert_eq!(state.integral, 0.0);
        // In the other direction z may move although the force is limited.
        state.advance(2.0, 1.0, 0.1, 9.0, 5.0);
        assert_eq!(state.integral, 0.1);
        state.advance(2.0, -1.0, 0.1, 5.0, 5.0);
        assert_eq!(state.integral, 0.0);
    }
}
