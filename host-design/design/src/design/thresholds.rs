//! Thresholds of the innovation that indicate a faulty encoder or motor, from the Kalman filter's covariance.

use super::Design;
use super::kalman::sensor_variances;
use super::pushed::pushed;
use super::tolerated::Tolerated;
use crate::rig::{Held, Rig};

/// Share of the motor's force that may be missing.
const MISSING_SHARE: f64 = 0.5;

/// Thresholds of the firmware's tests (`upright::supervision::detection`), in f64.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectionDesign {
    /// Alarm threshold, in standard deviations of a healthy rig.
    pub deviations: f64,
    /// Largest plausible innovation of each sensor (m or rad).
    pub innovation: Vec<f64>,
    /// Largest predicted motion of each sensor while its counter stands still (m or rad).
    pub frozen: Vec<f64>,
    /// Largest innovation of each sensor under a push that the rig survives (m or rad); empty where pushes are not told
    /// from defects.
    pub push: Vec<f64>,
    /// The motor's test; none for a model, whose sensors need not show the speed that a force causes.
    pub motor: Option<MotorDesign>,
}

/// Constants of the motor's test, at the sensor [`witness`](upright::table::DriveMap::witness).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorDesign {
    /// Dynamics of the error of predicted position and speed, [a_pp, a_pv, a_vp, a_vv].
    pub a: [f64; 4],
    /// Change of position and speed per force in one tick (m/N, m/s/N).
    pub b: [f64; 2],
    /// Share of the force that may be missing without a fault.
    pub ratio: f64,
    /// Least energy `Σ p²` for a verdict (m²).
    pub energy: f64,
}

/// Thresholds for a rig with an observer; none without.
///
/// On a healthy rig the innovation `e` is white with covariance `S = C P⁻ Cᵀ + R`. All tests together exceed `g`
/// standard deviations once in `false_alarm_h`. A fault needs three in a row, but this is not used here, so the rate
/// also holds for lasting disturbances.
///
/// - Plausible: `|e_i| <= g √S_ii + step_i / 2`. The half step is a counter's largest rounding error, which is not
///   Gaussian.
/// - Frozen: over a memory of M ticks (each keeping `κ = 1 - 1/M`), the predicted motion of a counter that stands
///   still is its true motion, less than a step, plus the observer's corrections, `Σ κ^k (L e)_i`. The corrections are
///   white with at most the variance `S_ii - R_ii`, so the sum is within `step_i + g √((S_ii - R_ii) / (1 - κ²))`.
/// - Motor: least squares over the same memory estimates the share ρ of the force that is missing,
///   `ρ̂ = Σ e p / Σ p²`, where p is the innovation caused by a completely missing force. With a healthy motor its
///   standard deviation is `√(S_00 / Σ p²)`; there is no verdict until that is at most 1/g of the share that may be
///   missing.
/// - Push: the first of them, and what the hardest push that a law survives adds to it (see `pushed`).
///
/// For a chain, each is wider by the largest error `B` that the tolerated friction and wrong zeros can cause, the
/// first also by a factor for wrong masses (see the source of `tolerated`). In the motor's test,
/// `Σ e p <= B √(M Σ p²)`.
pub fn detection_thresholds(rig: &Rig, design: &Design<f64>) -> Option<DetectionDesign> {
    let kalman = design.kalman.as_ref()?;
    let variances = kalman.innovation_variances.entries();
    let steps = kalman.steps.entries();
    // One test for plausibility and one for freezing per sensor, and one for the motor.
    let tests = (2 * steps.len() + 1) as f64 * rig.limits.false_alarm_h * 3600.0 / rig.tick.period_s;
    let g = deviations(1.0 / tests);
    let keep = f64::from(1.0 - 1.0 / upright::supervision::detection::MEMORY);
    let tolerated = Tolerated::of(rig, design, kalman, keep)?;
    let wider = tolerated.lighter;
    let innovation: Vec<f64> = (variances.iter().zip(steps).zip(&tolerated.innovation))
        .map(|((s, step), bound)| tolerated.mismatch * wider * (g * s.sqrt() + bound) + 0.5 * step)
        .collect();
    let by_hand = pushed(rig, design, kalman, innovation[0]).unwrap_or_default();
    let push = by_hand.iter().zip(&innovation).map(|(by_hand, healthy)| healthy + by_hand).collect();
    let measurement = sensor_variances(rig, steps);
    let sensor = rig.actuator.input().motor_sensor();
    let frozen = (variances.iter().zip(steps).zip(measurement).zip(&tolerated.corrected)).map(
        |(((s, step), r), bound)| {
            let corrected = (s - r).max(0.0) / (1.0 - keep * keep);
            step + wider * (g * corrected.sqrt() + bound)
        },
    );
    let mut frozen: Vec<f64> = frozen.collect();
    if sensor > 0 {
        // The prediction moves by up to a step between two pulses; the rest is for its rounding.
        frozen[0] *= 1.5;
        // While the command of a drive with lag stands still, its cart may move.
        if matches!(rig.actuator.held(), Held::LaggingSpeed { .. }) {
            frozen[0] = f64::INFINITY;
        }
    }
    let wrong = f64::from(upright::supervision::detection::MEMORY).sqrt() * tolerated.innovation[sensor];
    let motor = rig.chain().is_some().then(|| {
        let (ad, bd, l) = (&design.ad, &design.bd, &kalman.l_filter);
        let (p, v, variance) = (2 * sensor, 2 * sensor + 1, variances[sensor]);
        let corrected = |row: usize| ad[(row, p)] * (1.0 - l[(p, sensor)]) - ad[(row, v)] * l[(v, sensor)];
        MotorDesign {
            a: [corrected(p), ad[(p, v)], corrected(v), ad[(v, v)]],
            b: [bd[(p, 0)], bd[(v, 0)]],
            ratio: MISSING_SHARE,
            energy: (g / MISSING_SHARE).powi(2)
                * variance
                * (wider * (1.0 + wrong / (g * variance.sqrt()))).powi(2),
        }
    });
    Some(DetectionDesign { deviations: g, innovation, frozen, push, motor })
}

/// Number of standard deviations that a Gaussian exceeds, on either side, with this probability.
fn deviations(probability: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let exceeded = libm::erfc(middle / core::f64::consts::SQRT_2);
        if exceeded > probability { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviations_are_those_of_the_normal_distribution() {
        // Tables of the normal distribution.
        for (probability, wanted) in
            [(0.317_310_507_9, 1.0), (0.002_699_796_063, 3.0), (5.733_031_44e-7, 5.0)]
        {
            assert!((deviations(probability) - wanted).abs() < 1e-8);
        }
    }
}
