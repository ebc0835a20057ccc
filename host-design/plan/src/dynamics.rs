//! The dynamics of a chain over one time step, with their derivatives.

// The indices are those of the equations.
#![allow(clippy::needless_range_loop)]

use core::array::from_fn;

use super::SwingUpError;
use upright_design::numerics::Matrix;
use upright_design::plant::{ChainPlant, Partials, WideChainState};
use upright_design::rig;

/// The state at the end of a step, and its derivatives.
pub(crate) struct IntegrationStep {
    /// State at the end, s entries.
    pub(crate) end: Vec<f64>,
    /// Derivatives by the state at the start (s columns), and by the force at the start and at the end of the step,
    /// s×(s + 2); for a held force add the last two columns.
    pub(crate) by: Matrix<f64>,
}

/// The equations of motion of a chain in the rig's states, for any number of links.
pub(crate) trait Dynamics: Send + Sync {
    /// Replaces the state by the one after `dt` (s) under a force that goes linearly from the first to the second
    /// value (N): one step of the classical Runge–Kutta method.
    fn step(&self, state: &mut [f64], force: [f64; 2], dt: f64);

    /// As [`step`](Self::step) from `state`, with derivatives.
    fn step_with_derivatives(&self, state: &[f64], force: [f64; 2], dt: f64) -> IntegrationStep;

    /// Number of integration steps in half a tick: the links of long chains are short and fast.
    fn steps_in_half_a_tick(&self) -> usize;

    /// Derivatives of the state's rate by a force on the cart and by torques at the joints: s×(n + 1).
    fn inputs(&self, state: &[f64]) -> Matrix<f64>;
}

/// The dynamics of `chain`.
///
/// # Errors
/// [`SwingUpError::Links`] for more links than are compiled in.
pub(crate) fn dynamics(chain: &rig::Chain) -> Result<Box<dyn Dynamics>, SwingUpError> {
    fn boxed<const N: usize, const S: usize, const C: usize>(
        chain: &rig::Chain,
    ) -> Result<Box<dyn Dynamics>, SwingUpError> {
        Ok(Box::new(Relative::<N, S, C>(ChainPlant::of(chain)?)))
    }
    match chain.links.len() {
        1 => boxed::<1, 4, 6>(chain),
        2 => boxed::<2, 6, 8>(chain),
        3 => boxed::<3, 8, 10>(chain),
        4 => boxed::<4, 10, 12>(chain),
        5 => boxed::<5, 12, 14>(chain),
        6 => boxed::<6, 14, 16>(chain),
        links => Err(SwingUpError::Links(links)),
    }
}

/// A plant with N links in the rig's states. There are S = 2N + 2 of them; derivatives have C = S + 2 columns: by the
/// states, and by the forces at both ends of a step.
struct Relative<const N: usize, const S: usize, const C: usize>(ChainPlant<N>);

impl<const N: usize, const S: usize, const C: usize> Relative<N, S, C> {
    /// Rate of change of `state`, and its derivatives by the state and, in column S, by the force. Only the odd rows
    /// of the derivatives are filled: the rate of a position is itself a state.
    fn linearised(&self, state: &[f64; S], force: f64) -> ([f64; S], [[f64; C]; S]) {
        let absolute = WideChainState::from_relative(state);
        let rate = self.0.derivative(&absolute, force, &[0.0; N]);
        let (cart, links) = self.0.partials(&absolute, &rate);
        let mut relative = [0.0; S];
        rate.write_relative(&mut relative);
        let mut jacobian = [[0.0; C]; S];
        for coordinate in 0..=N {
            // θ̈_i = φ̈_i - φ̈_{i-1}; θ_i turns the links i to n.
            let (of, below) = match coordinate {
                0 => (&cart, &Partials::ZERO),
                1 => (&links[0], &Partials::ZERO),
                link => (&links[link - 1], &links[link - 2]),
            };
            let row = &mut jacobian[2 * coordinate + 1];
            row[1] = of.xdot - below.xdot;
            row[S] = of.force - below.force;
            let (mut phi, mut phidot) = (0.0, 0.0);
            for k in (0..N).rev() {
                phi += of.phi[k] - below.phi[k];
                phidot += of.phidot[k] - below.phidot[k];
                row[2 * k + 2] = phi;
                row[2 * k + 3] = phidot;
            }
        }
        (relative, jacobian)
    }
}

/// `to + factor · from`, entry by entry.
#[inline(always)]
fn add<const C: usize>(to: &mut [f64; C], factor: f64, from: &[f64; C]) {
    for j in 0..C {
        to[j] += factor * from[j];
    }
}

/// The derivatives of a stage's rates by the start and the forces, from those of its state. `jacobian` is that of
/// [`Relative::linearised`], and `part` the stage's fraction of the step.
fn through<const S: usize, const C: usize>(
    jacobian: &[[f64; C]; S],
    part: f64,
    state_by: &[[f64; C]; S],
) -> [[f64; C]; S] {
    let mut rate_by = [[0.0; C]; S];
    for i in (0..S).step_by(2) {
        rate_by[i] = state_by[i + 1];
        let of = &jacobian[i + 1];
        let mut row = [0.0; C];
        for k in 1..S {
            add(&mut row, of[k], &state_by[k]);
        }
        row[S] += (1.0 - part) * of[S];
        row[S + 1] += part * of[S];
        rate_by[i + 1] = row;
    }
    rate_by
}

impl<const N: usize, const S: usize, const C: usize> Dynamics for Relative<N, S, C> {
    fn step(&self, state: &mut [f64], force: [f64; 2], dt: f64) {
        let (at, none) = (WideChainState::from_relative(state), [0.0; N]);
        let middle = 0.5 * (force[0] + force[1]);
        let k1 = self.0.derivative(&at, force[0], &none);
        let k2 = self.0.derivative(&at.plus(0.5 * dt, &k1), middle, &none);
        let k3 = self.0.derivative(&at.plus(0.5 * dt, &k2), middle, &none);
        let k4 = self.0.derivative(&at.plus(dt, &k3), force[1], &none);
        let sum = k1.plus(2.0, &k2).plus(2.0, &k3).plus(1.0, &k4);
        at.plus(dt / 6.0, &sum).write_relative(state);
    }

    fn step_with_derivatives(&self, state: &[f64], force: [f64; 2], dt: f64) -> IntegrationStep {
        let mut start = [0.0; S];
        start.copy_from_slice(state);
        let own: [[f64; C]; S] = from_fn(|i| from_fn(|j| if i == j { 1.0 } else { 0.0 }));
        // Each stage: its fraction of the step, and the weight of its rate in the sum.
        let stages = [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)];
        let (mut rate, mut by) = ([0.0; S], [[0.0; C]; S]);
        let (mut sum, mut sum_by) = ([0.0; S], [[0.0; C]; S]);
        for (part, weight) in stages {
            let mut at = start;
            add(&mut at, part * dt, &rate);
            let (stage, jacobian) = self.linearised(&at, force[0] + part * (force[1] - force[0]));
            // Derivatives of the stage's state by the start and the forces.
            let mut state_by = own;
            for i in 0..S {
                add(&mut state_by[i], part * dt, &by[i]);
            }
            (rate, by) = (stage, through(&jacobian, part, &state_by));
            add(&mut sum, weight, &rate);
            for i in 0..S {
                add(&mut sum_by[i], weight, &by[i]);
            }
        }
        let (mut end, mut end_by) = (start, own);
        add(&mut end, dt / 6.0, &sum);
        for i in 0..S {
            add(&mut end_by[i], dt / 6.0, &sum_by[i]);
        }
        IntegrationStep { end: end.to_vec(), by: Matrix::from_fn(S, C, |i, j| end_by[i][j]) }
    }

    fn steps_in_half_a_tick(&self) -> usize {
        match N {
            ..4 => 1,
            4 => 2,
            _ => 3,
        }
    }

    fn inputs(&self, state: &[f64]) -> Matrix<f64> {
        let absolute = WideChainState::from_relative(state);
        let rate = self.0.derivative(&absolute, 0.0, &[0.0; N]);
        let (cart, links) = self.0.partials(&absolute, &rate);
        let entry = |row: usize, input: usize| {
            let of = if row == 0 { &cart } else { &links[row - 1] };
            if input == 0 { of.force } else { of.torques[input - 1] }
        };
        Matrix::from_fn(S, N + 1, |i, input| match (i % 2, i / 2) {
            (0, _) => 0.0,
            (_, row) if row < 2 => entry(row, input),
            (_, row) => entry(row, input) - entry(row - 1, input),
        })
    }
}
