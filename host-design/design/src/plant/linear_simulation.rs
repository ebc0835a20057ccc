//! Simulation of a plant that a rig file gives as a linear model.

use super::{Actuation, Energy, Plant, integration_steps};
use crate::numerics::Matrix;
use crate::rig;

/// `ẋ = A x + B u + G w` with its current state. G holds the noise columns of the rig file, if there are any.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSimulation {
    a_transposed: Matrix<f64>,
    norm: f64,
    inputs: Matrix<f64>,
    state: Vec<f64>,
}

/// Number of terms of the series: even at the slowest convergence (`‖A‖ h = 1`) the last term, 1/25! = 6e-26, is far
/// below rounding.
const TERMS: u32 = 25;

impl LinearSimulation {
    /// Creates a simulation of `model` that starts at the origin.
    ///
    /// # Panics
    /// If rows or columns of the model differ in length from its number of states.
    pub fn of(model: &rig::LinearPlant) -> Self {
        let s = model.b.len();
        let noise = model.noise_input.as_deref().unwrap_or_default();
        assert!(model.a.len() == s && model.a.iter().all(|row| row.len() == s), "A is s×s");
        assert!(noise.iter().all(|column| column.len() == s), "a noise column has s entries");
        let a = Matrix::from_fn(s, s, |i, j| model.a[i][j]);
        Self {
            a_transposed: a.transpose(),
            norm: a.norm(),
            inputs: Matrix::from_fn(s, 1 + noise.len(), |i, j| match j {
                0 => model.b[i],
                _ => noise[j - 1][i],
            }),
            state: vec![0.0; s],
        }
    }

    /// `B u + G w`, s×1.
    fn input_rate(&self, force: f64, disturbances: &[f64]) -> Matrix<f64> {
        assert_eq!(disturbances.len(), self.disturbances(), "one disturbance per noise column");
        &self.inputs
            * &Matrix::from_fn(self.inputs.cols(), 1, |i, _| match i {
                0 => force,
                _ => disturbances[i - 1],
            })
    }
}

/// `product = A x` without allocating. All sums grow together, column by column, each in the same order as in a
/// product row by row.
fn times(a_transposed: &Matrix<f64>, x: &[f64], product: &mut [f64]) {
    product.fill(0.0);
    let states = product.len();
    for (i, factor) in x.iter().enumerate() {
        let column = &a_transposed.entries()[i * states..(i + 1) * states];
        for j in 0..states {
            product[j] += column[j] * factor;
        }
    }
}

impl Plant for LinearSimulation {
    fn links(&self) -> usize {
        0
    }

    fn states(&self) -> usize {
        self.state.len()
    }

    fn disturbances(&self) -> usize {
        self.inputs.cols() - 1
    }

    fn write_state(&self, state: &mut [f64]) {
        state.copy_from_slice(&self.state);
    }

    fn set_state(&mut self, state: &[f64]) {
        self.state.copy_from_slice(state);
    }

    fn rate(&self, state: &[f64], force: f64, disturbances: &[f64], rate: &mut [f64]) {
        assert_eq!(state.len(), self.states(), "length of the state");
        times(&self.a_transposed, state, rate);
        let inputs = self.input_rate(force, disturbances);
        rate.iter_mut().zip(inputs.entries()).for_each(|(rate, input)| *rate += input);
    }

    /// Exact to rounding without substeps: with the input held,
    /// `x(t + h) = x + Σ_{i>=1} h^i / i! A^(i-1) (A x + B u)`, summed over pieces with `‖A‖ h <= 1`.
    fn advance(&mut self, force: f64, disturbances: &[f64], dt: f64, _substeps: usize) {
        let inputs = self.input_rate(force, disturbances);
        let pieces = (self.norm * dt.abs()).ceil().max(1.0);
        let h = dt / pieces;
        let mut term = vec![0.0; self.state.len()];
        let mut product = term.clone();
        for _ in 0..pieces as u64 {
            times(&self.a_transposed, &self.state, &mut product);
            for i in 0..term.len() {
                term[i] = (product[i] + inputs.entries()[i]) * h;
                self.state[i] += term[i];
            }
            for order in 2..=TERMS {
                times(&self.a_transposed, &term, &mut product);
                let factor = h / f64::from(order);
                for i in 0..term.len() {
                    term[i] = product[i] * factor;
                    self.state[i] += term[i];
                }
            }
        }
    }

    /// By the classical Runge–Kutta method; the second state is the speed of the motor.
    fn advance_with(&mut self, actuation: &dyn Actuation, disturbances: &[f64], dt: f64, substeps: usize) {
        let steps = self.steps(actuation.damping_n_s_per_m(), dt, substeps);
        let step_s = dt / steps as f64;
        let states = self.state.len();
        let (mut at, mut rate, mut sum) = (vec![0.0; states], vec![0.0; states], vec![0.0; states]);
        for step in 0..steps {
            let inputs = actuation.inputs(step as f64 * step_s, step_s);
            at.copy_from_slice(&self.state);
            sum.fill(0.0);
            for (node, weight, next) in [(0, 1.0, 0.5), (1, 2.0, 0.5), (1, 2.0, 1.0), (2, 1.0, 0.0)] {
                let speed = at.get(1).copied().unwrap_or_default();
                self.rate(&at, actuation.force_n(inputs[node], speed), disturbances, &mut rate);
                for i in 0..states {
                    sum[i] += weight * rate[i];
                    at[i] = self.state[i] + next * step_s * rate[i];
                }
            }
            self.state.iter_mut().zip(&sum).for_each(|(state, sum)| *state += step_s / 6.0 * sum);
        }
    }

    fn steps(&self, damping_n_s_per_m: f64, dt: f64, substeps: usize) -> usize {
        let per_newton = self.inputs.entries().get(self.inputs.cols()).map_or(0.0, |b| b.abs());
        integration_steps(self.norm + damping_n_s_per_m * per_newton, dt, substeps)
    }

    fn energy(&self) -> Option<Energy> {
        None
    }
}
