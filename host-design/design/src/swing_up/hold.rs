//! One tick of the plant under a held force, integrated in two or more steps.

use super::dynamics::Dynamics;
use crate::numerics::Matrix;

/// A tick from one state under one held force.
pub(super) struct Tick {
    /// State at the end of the tick, s entries.
    pub(super) end: Vec<f64>,
    /// Derivatives of the state in the middle of the tick by the state at its start and the force, s×(s + 1).
    pub(super) middle: Matrix<f64>,
    /// Derivatives of the state at the end by the state at the start and the force, s×(s + 1).
    pub(super) whole: Matrix<f64>,
}

impl Tick {
    /// Derivatives of the end by the state at the start, s×s.
    pub(super) fn a(&self) -> Matrix<f64> {
        self.whole.block(0, 0, self.whole.rows(), self.whole.rows())
    }

    /// Derivatives of the end by the force, s entries.
    pub(super) fn b(&self) -> Vec<f64> {
        (0..self.whole.rows()).map(|i| self.whole[(i, self.whole.rows())]).collect()
    }
}

/// The state after a tick of `tick_s`.
pub(super) fn after_tick(dynamics: &dyn Dynamics, state: &[f64], force: f64, tick_s: f64) -> Vec<f64> {
    let steps = 2 * dynamics.steps_in_half_a_tick();
    let dt = tick_s / steps as f64;
    (0..steps).fold(state.to_vec(), |state, _| dynamics.step(&state, [force; 2], dt))
}

/// As [`after_tick`], with derivatives.
pub(super) fn tick(dynamics: &dyn Dynamics, state: &[f64], force: f64, tick_s: f64) -> Tick {
    let start = Matrix::identity(state.len()).beside(&Matrix::zeros(state.len(), 1));
    let (half, middle) = half_tick(dynamics, state, force, tick_s, start);
    let (end, whole) = half_tick(dynamics, &half, force, tick_s, middle.clone());
    Tick { end, middle, whole }
}

/// The state after half a tick from `state`, and its derivatives if those of `state` are `by`.
fn half_tick(
    dynamics: &dyn Dynamics,
    state: &[f64],
    force: f64,
    tick_s: f64,
    by: Matrix<f64>,
) -> (Vec<f64>, Matrix<f64>) {
    let (steps, s) = (dynamics.steps_in_half_a_tick(), state.len());
    let dt = 0.5 * tick_s / steps as f64;
    (0..steps).fold((state.to_vec(), by), |(state, by), _| {
        let step = dynamics.step_with_derivatives(&state, [force; 2], dt);
        let held = Matrix::from_fn(s, 1, |i, _| step.b[(i, 0)] + step.b[(i, 1)]);
        (step.end, &(&step.a * &by) + &Matrix::zeros(s, s).beside(&held))
    })
}
