//! The linear model of a candidate, in f64: ripple, and stability at every combination of mass errors.

use crate::verify::{
    ControllerModel, LoopModel, Numbers, PlantModel, VerifyError, radius, stationary, wrong_masses,
};
use upright_design::design::{
    Design, DesignError, Kalman, continuous_plant, integrated_quadratic, lag_s, noise_columns, with_braking,
    with_lag,
};
use upright_design::numerics::Matrix;
use upright_design::reality::first_mass;
use upright_design::rig::{Held, Rig, Sensor, Tolerances};
use upright_design::simulate::Disturbance;

/// Least distance of the spectral radius from 1: a loop closer to instability falls in a long run.
const MARGIN: f64 = 2e-4;

/// The linear plants of a rig: the nominal one, and one for each combination of mass errors.
pub(super) struct LinearPlants<'a> {
    rig: &'a Rig,
    tolerances: &'a Tolerances,
    nominal: PlantModel<f64>,
    /// Covariance of the disturbances over one tick.
    process: Matrix<f64>,
    sensor_variances: Vec<f64>,
}

impl<'a> LinearPlants<'a> {
    /// The plants of `rig`, whose own design is `design`.
    pub(super) fn new(
        rig: &'a Rig,
        design: &Design<f64>,
        tolerances: &'a Tolerances,
        disturbance: Disturbance,
    ) -> Result<Self, DesignError> {
        let inputs = noise_columns(rig)?;
        let period_s = rig.tick.period_s;
        let intensity = |input: usize| {
            let rms = match input {
                0 if rig.actuator.input().is_force() => disturbance.force_n,
                0 => 0.0,
                _ => disturbance.torque_n_m,
            };
            rms * rms * period_s
        };
        let intensities: Vec<f64> = (0..inputs.cols()).map(intensity).collect();
        let spread = &(&inputs * &Matrix::from_diagonal(&intensities)) * &inputs.transpose();
        let braked = match rig.actuator.held() {
            Held::Voltage { braking_n_s_per_m } => &design.braked(braking_n_s_per_m, period_s),
            Held::Force | Held::MeanSpeed | Held::LaggingSpeed { .. } => design,
        };
        Ok(Self {
            rig,
            tolerances,
            nominal: held(rig, &braked.driven_sampled(&period_s)),
            process: integrated_quadratic(&braked.a.transpose(), &spread, &period_s),
            sensor_variances: rig.sensors().iter().map(Sensor::variance).collect(),
        })
    }

    /// The controller of one candidate; none if its numbers do not fit.
    pub(super) fn controller(
        &self,
        law: &Design<f64>,
        which: upright::table::Law,
        kalman: &Kalman<f64>,
    ) -> Option<ControllerModel<f64>> {
        let feedback = law.sampled.in_table()[which]?;
        Some(ControllerModel::of(&Numbers::of_design(self.rig, law, feedback, Some(kalman))?))
    }

    /// Predicted rms of the force (N) from encoders and disturbances; none for a loop that is not stable.
    pub(super) fn ripple_n(&self, controller: &ControllerModel<f64>) -> Option<f64> {
        let model = LoopModel::of(&self.nominal, controller);
        if radius(&model).ok()? >= 1.0 {
            return None;
        }
        let size = model.matrix.rows();
        let variances = Matrix::from_diagonal(&self.sensor_variances);
        let q = &Matrix::zeros(size, size).with_block(0, 0, &self.process)
            + &(&(&model.sensor_input * &variances) * &model.sensor_input.transpose());
        let p = stationary(&model.matrix, &q).ok()?;
        let (c, d) = (&model.force_output, &model.sensor_to_force);
        let variance = (&(c * &p) * &c.transpose())[(0, 0)] + (&(d * &variances) * &d.transpose())[(0, 0)];
        Some(variance.max(0.0).sqrt())
    }

    /// The plants with every combination of masses wrong by `scale` times the tolerance, and with `scale` times the
    /// tolerated latency.
    pub(super) fn corners(&self, scale: f64) -> Result<Vec<PlantModel<f64>>, DesignError> {
        let (rig, tolerances) = (self.rig, self.tolerances.scaled(scale));
        let period_s = rig.tick.period_s;
        let delay_ticks = f64::from(rig.tick.delay_ticks) + tolerances.latency_s / period_s;
        let first = first_mass(rig);
        let parts = rig.links() + 1 - first;
        let corners = if tolerances.mass_percent > 0.0 { 1u32 << parts } else { 1 };
        let corner = |mask: u32| {
            let signs = (0..parts).map(|part| if mask >> part & 1 == 1 { 1.0 } else { -1.0 });
            let factors: Vec<f64> = std::iter::repeat_n(0.0, first).chain(signs).collect();
            let plant = continuous_plant::<f64>(&wrong_masses(rig, tolerances.mass_percent, &factors))?;
            let drive = rig.actuator.held();
            if drive.is_motion() {
                return Ok(held(rig, &drive.sampled(&plant.a, &plant.b, &period_s)));
            }
            let braked = with_braking(&plant.a, &plant.b, drive.braking_n_s_per_m());
            let (a, b) = with_lag(&braked, &plant.b, lag_s(rig));
            Ok(PlantModel::delayed(&a, &b, period_s, delay_ticks, &rig.measurement()))
        };
        (0..corners).map(corner).collect()
    }

    /// Whether the loop is stable, with a margin, with each of these plants.
    pub(super) fn holds(
        &self,
        controller: &ControllerModel<f64>,
        corners: &[PlantModel<f64>],
    ) -> Result<bool, VerifyError> {
        let nominal = radius(&LoopModel::of(&self.nominal, controller))?;
        // A nominal loop with slow poles has less than this margin itself.
        let most = 1.0 - MARGIN.min(0.5 * (1.0 - nominal));
        for corner in corners {
            if radius(&LoopModel::of(corner, controller))? >= most {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// The plant sampled at its tick. The cart of a drive with pulses is where the observer takes it to be: it decays
/// within a tick, so that it does not look like two poles at 1.
fn held(rig: &Rig, (ad, bd): &(Matrix<f64>, Matrix<f64>)) -> PlantModel<f64> {
    let seen_from = if rig.actuator.input().is_force() { 0 } else { 2 };
    let seen = |matrix: &Matrix<f64>| {
        let entry = |row, column| if row < seen_from { 0.0 } else { matrix[(row, column)] };
        Matrix::from_fn(matrix.rows(), matrix.cols(), entry)
    };
    PlantModel::held(&seen(ad), &seen(bd), usize::from(rig.tick.delay_ticks), &rig.measurement())
}
