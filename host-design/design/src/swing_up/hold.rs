//! One tick of the plant under a held force, integrated in two steps.

use super::dynamics::Dynamics;
use crate::numerics::Matrix;

/// A tick from one state under one held force.
pub(super) struct Tick {
    /// State at its end.
    pub(super) end: Vec<f64>,
    /// The state in the middle of the tick by state and force at its start, s×(s + 1).
    pub(super) middle: Matrix<f64>,
    /// The state at the end by state and force at the start, s×(s + 1).
    pub(super) whole: Matrix<f64>,
}

impl Tick {
    /// By the state at the start, s×s.
    pub(super) fn a(&self) -> Matrix<f64> {
        self.whole.block(0, 0, self.whole.rows(), self.whole.rows())
    }

    /// By the force, s entries.
    pub(super) fn b(&self) -> Vec<f64> {
        (0..self.whole.rows()).map(|i| self.whole[(i, self.whole.rows())]).collect()
    }
}

/// The state after a tick of `tick_s`.
pub(super) fn after_tick(dynamics: &dyn Dynamics, state: &[f64], force: f64, tick_s: f64) -> Vec<f64> {
    let middle = dynamics.step(state, [force; 2], 0.5 * tick_s);
    dynamics.step(&middle, [force; 2], 0.5 * tick_s)
}

/// The same with derivatives.
pub(super) fn tick(dynamics: &dyn Dynamics, state: &[f64], force: f64, tick_s: f64) -> Tick {
    let s = state.len();
    let first = dynamics.step_with_derivatives(state, [force; 2], 0.5 * tick_s);
    let second = dynamics.step_with_derivatives(&first.end, [force; 2], 0.5 * tick_s);
    let held = |b: &Matrix<f64>| Matrix::from_fn(s, 1, |i, _| b[(i, 0)] + b[(i, 1)]);
    let middle = first.a.beside(&held(&first.b));
    let later = &second.a * &middle;
    let whole = &later + &Matrix::zeros(s, s).beside(&held(&second.b));
    Tick { end: second.end, middle, whole }
}
