//! Predicted ripple of the loop at rest from encoder resolution and the rig file's force and joint noise.

use serde::Serialize;

use super::VerifyError;
use super::loop_model::LoopModel;
use upright_design::design::{Certified, integrated_quadratic, noise_columns};
use upright_design::numerics::Matrix;
use upright_design::rig::{CartInput, Rig};

/// Root mean squares caused by one source, or by all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseShare {
    /// The source: `encoder 1`, …, `force`, `joint 1`, …, or `total`.
    pub source: String,
    /// RMS of the requested force (N).
    pub force_n: f64,
    /// RMS of every state (m, m/s, rad, rad/s …): cart and relative angles are every other one, from the first.
    pub states: Vec<f64>,
}

/// Shares of all sources, the total last; none without `[kalman]`.
///
/// The covariance P of the loop driven by white noise of covariance Q per tick solves `P = M P Mᵀ + Q`; summed by
/// doubling, `P ← P + M P Mᵀ, M ← M²`. An encoder's rounding error is taken as white, of variance step²/12,
/// as is its noise; intensities are integrated over the tick (Van Loan).
pub(super) fn covariance(
    rig: &Rig,
    certified: &Certified,
    model: &LoopModel<f64>,
    from_encoders: bool,
) -> Result<Option<Vec<NoiseShare>>, VerifyError> {
    let Some(noise) = &rig.kalman else { return Ok(None) };
    let size = model.matrix.rows();
    // The cart of a drive with pulses is where the observer takes it to be.
    let has_force = rig.actuator.input() == CartInput::Force;
    let entry = |state: usize| if has_force || state > 1 { state } else { model.states + state };
    let first = usize::from(!has_force);
    let mut shares = Vec::new();
    let mut add = |source: String, q: &Matrix<f64>, direct: f64| -> Result<(), VerifyError> {
        let p = stationary(&model.matrix, q)?;
        let c = &model.force_output;
        let force = (&(c * &p) * &c.transpose())[(0, 0)] + direct;
        let states = (0..rig.states()).map(|state| p[(entry(state), entry(state))].max(0.0).sqrt()).collect();
        shares.push(NoiseShare { source, force_n: force.max(0.0).sqrt(), states });
        Ok(())
    };
    if let Some(kalman) = certified.double.kalman.as_ref().filter(|_| from_encoders) {
        for (i, (step, sensor)) in kalman.steps.entries().iter().zip(rig.sensors()).enumerate().skip(first) {
            let variance = step * step / 12.0 + sensor.noise * sensor.noise;
            let f = model.sensor_input.block(0, i, size, 1);
            let d = model.sensor_to_force[(0, i)];
            add(format!("encoder {}", i + 1), &(&f * &f.transpose()).scaled(&variance), d * d * variance)?;
        }
    }
    let inputs = noise_columns(rig)?;
    // The same disturbances as in the runs of this report. An intensity is variance times tick.
    let real = |rms: Option<f64>, expected: f64| rms.map_or(expected, |rms| rms * rms * rig.tick.period_s);
    let force = real(rig.verify.force_rms_n, noise.force_noise_n2_s);
    let joints = noise.joint_noise.iter().map(|&expected| real(rig.verify.torque_rms_n_m, expected));
    let intensities = [force].into_iter().chain(joints);
    for (i, intensity) in intensities.take(inputs.cols()).enumerate().skip(first) {
        let column = inputs.block(0, i, inputs.rows(), 1);
        let spread = (&column * &column.transpose()).scaled(&intensity);
        let q = integrated_quadratic(&certified.double.a.transpose(), &spread, &rig.tick.period_s);
        let source = if i == 0 { "force".to_owned() } else { format!("joint {i}") };
        add(source, &Matrix::zeros(size, size).with_block(0, 0, &q), 0.0)?;
    }
    let total = |of: &dyn Fn(&NoiseShare) -> f64| shares.iter().map(|s| of(s) * of(s)).sum::<f64>().sqrt();
    let total = NoiseShare {
        source: "total".to_owned(),
        force_n: total(&|share| share.force_n),
        states: (0..rig.states()).map(|i| total(&|share| share.states[i])).collect(),
    };
    shares.push(total);
    Ok(Some(shares))
}

/// P = M P Mᵀ + Q, by doubling.
///
/// # Errors
/// [`VerifyError::NoStationaryState`] if the sum does not converge.
pub(crate) fn stationary(m: &Matrix<f64>, q: &Matrix<f64>) -> Result<Matrix<f64>, VerifyError> {
    let (mut p, mut m) = (q.clone(), m.clone());
    for _ in 0..60 {
        let increment = &(&m * &p) * &m.transpose();
        p = (&p + &increment).symmetric_part();
        m = &m * &m;
        if !p.is_finite() {
            break;
        }
        if increment.norm() <= 1e-15 * p.norm() {
            return Ok(p);
        }
    }
    Err(VerifyError::NoStationaryState)
}
