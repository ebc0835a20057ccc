//! The steady-state Kalman filter, from the sampled Riccati equation of the dual system.

use super::controllability::Reach;
use super::error::DesignError;
use super::riccati::{Cost, dare};
use super::zero_order_hold::integrated_quadratic;
use crate::numerics::{Complex, Matrix, Real, solve_right};
use crate::rig::{self, Sensor};

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

/// Kalman gains and the relative residual of their Riccati equation. Process noise has the intensities in `noise`,
/// enters through the columns of `inputs` and is integrated over one tick (Van Loan). Each sensor has a rounding error
/// of variance step²/12.
///
/// The error covariance P of the prediction solves the sampled Riccati equation of (Adᵀ, Cᵀ);
/// `L = P Cᵀ (C P Cᵀ + R)⁻¹` (Anderson & Moore, *Optimal Filtering*, chapter 4).
pub(super) fn kalman<R: Real>(
    a: &Matrix<R>,
    ad: &Matrix<R>,
    inputs: &Matrix<R>,
    noise: &rig::Kalman,
    sensors: &[Sensor],
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
    let steps: Vec<R> = sensors.iter().map(Sensor::step).collect();
    let twelve = R::from_f64(12.0);
    let variances: Vec<R> = steps.iter().map(|step| step.clone() * step / &twelve).collect();
    let c =
        Matrix::from_fn(
            sensors.len(),
            a.cols(),
            |i, j| if sensors[i].state == j { R::one() } else { R::zero() },
        );
    let r = Matrix::from_diagonal(&variances);
    let (a_t, c_t) = (ad.transpose(), c.transpose());
    let solution = dare(&a_t, &c_t, &Cost::new(q, r.clone())).map_err(|_| why_no_kalman(&a_t, &c_t))?;
    let p_c = &solution.x * &c_t;
    let s = &(&c * &p_c) + &r;
    let l_filter = solve_right(&p_c, &s).map_err(|_| DesignError::NoKalman { bits: R::bits() })?;
    let gains = Kalman {
        l_predictor: ad * &l_filter,
        l_filter,
        steps: Matrix::column(&steps),
        innovation_variances: Matrix::from_fn(s.rows(), 1, |i, _| s[(i, i)].clone()),
    };
    Ok((gains, solution.residual))
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
