//! The nonlinear equations of motion of N links on a cart, in `f64`.

// The indices are those of the equations, and all are below N.
#![allow(clippy::needless_range_loop)]

use super::{ChainParameters, PlantError, sin_cos};
use crate::rig;

/// State of the chain in absolute angles. A state's rate of change has the same type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainState<const N: usize> {
    /// Position of the cart (m).
    pub x: f64,
    /// Velocity of the cart (m/s).
    pub xdot: f64,
    /// Absolute angles `φ` of the links (rad).
    pub phi: [f64; N],
    /// Rates `φ̇` of the absolute angles (rad/s).
    pub phidot: [f64; N],
}

impl<const N: usize> ChainState<N> {
    /// At rest with every link upright.
    pub const UPRIGHT: Self = Self { x: 0.0, xdot: 0.0, phi: [0.0; N], phidot: [0.0; N] };

    /// Converts from `x, ẋ, θ_1, θ̇_1, …` with relative angles (2N + 2 entries).
    ///
    /// # Panics
    /// If the slice has any other length.
    pub fn from_relative(state: &[f64]) -> Self {
        assert_eq!(state.len(), 2 * N + 2, "a chain of {N} links has 2n + 2 states");
        let mut absolute = Self { x: state[0], xdot: state[1], ..Self::UPRIGHT };
        let (mut phi, mut phidot) = (0.0, 0.0);
        for (i, joint) in state[2..].chunks_exact(2).enumerate() {
            phi += joint[0];
            phidot += joint[1];
            absolute.phi[i] = phi;
            absolute.phidot[i] = phidot;
        }
        absolute
    }

    /// Writes `x, ẋ, θ_1, θ̇_1, …` with relative angles (2N + 2 entries).
    ///
    /// # Panics
    /// If the slice has any other length.
    pub fn write_relative(&self, state: &mut [f64]) {
        assert_eq!(state.len(), 2 * N + 2, "a chain of {N} links has 2n + 2 states");
        state[0] = self.x;
        state[1] = self.xdot;
        let (mut phi, mut phidot) = (0.0, 0.0);
        for (i, joint) in state[2..].chunks_exact_mut(2).enumerate() {
            joint[0] = self.phi[i] - phi;
            joint[1] = self.phidot[i] - phidot;
            (phi, phidot) = (self.phi[i], self.phidot[i]);
        }
    }

    /// `self + factor · rate`, entry by entry.
    #[inline]
    pub fn plus(&self, factor: f64, rate: &Self) -> Self {
        let mut sum = *self;
        sum.x += factor * rate.x;
        sum.xdot += factor * rate.xdot;
        for j in 0..N {
            sum.phi[j] += factor * rate.phi[j];
            sum.phidot[j] += factor * rate.phidot[j];
        }
        sum
    }
}

/// Mechanical energy (J); the potential energy is zero where every centre of mass is level with the first joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Kinetic energy T (J).
    pub kinetic: f64,
    /// Potential energy V (J).
    pub potential: f64,
}

impl Energy {
    /// Kinetic plus potential energy (J).
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential
    }
}

/// Equations of motion of N links on a cart: those of [`ChainParameters`] with the same symbols, arranged for speed.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainPlant<const N: usize> {
    total_mass: f64,
    inverse_total_mass: f64,
    a: [f64; N],
    weight: [f64; N],
    b: [[f64; N]; N],
    b_reduced: [[f64; N]; N],
    cart_friction: f64,
    joint_frictions: [f64; N],
}

impl<const N: usize> ChainPlant<N> {
    /// Creates the plant from the constants of its equations.
    ///
    /// # Errors
    /// [`PlantError::WrongLinks`] if the constants are not those of N links.
    pub fn new(parameters: &ChainParameters<f64>) -> Result<Self, PlantError> {
        let (a, b, mt) = (&parameters.a, &parameters.b, parameters.total_mass);
        if a.len() != N {
            return Err(PlantError::WrongLinks { links: a.len(), compiled: N });
        }
        let matrix = |entry: &dyn Fn(usize, usize) -> f64| {
            core::array::from_fn(|j| core::array::from_fn(|k| entry(j, k)))
        };
        Ok(Self {
            total_mass: mt,
            inverse_total_mass: 1.0 / mt,
            a: core::array::from_fn(|j| a[j]),
            weight: core::array::from_fn(|j| parameters.gravity * a[j]),
            b: matrix(&|j, k| b[(j, k)]),
            b_reduced: matrix(&|j, k| b[(j, k)] - a[j] * a[k] / mt),
            cart_friction: parameters.cart_friction,
            joint_frictions: core::array::from_fn(|j| parameters.joint_frictions[j]),
        })
    }

    /// The plant of a rig file's chain.
    ///
    /// # Errors
    /// [`PlantError::WrongLinks`] if the chain does not have N links.
    pub fn of(chain: &rig::Chain) -> Result<Self, PlantError> {
        Self::new(&ChainParameters::of(chain))
    }

    /// Rate of change of `state` under a force on the cart (N, along +x) and torques at the joints (N·m).
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
    #[inline]
    pub fn derivative(&self, state: &ChainState<N>, force: f64, torques: &[f64; N]) -> ChainState<N> {
        let (sin, cos) = sin_cos(&state.phi);

        let mut sin_w2 = [0.0; N];
        let mut cos_w2 = [0.0; N];
        let mut ac = [0.0; N];
        let mut f = force - self.cart_friction * state.xdot;
        for k in 0..N {
            let w2 = state.phidot[k] * state.phidot[k];
            sin_w2[k] = sin[k] * w2;
            cos_w2[k] = cos[k] * w2;
            ac[k] = self.a[k] * cos[k];
            f -= self.a[k] * sin_w2[k];
        }
        let f_over_mass = f * self.inverse_total_mass;

        let mut r = [0.0; N];
        let mut s = [[0.0; N]; N];
        for j in 0..N {
            let mut along_cos = 0.0;
            let mut along_sin = 0.0;
            for k in 0..N {
                along_cos += self.b[j][k] * cos_w2[k];
                along_sin += self.b[j][k] * sin_w2[k];
            }
            r[j] = sin[j] * (self.weight[j] - along_cos) + cos[j] * along_sin + ac[j] * f_over_mass;
            for k in 0..j + 1 {
                s[j][k] = self.b_reduced[j][k] * (cos[j] * cos[k]) + self.b[j][k] * (sin[j] * sin[k]);
            }
        }
        // Q_j = τ_j - τ_{j+1}: each joint torque acts on its own link and, with opposite sign, on the link below.
        let mut rate_below = 0.0;
        for j in 0..N {
            let tau = torques[j] - self.joint_frictions[j] * (state.phidot[j] - rate_below);
            rate_below = state.phidot[j];
            r[j] += tau;
            if j > 0 {
                r[j - 1] -= tau;
            }
        }

        let phiddot = solve_symmetric(s, r);
        let mut reaction = 0.0;
        for k in 0..N {
            reaction += ac[k] * phiddot[k];
        }
        ChainState {
            x: state.xdot,
            xdot: (f + reaction) * self.inverse_total_mass,
            phi: state.phidot,
            phidot: phiddot,
        }
    }

    /// Mechanical energy in `state`: T and V of [`ChainParameters`].
    pub fn energy(&self, state: &ChainState<N>) -> Energy {
        let (sin, cos) = sin_cos(&state.phi);
        let (v, w) = (state.xdot, &state.phidot);
        let mut kinetic = 0.5 * self.total_mass * v * v;
        let mut potential = 0.0;
        for j in 0..N {
            potential += self.weight[j] * cos[j];
            kinetic -= v * self.a[j] * cos[j] * w[j];
            for k in 0..N {
                kinetic += 0.5 * self.b[j][k] * (cos[j] * cos[k] + sin[j] * sin[k]) * w[j] * w[k];
            }
        }
        Energy { kinetic, potential }
    }
}

/// Solves `S x = r` for a symmetric positive definite S, given by its lower triangle, by `S = L D Lᵀ` without pivoting
/// (Golub & Van Loan, *Matrix Computations*, §4.1).
#[inline]
fn solve_symmetric<const N: usize>(mut s: [[f64; N]; N], mut r: [f64; N]) -> [f64; N] {
    let mut inverse_d = [0.0; N];
    for k in 0..N {
        let inverse = 1.0 / s[k][k];
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
