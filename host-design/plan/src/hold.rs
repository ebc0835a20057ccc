//! One tick of the plant under a held force, integrated in two or more steps.

use super::dynamics::Dynamics;
use super::riccati::add;
use upright_design::numerics::Matrix;

/// A tick from one state under one held force.
pub(crate) struct HeldTick {
    /// State at the end of the tick, s entries.
    pub(crate) end: Vec<f64>,
    /// Derivatives of the state in the middle of the tick by the state at its start and the force, s×(s + 1).
    pub(crate) middle: Matrix<f64>,
    /// Derivatives of the state at the end by the state at the start and the force, s×(s + 1).
    pub(crate) whole: Matrix<f64>,
}

impl HeldTick {
    /// Derivatives of the end by the state at the start, s×s.
    pub(crate) fn a(&self) -> Matrix<f64> {
        self.whole.block(0, 0, self.whole.rows(), self.whole.rows())
    }

    /// Derivatives of the end by the force, s entries.
    pub(crate) fn b(&self) -> Vec<f64> {
        (0..self.whole.rows()).map(|i| self.whole[(i, self.whole.rows())]).collect()
    }
}

/// Replaces the state by the one after a tick of `tick_s`.
pub(crate) fn after_tick(dynamics: &dyn Dynamics, state: &mut [f64], force: f64, tick_s: f64) {
    let steps = 2 * dynamics.steps_in_half_a_tick();
    let dt = tick_s / steps as f64;
    (0..steps).for_each(|_| dynamics.step(state, [force; 2], dt));
}

/// As [`after_tick`] from `state`, with derivatives.
pub(crate) fn tick(dynamics: &dyn Dynamics, state: &[f64], force: f64, tick_s: f64) -> HeldTick {
    let (half, middle) = half_tick(dynamics, state, force, tick_s, None);
    let (end, whole) = half_tick(dynamics, &half, force, tick_s, Some(&middle));
    HeldTick { end, middle, whole }
}

/// The state after half a tick from `state`, and its derivatives if those of `state` are `by`, by default those at the
/// start of the tick.
fn half_tick(
    dynamics: &dyn Dynamics,
    state: &[f64],
    force: f64,
    tick_s: f64,
    by: Option<&Matrix<f64>>,
) -> (Vec<f64>, Matrix<f64>) {
    let steps = dynamics.steps_in_half_a_tick();
    let dt = 0.5 * tick_s / steps as f64;
    let one = |state: &[f64], by: Option<&Matrix<f64>>| {
        let step = dynamics.step_with_derivatives(state, [force; 2], dt);
        let through = through(&step.by, by);
        (step.end, through)
    };
    (1..steps).fold(one(state, by), |(state, by), _| one(&state, Some(&by)))
}

/// Derivatives of the end of a step by the state at the start of the tick and the held force, s×(s + 1). `start` are
/// those of the start of the step, by default the identity, and `step` those of its end by its start and both forces.
fn through(step: &Matrix<f64>, start: Option<&Matrix<f64>>) -> Matrix<f64> {
    let s = step.rows();
    let Some(start) = start else {
        let held = |i: usize| step[(i, s)] + step[(i, s + 1)];
        return Matrix::from_fn(s, s + 1, |i, j| if j < s { step[(i, j)] } else { held(i) });
    };
    let mut end = Matrix::zeros(s, s + 1);
    for i in 0..s {
        let (of, row) = (step.row(i), end.row_mut(i));
        for (k, &factor) in of[..s].iter().enumerate() {
            add(row, factor, start.row(k));
        }
        row[s] += of[s] + of[s + 1];
    }
    end
}
