//! Partial derivatives of a chain's accelerations.

// The indices are those of the equations, and all are below N.
#![allow(clippy::needless_range_loop)]

use upright::table::{Number, Turning};

use super::{ChainPlant, WideChainState};

/// Partial derivatives of one acceleration, `ẍ` or `φ̈_j`. None depends on x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Partials<const N: usize> {
    /// With respect to ẋ.
    pub xdot: f64,
    /// With respect to each φ.
    pub phi: [f64; N],
    /// With respect to each φ̇.
    pub phidot: [f64; N],
    /// With respect to the cart's input: force or acceleration.
    pub force: f64,
    /// With respect to the torque at each joint.
    pub torques: [f64; N],
}

impl<const N: usize> Partials<N> {
    /// All zero.
    pub const ZERO: Self = Self { xdot: 0.0, phi: [0.0; N], phidot: [0.0; N], force: 0.0, torques: [0.0; N] };

    #[inline]
    fn add(&mut self, factor: f64, other: &Self) {
        self.xdot += factor * other.xdot;
        self.force += factor * other.force;
        for k in 0..N {
            self.phi[k] += factor * other.phi[k];
            self.phidot[k] += factor * other.phidot[k];
            self.torques[k] += factor * other.torques[k];
        }
    }

    #[inline]
    fn scale(&mut self, factor: f64) {
        self.xdot *= factor;
        self.force *= factor;
        for k in 0..N {
            self.phi[k] *= factor;
            self.phidot[k] *= factor;
            self.torques[k] *= factor;
        }
    }
}

impl<const N: usize> ChainPlant<N> {
    /// Partial derivatives of `ẍ` and of each `φ̈_j` at `state`, where the plant's rate of change is `rate`.
    ///
    /// With the equations written `M(φ) q̈ = h`, they are `M⁻¹ (∂h - ∂M q̈)`.
    pub fn partials(
        &self,
        state: &WideChainState<N>,
        rate: &WideChainState<N>,
    ) -> (Partials<N>, [Partials<N>; N]) {
        let model = self.model();
        let (sin, cos) = f64::sines_and_cosines(&state.phi);
        let (w, wdot) = (&state.phidot, &rate.phidot);
        // Right-hand sides ∂h - ∂M q̈, of the cart's equation and of the links'.
        let mut cart = Partials { xdot: -model.cart_friction, force: 1.0, ..Partials::ZERO };
        let mut links = [Partials::<N>::ZERO; N];
        let mut mass = [[0.0; N]; N];
        for j in 0..N {
            let (a, w2) = (model.a[j], w[j] * w[j]);
            let reacting = model.reaction[j];
            cart.phi[j] = -reacting * (sin[j] * wdot[j] + cos[j] * w2);
            cart.phidot[j] = -2.0 * reacting * sin[j] * w[j];
            links[j].phi[j] += model.weight[j] * cos[j] - a * sin[j] * rate.xdot;
            for k in 0..N {
                let (b, w2) = (model.b[(j, k)], w[k] * w[k]);
                let along = b * (cos[j] * cos[k] + sin[j] * sin[k]);
                let across = b * (sin[j] * cos[k] - cos[j] * sin[k]);
                mass[j][k] = along;
                links[j].phi[j] += across * wdot[k] - along * w2;
                links[j].phi[k] += along * w2 - across * wdot[k];
                links[j].phidot[k] -= 2.0 * across * w[k];
            }
            // The torque at a joint acts on its link and, with opposite sign, on the link below.
            let friction = model.joint_frictions[j];
            links[j].torques[j] += 1.0;
            links[j].phidot[j] -= friction;
            if j > 0 {
                links[j].phidot[j - 1] += friction;
                links[j - 1].torques[j] -= 1.0;
                links[j - 1].phidot[j] += friction;
                links[j - 1].phidot[j - 1] -= friction;
            }
        }
        let mut inverse_mass = model.inverse_mass;
        if let Some(turning) = &model.turning {
            inverse_mass = self.add_turning(turning, state, rate, &mut cart, &mut links);
        }
        // Eliminate the cart's equation: S φ̈ = r, as in `derivative`.
        let mut s = mass;
        for j in 0..N {
            let share = model.a[j] * cos[j] * inverse_mass;
            links[j].add(share, &cart);
            for k in 0..N {
                s[j][k] -= share * model.reaction[k] * cos[k];
            }
        }
        solve(s, &mut links);
        for k in 0..N {
            cart.add(model.reaction[k] * cos[k], &links[k]);
        }
        cart.scale(inverse_mass);
        (cart, links)
    }

    /// Adds what the turning of an arm changes in the right-hand sides; returns 1 / (M_t + h).
    fn add_turning(
        &self,
        turning: &Turning<N, f64>,
        state: &WideChainState<N>,
        rate: &WideChainState<N>,
        arm: &mut Partials<N>,
        links: &mut [Partials<N>; N],
    ) -> f64 {
        let (sin, cos) = f64::sines_and_cosines(&state.phi);
        let (v, w) = (state.xdot, &state.phidot);
        let mut h = 0.0;
        for j in 0..N {
            let (mut p, mut along) = (0.0, 0.0);
            for k in 0..N {
                let beta = turning.beta[(j, k)];
                p += beta * sin[k];
                along += beta * cos[k] * w[k];
                links[j].phi[k] += v * v * beta * cos[j] * cos[k];
            }
            h += p * sin[j];
            links[j].phi[j] -= v * v * p * sin[j];
            links[j].xdot += 2.0 * v * p * cos[j];
            let slowing = cos[j] * along - p * sin[j] * w[j];
            arm.phi[j] -= turning.reaction * 2.0 * (v * slowing + p * cos[j] * rate.xdot);
            arm.phidot[j] -= turning.reaction * 2.0 * v * p * cos[j];
            arm.xdot -= turning.reaction * 2.0 * p * cos[j] * w[j];
        }
        1.0 / (1.0 / self.model().inverse_mass + turning.reaction * h)
    }
}

/// Replaces the right-hand sides by the solution, for a symmetric positive definite matrix; no pivoting.
fn solve<const N: usize>(mut s: [[f64; N]; N], rows: &mut [Partials<N>; N]) {
    for k in 0..N {
        let pivot = rows[k];
        for i in k + 1..N {
            let factor = s[i][k] / s[k][k];
            for j in k..N {
                s[i][j] -= factor * s[k][j];
            }
            rows[i].add(-factor, &pivot);
        }
    }
    for k in (0..N).rev() {
        for i in k + 1..N {
            let known = rows[i];
            rows[k].add(-s[k][i], &known);
        }
        rows[k].scale(1.0 / s[k][k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::ChainParameters;
    use crate::rig::{Base, CartInput, Chain, Rig};
    use std::path::Path;

    #[test]
    fn partial_derivatives_agree_with_differences() {
        let rig = Rig::from_path(Path::new("../../rigs/triple-glueck-eder-kugi.toml")).unwrap();
        let cart = rig.chain().unwrap().clone();
        let mut arm = Chain { base: Base::Arm, ..cart.clone() };
        arm.links.iter_mut().for_each(|link| link.radius_m = 0.3);
        arm.links[1].axial_inertia_kg_m2 = 1e-3;
        let moved = Chain { input: CartInput::Acceleration, ..arm.clone() };
        [cart, arm, moved].iter().for_each(agree_with_differences);
    }

    fn agree_with_differences(chain: &Chain) {
        let plant = ChainPlant::<3>::new(&ChainParameters::of(chain)).unwrap();
        let state = WideChainState { x: 0.1, xdot: -0.7, phi: [2.0, -1.1, 0.4], phidot: [3.0, -5.0, 1.5] };
        let (force, torques) = (17.0, [0.3, -0.2, 0.1]);
        let rate = plant.derivative(&state, force, &torques);
        let (cart, links) = plant.partials(&state, &rate);
        let agrees = |by: &str, of: &dyn Fn(&Partials<3>) -> f64, at: &dyn Fn(f64) -> WideChainState<3>| {
            let step = 1e-5;
            let (above, below) = (at(step), at(-step));
            let difference = |a: f64, b: f64| (a - b) / (2.0 * step);
            let close = |exact: f64, found: f64| {
                assert!((exact - found).abs() < 1e-6 * (1.0 + exact.abs()), "by {by}: {exact} {found}");
            };
            close(of(&cart), difference(above.xdot, below.xdot));
            for j in 0..3 {
                close(of(&links[j]), difference(above.phidot[j], below.phidot[j]));
            }
        };
        let moved = |change: &dyn Fn(&mut WideChainState<3>)| {
            let mut moved = state;
            change(&mut moved);
            plant.derivative(&moved, force, &torques)
        };
        agrees("x'", &|p| p.xdot, &|d| moved(&|s| s.xdot += d));
        agrees("force", &|p| p.force, &|d| plant.derivative(&state, force + d, &torques));
        for k in 0..3 {
            agrees("phi", &|p| p.phi[k], &|d| moved(&|s| s.phi[k] += d));
            agrees("phi'", &|p| p.phidot[k], &|d| moved(&|s| s.phidot[k] += d));
            agrees("torque", &|p| p.torques[k], &|d| {
                let mut torques = torques;
                torques[k] += d;
                plant.derivative(&state, force, &torques)
            });
        }
    }
}
