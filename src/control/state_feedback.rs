//! The control law: state feedback with precompensation, integral action, and a governor for the set-point.

use nalgebra::SVector;

/// Gains of one control law `u = N r - K x - k_pending u_pending - k_integral z`.
#[derive(Debug, Clone, PartialEq)]
pub struct LawGains<const NX: usize> {
    /// K: one gain per state (N/m, N·s/m, N/rad, N·s/rad …).
    pub k: SVector<f32, NX>,
    /// Gain on the force still on its way to the motor (1); 0 without delay.
    pub k_pending: f32,
    /// Gain on the integrated position error (N/(m·s)); 0 without integral action.
    pub k_integral: f32,
    /// N: precompensation gain (N/m).
    pub n: f32,
    /// Largest change of the governed set-point in one tick (m).
    pub setpoint_step: f32,
}

impl<const NX: usize> LawGains<NX> {
    pub(crate) fn values(&self) -> impl Iterator<Item = f32> {
        self.k.iter().copied().chain([self.k_pending, self.k_integral, self.n, self.setpoint_step])
    }

    /// The values in order, as bits.
    pub(crate) fn word(&self, index: usize) -> Option<u32> {
        let further = || {
            let values = [self.k_pending, self.k_integral, self.n, self.setpoint_step];
            values.get(index.wrapping_sub(NX)).copied()
        };
        self.k.as_slice().get(index).copied().or_else(further).map(f32::to_bits)
    }
}

/// State feedback with precompensation, `u = N r - K x` (the paper's control law).
#[inline]
pub fn state_feedback<const NX: usize>(n: f32, r: f32, k: &SVector<f32, NX>, x: &SVector<f32, NX>) -> f32 {
    let mut sum = FeedbackSum::new(n, r);
    for (k, x) in k.as_slice().chunks(2).zip(x.as_slice().chunks(2)) {
        sum.feed_back(k, x);
    }
    sum.force()
}

/// The sum `N r - K x`, joint by joint.
///
/// The terms are added in a fixed order (positions and rates apart, so that a processor can overlap them): every machine
/// gets the same bits.
pub(crate) struct FeedbackSum {
    positions: f32,
    rates: f32,
}

impl FeedbackSum {
    #[inline(always)]
    pub(crate) fn new(n: f32, r: f32) -> Self {
        // -0 is what changes nothing when something is added to it; with +0, the first addition would be a real one.
        Self { positions: n * r, rates: -0.0 }
    }

    /// Takes the gains and states of a joint: position and rate, or a position alone at the end.
    #[inline(always)]
    pub(crate) fn feed_back(&mut self, k: &[f32], x: &[f32]) {
        match (k, x) {
            ([k_position, k_rate], [position, rate]) => {
                // Both products before both sums: no instruction waits for the one before it.
                let (a, b) = (k_position * position, k_rate * rate);
                self.positions -= a;
                self.rates -= b;
            }
            ([k], [x]) => self.positions -= k * x,
            _ => (),
        }
    }

    #[inline(always)]
    pub(crate) fn force(self) -> f32 {
        self.positions + self.rates
    }
}

/// `u` limited to ±`limit`; 0 if `u` is not a number, because a motor must never be driven by one.
#[inline]
pub fn saturate(u: f32, limit: f32) -> f32 {
    if u > limit {
        limit
    } else if u >= -limit {
        u
    } else if u < -limit {
        -limit
    } else {
        0.0
    }
}

/// The memory of a control law.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LawState {
    /// Governed set-point (m): what the law follows.
    pub setpoint: f32,
    /// Integrated position error z (m·s).
    pub integral: f32,
    /// Force computed in the last tick (N); with a delay it is being applied now.
    pub pending: f32,
}

impl LawState {
    /// Moves the governed set-point towards `target` (m) by at most one step of the gains' governor.
    ///
    /// In the linear model any such motion keeps every angle and the force within the share of their limits that the
    /// step was designed for: a response is a sum of step responses, one per tick, so that
    /// `|θ| <= step · Σ |step response of θ|`.
    #[inline]
    pub fn govern(&mut self, target: f32, step: f32) {
        let rising = target - self.setpoint;
        let rising = if rising > step { step } else { rising };
        self.setpoint += if rising < -step { -step } else { rising };
    }

    /// The force (N) that the law asks for in state `x`.
    #[inline]
    pub fn force<const NX: usize>(&self, gains: &LawGains<NX>, x: &SVector<f32, NX>) -> f32 {
        state_feedback(gains.n, self.setpoint, &gains.k, x)
            - gains.k_pending * self.pending
            - gains.k_integral * self.integral
    }

    /// Ends a tick of `tick_s` (s) at position `x` (m), in which `requested` was asked for and `applied` was possible:
    /// `z⁺ = z + T (x - r)`.
    ///
    /// Anti-windup by conditional integration: while the force is limited, z only moves in the direction that brings
    /// the request back (Åström & Hägglund, *Advanced PID Control*, section 3.5).
    #[inline]
    pub fn advance(&mut self, k_integral: f32, x: f32, tick_s: f32, requested: f32, applied: f32) {
        if k_integral != 0.0 {
            let moved = tick_s * (x - self.setpoint);
            let excess = requested - applied;
            // The next request changes by -k_integral·moved; hold z if that has the sign of the excess.
            if excess * (-k_integral * moved) <= 0.0 {
                self.integral += moved;
            }
        }
        self.pending = applied;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    #[test]
    fn the_law_is_n_r_minus_k_x() {
        assert_eq!(state_feedback(3.0, 2.0, &vector![1.0, 0.5, 2.0], &vector![4.0, -2.0, 1.0]), 1.0);
    }

    #[test]
    fn the_limit_holds_on_both_sides_and_not_a_number_means_no_force() {
        assert_eq!(saturate(7.0, 5.0), 5.0);
        assert_eq!(saturate(-7.0, 5.0), -5.0);
        assert_eq!(saturate(4.0, 5.0), 4.0);
        assert_eq!(saturate(f32::INFINITY, 5.0), 5.0);
        assert_eq!(saturate(f32::NAN, 5.0), 0.0);
    }

    #[test]
    fn the_governed_setpoint_arrives_exactly_and_no_faster_than_allowed() {
        let mut state = LawState::default();
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
        let mut state = LawState::default();
        // Position below the set-point asks for more force than there is: no winding up.
        state.advance(2.0, -1.0, 0.1, 9.0, 5.0);
        assert_eq!(state.integral, 0.0);
        // The other way it may move although the force is limited.
        state.advance(2.0, 1.0, 0.1, 9.0, 5.0);
        assert_eq!(state.integral, 0.1);
        state.advance(2.0, -1.0, 0.1, 5.0, 5.0);
        assert_eq!(state.integral, 0.0);
    }
}
