//! The dynamics of a chain over one time step, with their derivatives.

use super::SwingUpError;
use crate::numerics::Matrix;
use crate::plant::{ChainPlant, ChainState, Partials};
use crate::rig;

/// The state at the end of a step, and its derivatives.
pub(super) struct Step {
    /// State at the end, s entries.
    pub(super) end: Vec<f64>,
    /// Derivative by the state at the start, s×s.
    pub(super) a: Matrix<f64>,
    /// Derivative by the force at the start and at the end of the step, s×2; for a held force add the two columns.
    pub(super) b: Matrix<f64>,
}

/// The equations of motion of a chain in the rig's states, for any number of links.
pub(super) trait Dynamics: Send + Sync {
    /// The state after `dt` (s) under a force that goes linearly from the first to the second value (N): one step of
    /// the classical Runge–Kutta method.
    fn step(&self, state: &[f64], force: [f64; 2], dt: f64) -> Vec<f64>;

    /// As [`step`](Self::step), with derivatives.
    fn step_with_derivatives(&self, state: &[f64], force: [f64; 2], dt: f64) -> Step;

    /// Number of integration steps in half a tick: the links of long chains are short and fast.
    fn steps_in_half_a_tick(&self) -> usize;

    /// Derivatives of the state's rate by a force on the cart and by torques at the joints: s×(n + 1).
    fn inputs(&self, state: &[f64]) -> Matrix<f64>;
}

/// The dynamics of `chain`.
///
/// # Errors
/// [`SwingUpError::Links`] for more links than are compiled in.
pub(super) fn dynamics(chain: &rig::Chain) -> Result<Box<dyn Dynamics>, SwingUpError> {
    fn boxed<const N: usize>(chain: &rig::Chain) -> Result<Box<dyn Dynamics>, SwingUpError> {
        Ok(Box::new(ChainPlant::<N>::of(chain)?))
    }
    match chain.links.len() {
        1 => boxed::<1>(chain),
        2 => boxed::<2>(chain),
        3 => boxed::<3>(chain),
        4 => boxed::<4>(chain),
        5 => boxed::<5>(chain),
        6 => boxed::<6>(chain),
        links => Err(SwingUpError::Links(links)),
    }
}

/// Rate of change in the rig's states, and its derivatives by the state and the force, (2n + 2)×(2n + 3).
fn linearised<const N: usize>(plant: &ChainPlant<N>, state: &[f64], force: f64) -> (Vec<f64>, Matrix<f64>) {
    let absolute = ChainState::from_relative(state);
    let rate = plant.derivative(&absolute, force, &[0.0; N]);
    let (cart, links) = plant.partials(&absolute, &rate);
    let mut relative = vec![0.0; 2 * N + 2];
    rate.write_relative(&mut relative);
    let s = 2 * N + 2;
    let mut jacobian = Matrix::zeros(s, s + 1);
    let mut below = None;
    for row in 0..=N {
        let of = if row == 0 { &cart } else { &links[row - 1] };
        jacobian[(2 * row, 2 * row + 1)] = 1.0;
        // θ̈_i = φ̈_i - φ̈_{i-1}; θ_i turns the links i to n.
        let less = |value: f64, of_below: &dyn Fn(&Partials<N>) -> f64| match below {
            Some(below) => value - of_below(below),
            None => value,
        };
        jacobian[(2 * row + 1, 1)] = less(of.xdot, &|p| p.xdot);
        jacobian[(2 * row + 1, s)] = less(of.force, &|p| p.force);
        let (mut phi, mut phidot) = (0.0, 0.0);
        for k in (0..N).rev() {
            phi += less(of.phi[k], &|p| p.phi[k]);
            phidot += less(of.phidot[k], &|p| p.phidot[k]);
            jacobian[(2 * row + 1, 2 * k + 2)] = phi;
            jacobian[(2 * row + 1, 2 * k + 3)] = phidot;
        }
        below = (row > 0).then_some(of);
    }
    (relative, jacobian)
}

fn plus(state: &[f64], factor: f64, rate: &[f64]) -> Vec<f64> {
    state.iter().zip(rate).map(|(x, rate)| x + factor * rate).collect()
}

impl<const N: usize> Dynamics for ChainPlant<N> {
    fn step(&self, state: &[f64], force: [f64; 2], dt: f64) -> Vec<f64> {
        let (at, none) = (ChainState::from_relative(state), [0.0; N]);
        let middle = 0.5 * (force[0] + force[1]);
        let k1 = self.derivative(&at, force[0], &none);
        let k2 = self.derivative(&at.plus(0.5 * dt, &k1), middle, &none);
        let k3 = self.derivative(&at.plus(0.5 * dt, &k2), middle, &none);
        let k4 = self.derivative(&at.plus(dt, &k3), force[1], &none);
        let sum = k1.plus(2.0, &k2).plus(2.0, &k3).plus(1.0, &k4);
        let mut end = vec![0.0; 2 * N + 2];
        at.plus(dt / 6.0, &sum).write_relative(&mut end);
        end
    }

    fn step_with_derivatives(&self, state: &[f64], force: [f64; 2], dt: f64) -> Step {
        let s = 2 * N + 2;
        // Each stage: its fraction of the step, and the weight of its rate in the sum.
        let stages = [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)];
        let (mut rate, mut by) = (vec![0.0; s], Matrix::<f64>::zeros(s, s + 2));
        let (mut sum, mut sum_by) = (vec![0.0; s], Matrix::<f64>::zeros(s, s + 2));
        for (part, weight) in stages {
            let at = plus(state, part * dt, &rate);
            let (stage, jacobian) = linearised(self, &at, force[0] + part * (force[1] - force[0]));
            // Derivatives of the stage's state by the start and the forces. The rate of a position is itself a state.
            let stage_by = Matrix::from_fn(s, s + 2, |i, j| {
                let own = if i == j { 1.0 } else { 0.0 };
                own + part * dt * by[(i, j)]
            });
            let mut next = Matrix::zeros(s, s + 2);
            for i in 0..s {
                if i % 2 == 0 {
                    for j in 0..s + 2 {
                        next[(i, j)] = stage_by[(i + 1, j)];
                    }
                    continue;
                }
                for k in 1..s {
                    let factor: f64 = jacobian[(i, k)];
                    for j in 0..s + 2 {
                        next[(i, j)] += factor * stage_by[(k, j)];
                    }
                }
                next[(i, s)] += (1.0 - part) * jacobian[(i, s)];
                next[(i, s + 1)] += part * jacobian[(i, s)];
            }
            for i in 0..s {
                sum[i] += weight * stage[i];
                for j in 0..s + 2 {
                    sum_by[(i, j)] += weight * next[(i, j)];
                }
            }
            (rate, by) = (stage, next);
        }
        Step {
            end: plus(state, dt / 6.0, &sum),
            a: Matrix::from_fn(s, s, |i, j| {
                let own = if i == j { 1.0 } else { 0.0 };
                own + dt / 6.0 * sum_by[(i, j)]
            }),
            b: Matrix::from_fn(s, 2, |i, j| dt / 6.0 * sum_by[(i, s + j)]),
        }
    }

    fn steps_in_half_a_tick(&self) -> usize {
        match N {
            ..4 => 1,
            4 => 2,
            _ => 3,
        }
    }

    fn inputs(&self, state: &[f64]) -> Matrix<f64> {
        let absolute = ChainState::from_relative(state);
        let rate = self.derivative(&absolute, 0.0, &[0.0; N]);
        let (cart, links) = self.partials(&absolute, &rate);
        let entry = |row: usize, input: usize| {
            let of = if row == 0 { &cart } else { &links[row - 1] };
            if input == 0 { of.force } else { of.torques[input - 1] }
        };
        Matrix::from_fn(2 * N + 2, N + 1, |i, input| match (i % 2, i / 2) {
            (0, _) => 0.0,
            (_, row) if row < 2 => entry(row, input),
            (_, row) => entry(row, input) - entry(row - 1, input),
        })
    }
}
