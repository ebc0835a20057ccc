//! Fixed-step integration of a chain's equations of motion.

use upright::plant::ChainState;
use upright::table::Number;

use super::ChainPlant;

/// One step of length `dt` (s) of the classical fourth-order Runge–Kutta method (Hairer, Nørsett & Wanner, *Solving
/// Ordinary Differential Equations I*, table II.1.2). `rate` is told the node of its stage: 0 at the beginning of the
/// step, 1 in the middle, 2 at the end.
#[inline(always)]
pub(super) fn rk4<const N: usize, T: Number>(
    state: &ChainState<N, T>,
    dt: f64,
    mut rate: impl FnMut(&ChainState<N, T>, usize) -> ChainState<N, T>,
) -> ChainState<N, T> {
    let of = |value: f64| state.x.constant(value);
    let k1 = rate(state, 0);
    let mut at = state.plus(of(0.5 * dt), &k1);
    let mut sum = k1;
    // In a loop, so that an inlined `rate` is compiled only twice.
    for (node, step, weight) in [(1, 0.5 * dt, 2.0), (1, dt, 2.0), (2, 0.0, 1.0)] {
        let k = rate(&at, node);
        at = state.plus(of(step), &k);
        sum = sum.plus(of(weight), &k);
    }
    state.plus(of(dt / 6.0), &sum)
}

impl<const N: usize> ChainPlant<N> {
    /// One step of length `dt` (s) of the classical fourth-order Runge–Kutta method with `force` (N) and `torques`
    /// (N·m) held constant.
    #[inline]
    pub fn rk4(
        &self,
        state: &ChainState<N, f64>,
        force: f64,
        torques: &[f64; N],
        dt: f64,
    ) -> ChainState<N, f64> {
        rk4(state, dt, |at, _| self.derivative(at, force, torques))
    }
}
