//! Bounds on the innovation of a machine that is within the tolerances of the rig.

use super::zero_order_hold::zero_order_hold;
use super::{Design, Kalman, continuous_plant};
use crate::numerics::Matrix;
use crate::rig::Rig;

/// Growth of the innovation per relative error of the masses. Measured, not derived: on the robust quadruple with all
/// masses 5 % off and all friction, the innovation reaches 1.11 times the bounds for friction and wrong zeros in 5 h
/// of each law.
const MISMATCH: f64 = 6.0;
/// A response is computed until it has decayed to this share of its start.
const DECAYED: f64 = 1e-6;
/// Longest response that is computed (ticks).
const LONGEST: usize = 100_000;

/// Bounds on the effect of friction and wrong zeros on the innovation.
///
/// The error of the prediction follows `ε⁺ = Ad (I - L C) ε + w`, whatever the law does. Dry friction is an unknown
/// torque of at most F in each joint, and at most that force on the cart; a wrong zero δ of joint j is the constant
/// input `(I - Ad) δ e_j`. An output whose response to a unit input is h stays within `Σ |h|` times the largest input
/// (Dahleh and Pearson, *l¹-optimal feedback controllers for MIMO discrete-time systems*, IEEE Trans. Automatic
/// Control 32, 1987), and the bounds of several inputs add up.
pub(super) struct Tolerated {
    /// Bound on each sensor's innovation (m or rad).
    pub(super) innovation: Vec<f64>,
    /// Bound on the decaying sum of the observer's corrections of each sensor's position (m or rad).
    pub(super) corrected: Vec<f64>,
    /// The same forces move a machine with lighter parts more, by up to this factor.
    pub(super) lighter: f64,
    /// Factor for the remaining model error: force and gravity move a machine with other masses differently.
    pub(super) mismatch: f64,
}

impl Tolerated {
    /// For what detection tolerates of `rig`, all 0 for a model; each tick keeps `keep` of the sum of the corrections.
    /// None if the plant has no linear model.
    pub(super) fn of(rig: &Rig, design: &Design<f64>, kalman: &Kalman<f64>, keep: f64) -> Option<Self> {
        let sensors = kalman.steps.entries().len();
        let mut bounds = Self {
            innovation: vec![0.0; sensors],
            corrected: vec![0.0; sensors],
            lighter: 1.0,
            mismatch: 1.0,
        };
        let Some(tolerances) = rig.detection_tolerances() else {
            return Some(bounds);
        };
        let wrong = 0.01 * tolerances.mass_percent;
        (bounds.lighter, bounds.mismatch) = (1.0 / (1.0 - wrong), 1.0 + MISMATCH * wrong);
        let plant = continuous_plant::<f64>(rig).ok()?;
        let states = plant.a.rows();
        let held = |column: &Matrix<f64>| zero_order_hold(&plant.a, column, &rig.tick.period_s).1;
        let mut inputs = vec![(held(&plant.b), tolerances.cart_friction_n)];
        for joint in 0..plant.torque_inputs.cols() {
            let torque = held(&plant.torque_inputs.block(0, joint, states, 1));
            inputs.push((torque, tolerances.joint_friction_n_m));
            let angle = 2 + 2 * joint;
            let zero = &Matrix::identity(states) - &design.ad;
            inputs.push((zero.block(0, angle, states, 1), tolerances.homing_error_rad));
        }
        let c = rig.measurement();
        for (input, largest) in inputs.into_iter().filter(|(_, largest)| *largest > 0.0) {
            bounds.add((input, largest), design, kalman, &c, keep);
        }
        Some(bounds)
    }

    /// Adds the effect of an input of magnitude at most `largest`.
    fn add(
        &mut self,
        (input, largest): (Matrix<f64>, f64),
        design: &Design<f64>,
        kalman: &Kalman<f64>,
        c: &Matrix<f64>,
        keep: f64,
    ) {
        let end = DECAYED * input.norm();
        let mut error = input;
        let mut sums = vec![0.0; c.rows()];
        for _ in 0..LONGEST {
            let seen = c * &error;
            let correction = &kalman.l_filter * &seen;
            let corrected = c * &correction;
            for sensor in 0..c.rows() {
                self.innovation[sensor] += largest * seen[(sensor, 0)].abs();
                sums[sensor] = keep * sums[sensor] + corrected[(sensor, 0)];
                self.corrected[sensor] += largest * sums[sensor].abs();
            }
            error = &design.ad * &(&error - &correction);
            if error.norm() < end {
                break;
            }
        }
    }
}
