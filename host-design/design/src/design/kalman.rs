//! The observer: the steady-state Kalman filter, from the sampled Riccati equation of the dual system, or one with
//! chosen poles.

use super::controllability::Reach;
use super::error::DesignError;
use super::placed_observer::place_observer;
use super::riccati::{Cost, dare};
use super::zero_order_hold::integrated_quadratic;
use crate::numerics::{Complex, Matrix, Real, solve, solve_right};
use crate::rig::{self, CartInput, Rig, Sensor};

/// Steady-state gains of the observer.
#[doc(alias = "lqe")]
#[doc(alias = "dlqe")]
#[doc(alias = "estimator")]
#[derive(Debug, Clone, PartialEq)]
pub struct Kalman<T> {
    /// Filter (current) form `x̂ = x̂⁻ + L (y - C x̂⁻)`, s×p: what the table holds.
    pub l_filter: Matrix<T>,
    /// Predictor form `x̂⁻⁺ = Ad x̂⁻ + Bd u + L (y - C x̂⁻)`, s×p: Ad times the filter form.
    pub l_predictor: Matrix<T>,
    /// Travel per count of each sensor (m or rad), p×1.
    pub steps: Matrix<T>,
    /// Variance of each sensor's innovation, the diagonal of `S = C P⁻ Cᵀ + R` (m² or rad²), p×1.
    pub innovation_variances: Matrix<T>,
}

/// Gains of the observer and the relative residual of the equation that they solve. Process noise has the intensities
/// in `noise`, enters through the columns of `inputs` and is integrated over one tick (Van Loan). Each sensor has a
/// rounding error with the variance of [`sensor_variances`].
///
/// The error covariance P of the prediction solves the sampled Riccati equation of (Adᵀ, Cᵀ);
/// `L = P Cᵀ (C P Cᵀ + R)⁻¹` (Anderson & Moore, *Optimal Filtering*, chapter 4). With `observer_poles`, L follows from
/// these instead, and P from L and the noise.
pub(super) fn kalman<R: Real>(
    a: &Matrix<R>,
    ad: &Matrix<R>,
    inputs: &Matrix<R>,
    noise: &rig::KalmanNoise,
    rig: &Rig,
    period: &R,
) -> Result<(Kalman<R>, R), DesignError> {
    let intensities: Vec<R> = [noise.force_noise_n2_s]
        .iter()
        .chain(&noise.joint_noise)
        .take(inputs.cols())
        .map(|&intensity| R::from_f64(intensity))
        .collect();
    let spread = &(inputs * &Matrix::from_diagonal(&intensities)) * &inputs.transpose();
    let q = integrated_quadratic(&a.transpose(), &spread, period);
    let sensors = rig.sensors();
    let steps: Vec<R> = sensors.iter().map(Sensor::step).collect();
    let c = rig.measurement();
    let mut r = Matrix::from_diagonal(&sensor_variances(rig, &steps));
    if rig.actuator.input() == CartInput::Acceleration {
        let measured: Vec<usize> = sensors.iter().map(|sensor| sensor.state).collect();
        add_rounded_motion(&mut r, inputs, &measured);
        return with_known_cart(ad, [&q, &c, &r], steps, period);
    }
    gains(ad, [&q, &c, &r], steps, &noise.observer_poles, period)
}

/// The gains of the plant with this Ad, process noise q, sensors c with the noise r.
fn gains<R: Real>(
    ad: &Matrix<R>,
    [q, c, r]: [&Matrix<R>; 3],
    steps: Vec<R>,
    poles: &[[f64; 2]],
    period: &R,
) -> Result<(Kalman<R>, R), DesignError> {
    let unresolved = |_| DesignError::NoKalman { bits: R::bits() };
    let (p, placed, residual) = if poles.is_empty() {
        let (a_t, c_t) = (ad.transpose(), c.transpose());
        let cost = Cost::new(q.clone(), r.clone());
        let solution = dare(&a_t, &c_t, &cost).map_err(|_| why_no_kalman(&a_t, &c_t))?;
        (solution.x, None, solution.residual)
    } else {
        let (l, residual) = place_observer(ad, c, poles, period).map_err(unresolved)?;
        let noise_of_a_tick = q + &(&(&l * r) * &l.transpose());
        (stationary_covariance(ad - &(&l * c), noise_of_a_tick), Some(l), residual)
    };
    let p_c = &p * &c.transpose();
    let s = &(c * &p_c) + r;
    let l_filter = match &placed {
        None => solve_right(&p_c, &s),
        Some(l_predictor) => solve(ad, l_predictor),
    };
    let l_filter = l_filter.map_err(unresolved)?;
    let gains = Kalman {
        l_predictor: ad * &l_filter,
        l_filter,
        steps: Matrix::column(&steps),
        innovation_variances: Matrix::from_fn(s.rows(), 1, |i, _| s[(i, i)].clone()),
    };
    Ok((gains, residual))
}

/// The P with `P = F P Fᵀ + W` of a stable F, by doubling: after k steps the sum `Σ Fⁱ W (Fⁱ)ᵀ` has 2ᵏ terms.
fn stationary_covariance<R: Real>(mut f: Matrix<R>, w: Matrix<R>) -> Matrix<R> {
    let mut p = w;
    let least = R::one().scale_by_power_of_two(-(R::bits() as i32));
    while f.norm() > least {
        p = &p + &(&(&f * &p) * &f.transpose());
        f = &f * &f;
    }
    p
}

/// The drive moves the cart by whole steps, and the links swing with what is rounded: column `inputs` 0, the cart's
/// acceleration, moves each angle by its entry times the cart's distance. `measured` are the states that the sensors
/// measure, that of the cart first, and `r` is the covariance of their rounding errors, to which it is added.
pub fn add_rounded_motion<R: Real>(r: &mut Matrix<R>, inputs: &Matrix<R>, measured: &[usize]) {
    let of_cart = r[(0, 0)].clone();
    let per_metre = |sensor: usize| inputs[(measured[sensor] + 1, 0)].clone();
    for i in 1..measured.len() {
        for j in 1..measured.len() {
            let rounded = per_metre(i) * &per_metre(j) * &of_cart;
            r[(i, j)] = r[(i, j)].clone() + &rounded;
        }
    }
}

/// The gains where the drive knows position and speed of the cart: the first sensor, its own count, corrects nothing,
/// and no sensor corrects the first two states.
fn with_known_cart<R: Real>(
    ad: &Matrix<R>,
    [q, c, r]: [&Matrix<R>; 3],
    steps: Vec<R>,
    period: &R,
) -> Result<(Kalman<R>, R), DesignError> {
    let (states, sensors) = (ad.rows(), c.rows());
    let (joints, encoders) = (states - 2, sensors - 1);
    let links = [
        &q.block(2, 2, joints, joints),
        &c.block(1, 2, encoders, joints),
        &r.block(1, 1, encoders, encoders),
    ];
    let (of_links, residual) =
        gains(&ad.block(2, 2, joints, joints), links, steps[1..].to_vec(), &[], period)?;
    let whole = |l: &Matrix<R>| Matrix::zeros(states, sensors).with_block(2, 1, l);
    let l_filter = whole(&of_links.l_filter);
    let of_cart = Matrix::column(&[r[(0, 0)].clone()]);
    let known = Kalman {
        l_predictor: ad * &l_filter,
        l_filter,
        steps: Matrix::column(&steps),
        innovation_variances: of_cart.above(&of_links.innovation_variances),
    };
    Ok((known, residual))
}

/// Shortest tick (s) for which the rounding errors of successive counts of a chain's encoder are taken as independent.
const WHITE_S: f64 = 1e-3;

/// Variance of each sensor's error: that of rounding, `step²/12`, and that of its noise.
///
/// The filter takes the errors of successive ticks as independent. With ticks below 1 ms a link near rest often keeps
/// its count, and with it the error: sampling more often then adds no information. So the variance of a chain's
/// encoders is multiplied by 1 ms over the tick, which keeps the product of variance and tick constant. Noise is new in
/// every tick.
pub(super) fn sensor_variances<R: Real>(rig: &Rig, steps: &[R]) -> Vec<R> {
    let twelve = R::from_f64(12.0);
    let is_correlated = rig.chain().is_some() && rig.tick.period_s < WHITE_S;
    let variance = |(step, sensor): (&R, Sensor)| {
        let white = step.clone() * step / &twelve;
        let rounding = if is_correlated {
            white * &R::from_f64(WHITE_S) / &R::from_f64(rig.tick.period_s)
        } else {
            white
        };
        let noise = R::from_f64(sensor.noise);
        rounding + &(noise.clone() * &noise)
    };
    steps.iter().zip(rig.sensors()).map(variance).collect()
}

fn why_no_kalman<R: Real>(a_t: &Matrix<R>, c_t: &Matrix<R>) -> DesignError {
    let fuzz = R::one().scale_by_power_of_two(-(R::bits() as i32) / 8);
    let hidden = Reach::of(a_t, c_t).unreachable_modes().unwrap_or_default();
    let hidden: Vec<[f64; 2]> =
        hidden.iter().filter(|mode| mode.modulus() > R::one() - &fuzz).map(Complex::to_f64).collect();
    if hidden.is_empty() {
        DesignError::NoKalman { bits: R::bits() }
    } else {
        DesignError::Undetectable { modes: hidden }
    }
}
