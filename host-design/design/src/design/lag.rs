//! A force that follows its command with a lag of first order: of a motor driver, or of a winding's inductance.

use super::riccati::Cost;
use crate::numerics::{Matrix, Real};
use crate::rig::Rig;

/// The time constant (s) that the rig file states; 0 for a force that follows at once.
pub(crate) fn lag_s(rig: &Rig) -> f64 {
    rig.actuator.driver_lag_s.unwrap_or(0.0)
}

/// `ẋ = a x + b u` with the force f behind its command as a further, last state, `τ ḟ = u - f`; the plant itself if
/// `lag_s` (s) is 0.
pub(crate) fn with_lag<R: Real>(a: &Matrix<R>, b: &Matrix<R>, lag_s: f64) -> (Matrix<R>, Matrix<R>) {
    if lag_s == 0.0 {
        return (a.clone(), b.clone());
    }
    let (s, rate) = (a.rows(), R::one() / &R::from_f64(lag_s));
    let mut with_force = Matrix::zeros(s + 1, s + 1).with_block(0, 0, a).with_block(0, s, b);
    with_force[(s, s)] = R::zero() - &rate;
    let mut command = Matrix::zeros(s + 1, 1);
    command[(s, 0)] = rate;
    (with_force, command)
}

/// The cost over the plant with `further` states that cost nothing.
pub(super) fn widened<R: Real>(cost: Cost<R>, further: usize) -> Cost<R> {
    let s = cost.q.rows();
    Cost {
        q: Matrix::zeros(s + further, s + further).with_block(0, 0, &cost.q),
        s: cost.s.above(&Matrix::zeros(further, 1)),
        r: cost.r,
    }
}

/// The last two columns exchanged: a K over [x; f; z] becomes one over [x; z; f], as the table's law has it.
pub(super) fn force_last<R: Real>(k: &Matrix<R>) -> Matrix<R> {
    let last = k.cols() - 1;
    let from = |column| if column + 1 >= last { 2 * last - 1 - column } else { column };
    Matrix::from_fn(k.rows(), k.cols(), |row, column| k[(row, from(column))].clone())
}

/// The shares of the pending force, [in the mean force of a tick, left for the next tick], with ticks of `period_s`,
/// see [`GainTable`](upright::table::GainTable).
pub(crate) fn shares(rig: &Rig, period_s: f64) -> [f64; 2] {
    match lag_s(rig) {
        0.0 => [f64::from(rig.tick.delay_ticks), 0.0],
        lag_s => [-libm::expm1(-period_s / lag_s) * lag_s / period_s, libm::exp(-period_s / lag_s)],
    }
}
