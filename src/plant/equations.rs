//! The equations of motion, and one tick of the prediction.

// The indices are those of the equations, and all are below N.
#![allow(clippy::needless_range_loop)]

use crate::numbers::{Number, Scalar};
use crate::plant::chain_state::ChainState;
use crate::table::{ChainModel, Turning};

impl<const N: usize, T: Number> ChainModel<N, T> {
    /// Rate of change of `state` under a force on the cart (N, along +x) and torques at the joints (N·m). Where the
    /// drive imposes the cart's acceleration, that takes the place of the force (m/s²).
    ///
    /// The first equation gives `ẍ = (f + Σ_k a_k cos φ_k φ̈_k) / M_t` with `f = u - d_0 ẋ - Σ_k a_k sin φ_k φ̇_k²`.
    /// Substituted into the others, with `cos(φ_j - φ_k) = cos φ_j cos φ_k + sin φ_j sin φ_k` (and the sine likewise),
    /// it gives `S φ̈ = r`:
    ///
    /// ```text
    /// S_jk = (b_jk - a_j a_k / M_t) cos φ_j cos φ_k + b_jk sin φ_j sin φ_k
    /// r_j  = Q_j + g a_j sin φ_j - sin φ_j Σ_k b_jk cos φ_k φ̇_k² + cos φ_j Σ_k b_jk sin φ_k φ̇_k²
    ///        + a_j cos φ_j f / M_t
    /// ```
    ///
    /// On an arm, with `p_j = Σ_k β_jk sin φ_k`, M_t grows by `h = Σ_j p_j sin φ_j`, f loses
    /// `2 ẋ Σ_j p_j cos φ_j φ̇_j`, and r_j gains `ẋ² p_j cos φ_j`.
    #[inline]
    pub fn derivative(&self, state: &ChainState<N, T>, force: T, torques: &[T; N]) -> ChainState<N, T> {
        self.derivative_inline(state, force, torques)
    }

    /// [`derivative`](Self::derivative), always inlined: SIMD vectors are fast only in a function that is compiled for
    /// their instructions.
    #[inline(always)]
    pub fn derivative_inline(
        &self,
        state: &ChainState<N, T>,
        force: T,
        torques: &[T; N],
    ) -> ChainState<N, T> {
        // Compiled once for carts and once for arms: as one function, a cart takes 4 % longer.
        match &self.turning {
            None => self.rate(state, force, torques, None),
            turning @ Some(_) => self.rate(state, force, torques, turning.as_ref()),
        }
    }

    #[inline(always)]
    fn rate(
        &self,
        state: &ChainState<N, T>,
        force: T,
        torques: &[T; N],
        turning: Option<&Turning<N, T>>,
    ) -> ChainState<N, T> {
        let zero = force.constant(0.0);
        let ([a], [weight], [reacting]) = (&self.a.data.0, &self.weight.data.0, &self.reaction.data.0);
        let (b, b_reduced) = (&self.b.data.0, &self.b_reduced.data.0);
        let (sin, cos) = T::sines_and_cosines(&state.phi);

        let mut sin_w2 = [zero; N];
        let mut cos_w2 = [zero; N];
        let mut ac = [zero; N];
        let mut f = force - self.cart_friction * state.xdot;
        for k in 0..N {
            let w2 = state.phidot[k] * state.phidot[k];
            sin_w2[k] = sin[k] * w2;
            cos_w2[k] = cos[k] * w2;
            ac[k] = a[k] * cos[k];
            f -= reacting[k] * sin_w2[k];
        }
        let (mut p, mut inverse_mass, mut less) = ([zero; N], self.inverse_mass, zero);
        if let Some(turning) = turning {
            let at = turning.at(&sin, &cos, &state.phidot);
            f -= (state.xdot + state.xdot) * at.slowing;
            inverse_mass = self.inverse_mass / (zero.constant(1.0) + at.inertia * self.inverse_mass);
            (p, less) = (at.p, at.inertia * (inverse_mass * self.inverse_mass));
        }
        let f_over_mass = f * inverse_mass;

        let mut r = [zero; N];
        let mut s = [[zero; N]; N];
        for j in 0..N {
            let mut along_cos = zero;
            let mut along_sin = zero;
            for k in 0..N {
                along_cos += b[j][k] * cos_w2[k];
                along_sin += b[j][k] * sin_w2[k];
            }
            r[j] = sin[j] * (weight[j] - along_cos) + cos[j] * along_sin + ac[j] * f_over_mass;
            for k in 0..j + 1 {
                s[j][k] = b_reduced[j][k] * (cos[j] * cos[k]) + b[j][k] * (sin[j] * sin[k]);
            }
        }
        if turning.is_some() {
            let w2 = state.xdot * state.xdot;
            add_turning(&mut r, &mut s, &core::array::from_fn(|j| w2 * p[j] * cos[j]), less, &ac);
        }
        self.add_joint_torques(&mut r, &state.phidot, torques, zero);
        let phiddot = solve_symmetric(s, r, zero);
        let mut reaction = zero;
        for k in 0..N {
            reaction += reacting[k] * cos[k] * phiddot[k];
        }
        ChainState { x: state.xdot, xdot: (f + reaction) * inverse_mass, phi: state.phidot, phidot: phiddot }
    }

    /// Momentum of base and links along the way of the base (kg m/s; of an arm, that about its axis, kg m²/s). Nothing
    /// but a force on the base changes it: neither weight nor torques in the joints do.
    pub fn momentum(&self, state: &ChainState<N, T>) -> T {
        let zero = self.inverse_mass.constant(0.0);
        let (sin, cos) = T::sines_and_cosines(&state.phi);
        let [reacting] = &self.reaction.data.0;
        let mut momentum = state.xdot / self.inverse_mass;
        for k in 0..N {
            momentum -= reacting[k] * cos[k] * state.phidot[k];
        }
        let turning =
            self.turning.as_ref().map_or(zero, |turning| turning.at(&sin, &cos, &state.phidot).inertia);
        momentum + turning * state.xdot
    }

    /// Adds Q_j = τ_j - τ_{j+1}, friction included, to `r`: each joint torque acts on its own link and, with opposite
    /// sign, on the link below.
    #[inline(always)]
    fn add_joint_torques(&self, r: &mut [T; N], phidot: &[T; N], torques: &[T; N], zero: T) {
        let [joint_frictions] = &self.joint_frictions.data.0;
        let mut rate_below = zero;
        for j in 0..N {
            let tau = torques[j] - joint_frictions[j] * (phidot[j] - rate_below);
            rate_below = phidot[j];
            r[j] += tau;
            if j > 0 {
                r[j - 1] -= tau;
            }
        }
    }
}

/// Adds `pull` (N·m) of the turning to r, and what it takes from the links' reaction to S.
#[inline(always)]
fn add_turning<const N: usize, T: Number>(
    r: &mut [T; N],
    s: &mut [[T; N]; N],
    pull: &[T; N],
    less: T,
    ac: &[T; N],
) {
    for j in 0..N {
        r[j] += pull[j];
        for k in 0..j + 1 {
            s[j][k] += less * (ac[j] * ac[k]);
        }
    }
}

/// What the turning of an arm adds, at one state.
struct Turned<const N: usize, T> {
    /// p_j = Σ_k β_jk sin φ_k (kg m²).
    p: [T; N],
    /// h = Σ_j p_j sin φ_j, as far as it acts on the arm (kg m²).
    inertia: T,
    /// Σ_j p_j cos φ_j φ̇_j, as far as it acts on the arm (kg m²/s).
    slowing: T,
}

impl<const N: usize, T: Number> Turning<N, T> {
    #[inline(always)]
    fn at(&self, sin: &[T; N], cos: &[T; N], phidot: &[T; N]) -> Turned<N, T> {
        let zero = self.reaction.constant(0.0);
        let (beta, mut p, mut inertia, mut slowing) = (&self.beta.data.0, [zero; N], zero, zero);
        for j in 0..N {
            for k in 0..N {
                p[j] += beta[j][k] * sin[k];
            }
            inertia += p[j] * sin[j];
            slowing += p[j] * cos[j] * phidot[j];
        }
        Turned { p, inertia: self.reaction * inertia, slowing: self.reaction * slowing }
    }
}

impl<const N: usize, T: Scalar> ChainModel<N, T> {
    /// Replaces the state `x, ẋ, θ_1, θ̇_1, …` (2N + 2 entries) by the one `dt` (s) later, with `force` (N) held: one
    /// step of the explicit midpoint rule, whose error within a tick is far below what the encoders resolve.
    #[inline]
    pub fn predict(&self, state: &mut [T], force: T, dt: T) {
        let (now, no_torques) = (ChainState::from_relative(state), [T::default(); N]);
        let half = T::from_f32(0.5) * dt;
        let middle = now.plus(half, &self.derivative(&now, force, &no_torques));
        now.plus(dt, &self.derivative(&middle, force, &no_torques)).write_relative(state);
    }
}

/// Solves `S x = r` for a symmetric positive definite S, given by its lower triangle, by `S = L D Lᵀ` without pivoting
/// (Golub & Van Loan, *Matrix Computations*, §4.1).
#[cfg_attr(target_os = "none", inline)]
#[cfg_attr(not(target_os = "none"), inline(always))]
fn solve_symmetric<const N: usize, T: Number>(mut s: [[T; N]; N], mut r: [T; N], zero: T) -> [T; N] {
    let mut inverse_d = [zero; N];
    for k in 0..N {
        let inverse = zero.constant(1.0) / s[k][k];
        inverse_d[k] = inverse;
        for i in k + 1..N {
            let l = s[i][k] * inverse;
            for j in k + 1..i + 1 {
                s[i][j] -= l * s[j][k];
            }
            r[i] -= l * r[k];
        }
    }
    // Below its diagonal, s now holds L D.
    for k in (0..N).rev() {
        let mut known = r[k];
        for i in k + 1..N {
            known -= s[i][k] * r[i];
        }
        r[k] = known * inverse_d[k];
    }
    r
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{matrix, vector};

    /// A thin rod of 1 kg and 1 m on a cart of 1 kg, g = 10 m/s².
    const ROD: ChainModel<1, f64> = ChainModel {
        inverse_mass: 0.5,
        a: vector![0.5],
        weight: vector![5.0],
        b: matrix![1.0 / 3.0],
        b_reduced: matrix![1.0 / 3.0 - 0.125],
        reaction: vector![0.5],
        cart_friction: 0.0,
        joint_frictions: vector![0.0],
        turning: None,
    };

    #[test]
    fn a_rod_on_a_cart_falls_as_the_textbook_says() {
        let state = ChainState { x: 0.0, xdot: 0.0, phi: [1e-6], phidot: [0.0] };
        let rate = ROD.derivative(&state, 0.0, &[0.0]);
        // (b - a²/M) φ̈ = g a φ
        assert!((rate.phidot[0] / (5e-6 / (1.0 / 3.0 - 0.125)) - 1.0).abs() < 1e-9);
        assert_eq!((rate.x, rate.phi), (0.0, [0.0]));
    }

    #[test]
    fn nothing_but_a_force_on_the_base_changes_the_momentum() {
        let turning = Some(Turning { beta: matrix![1.0 / 3.0], reaction: 1.0 });
        let state = ChainState { x: 0.1, xdot: 1.5, phi: [2.0], phidot: [-7.0] };
        for model in [ChainModel { cart_friction: 0.4, ..ROD }, ChainModel { turning, ..ROD }] {
            let rate = model.derivative(&state, 3.0, &[0.2]);
            let after = |dt: f64| model.momentum(&state.plus(dt, &rate));
            let change = (after(1e-5) - after(-1e-5)) / 2e-5;
            assert!((change - (3.0 - model.cart_friction * state.xdot)).abs() < 1e-6, "{change}");
        }
    }

    #[test]
    fn the_prediction_is_of_second_order() {
        let turning = Some(Turning { beta: matrix![1.0 / 3.0], reaction: 1.0 });
        for model in [ROD, ChainModel { turning, ..ROD }] {
            let after = |steps: u32| {
                let mut state = [0.1, -0.3, 2.5, 4.0];
                (0..steps).for_each(|_| model.predict(&mut state, 3.0, 0.1 / f64::from(steps)));
                state
            };
            let exact = after(100_000);
            let error = |steps| (after(steps)[2] - exact[2]).abs();
            let order = (error(50) / error(100)).log2();
            assert!((1.9..2.1).contains(&order), "{order}");
        }
    }
}
