//! Fixed-step integration of a chain.

use super::{ChainPlant, ChainState};

impl<const N: usize> ChainPlant<N> {
    /// One step of length `dt` (s) of the classical fourth-order Runge–Kutta method (Hairer, Nørsett & Wanner,
    /// *Solving Ordinary Differential Equations I*, table II.1.2) with `force` (N) and `torques` (N·m) held constant.
    #[inline]
    pub fn rk4(&self, state: &ChainState<N>, force: f64, torques: &[f64; N], dt: f64) -> ChainState<N> {
        let k1 = self.derivative(state, force, torques);
        let k2 = self.derivative(&state.plus(0.5 * dt, &k1), force, torques);
        let k3 = self.derivative(&state.plus(0.5 * dt, &k2), force, torques);
        let k4 = self.derivative(&state.plus(dt, &k3), force, torques);
        let sum = k1.plus(2.0, &k2).plus(2.0, &k3).plus(1.0, &k4);
        state.plus(dt / 6.0, &sum)
    }
}
