//! A force that follows its command with a lag of first order: of a motor driver, or of a winding's inductance.

use super::riccati::Cost;
use crate::numerics::{Matrix, Real};
use crate::rig::Rig;

/// The time constant (s) that the rig file states; 0 for a force that follows at once.
pub fn lag_s(rig: &Rig) -> f64 {
    rig.actuator.lag_s().unwrap_or(0.0)
}

/// Whether the force is a tick late, without a lag: then the laws feed back the whole pending force.
pub(super) fn is_late_alone(rig: &Rig) -> bool {
    rig.tick.delay_ticks == 1 && lag_s(rig) == 0.0
}

/// Whether the force begins a tick late and then follows with a lag: one pending force stands for both.
pub(super) fn is_late_and_lags(rig: &Rig) -> bool {
    rig.tick.delay_ticks == 1 && lag_s(rig) > 0.0
}

/// `ẋ = a x + b u` with the force f behind its command as a further, last state, `τ ḟ = u - f`; the plant itself if
/// `lag_s` (s) is 0.
pub fn with_lag<R: Real>(a: &Matrix<R>, b: &Matrix<R>, lag_s: f64) -> (Matrix<R>, Matrix<R>) {
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
/// see [`Late`](upright::table::Late).
///
/// A force with a lag that begins a tick later would need two pending forces. One that has the same mean delay and the
/// same mean square of it is exact to the second order of `s`: its first share is a little above 1.
pub fn shares(rig: &Rig, period_s: f64) -> [f64; 2] {
    let lag_s = lag_s(rig);
    let [acts, stays] = shares_of_lag(lag_s, period_s);
    if !is_late_and_lags(rig) {
        return [acts + f64::from(rig.tick.delay_ticks), stays];
    }
    // In ticks, of the mean forces that a command leaves behind.
    let mean = 1.0 + lag_s / period_s;
    let mean_square = 2.0 * mean - 1.0 + lag_s / period_s * (1.0 + stays) / (1.0 - stays);
    [2.0 * mean * mean / (mean + mean_square), (mean_square - mean) / (mean_square + mean)]
}

/// The shares of a pending force that begins at once and follows with a lag (s), [in the mean force of a tick, left for
/// the next tick], with ticks of `period_s`; zeros without a lag.
pub fn shares_of_lag(lag_s: f64, period_s: f64) -> [f64; 2] {
    match lag_s {
        0.0 => [0.0; 2],
        lag_s => [-libm::expm1(-period_s / lag_s) * lag_s / period_s, libm::exp(-period_s / lag_s)],
    }
}

/// The sampled plant `x⁺ = ad x + bd f` with the pending force p as a further, last state: `f = acts p + (1 - acts) u`,
/// `p⁺ = stays p + (1 - stays) u`.
pub(crate) fn with_pending<R: Real>(
    [ad, bd]: [&Matrix<R>; 2],
    [acts, stays]: [f64; 2],
) -> (Matrix<R>, Matrix<R>) {
    let ([acts, at_once], [stays, rest]) =
        ([acts, 1.0 - acts].map(R::from_f64), [stays, 1.0 - stays].map(R::from_f64));
    let s = ad.rows();
    let mut a = Matrix::zeros(s + 1, s + 1).with_block(0, 0, ad).with_block(0, s, &bd.scaled(&acts));
    a[(s, s)] = stays;
    let mut b = bd.scaled(&at_once).above(&Matrix::zeros(1, 1));
    b[(s, 0)] = rest;
    (a, b)
}

/// The cost of a tick over that plant, from the cost of [x; f], to which `of_command` is added for u.
pub(super) fn cost_with_pending<R: Real>(cost: &Cost<R>, of_command: &Matrix<R>, acts: f64) -> Cost<R> {
    let s = cost.q.rows();
    let weights = cost.q.beside(&cost.s).above(&cost.s.transpose().beside(&cost.r));
    let mut mixed = Matrix::zeros(s + 1, s + 2).with_block(0, 0, &Matrix::identity(s));
    (mixed[(s, s)], mixed[(s, s + 1)]) = (R::from_f64(acts), R::from_f64(1.0 - acts));
    let weights = &(&mixed.transpose() * &weights) * &mixed;
    Cost {
        q: weights.block(0, 0, s + 1, s + 1),
        s: weights.block(0, s + 1, s + 1, 1),
        r: &weights.block(s + 1, s + 1, 1, 1) + of_command,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    /// The mean force of a tick by a command `e^(iφk)`, with these shares.
    fn response([acts, stays]: [f64; 2], phi: f64) -> Complex<f64> {
        let past = Complex::from_polar(1.0, -phi);
        past * (1.0 - stays) / (-past * stays + 1.0) * acts + (1.0 - acts)
    }

    /// Against the two forces, at up to 200 rad/s with a tick of 1 ms.
    #[test]
    fn one_pending_force_stands_for_a_delay_and_a_lag() {
        let mut rig = crate::rig::Rig::from_toml(
            "name = \"a\"\n[cart]\nmass_kg = 1\n[[link]]\nmass_kg = 1\nlength_m = 1\n[tick]\nperiod_s = 1e-3\n",
            "rig.toml".as_ref(),
        )
        .unwrap();
        rig.tick.delay_ticks = 1;
        let mut worst = [0.0f64; 2];
        for lag_s in [1e-4, 1e-3, 2e-3, 0.01] {
            rig.actuator.force_mut().unwrap().lag_s = Some(lag_s);
            for phi in [0.02, 0.05, 0.1, 0.2] {
                let exact = Complex::from_polar(1.0, -phi) * response(shares_of_lag(lag_s, 1e-3), phi);
                let off = |shares| (response(shares, phi) - exact).norm();
                // Negative control: a tick of delay that is taken for lag.
                let errors = [shares(&rig, 1e-3), shares_of_lag(lag_s + 1e-3, 1e-3)].map(off);
                worst = [0, 1].map(|i| worst[i].max(errors[i]));
            }
        }
        println!("{worst:?}");
        assert!(worst[0] < 8e-3 && worst[1] > 0.05, "{worst:?}");
    }
}
