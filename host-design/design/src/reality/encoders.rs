//! Errors of encoders and of their zeros.

use core::f64::consts::PI;

use crate::rig::{Link, PerJoint, Rig, SensorErrors};

/// What the encoders measure instead of the joints' angles: `θ + e + a (sin(θ + p) - sin(h + p))` for each joint, plus
/// `b (sin(2 θ + q) - sin(2 h + q))` for an error twice per turn. A reading that is old is that of `θ - delay · θ'`.
///
/// Amplitudes, phases and delays are those that the rig file states of its sensors and those of `[reality]`, together.
///
/// `e` is the zero error from homing, and `h` is the joint's angle at homing. The links are homed hanging, so `h` is π
/// for the first joint and 0 for the others, and there the eccentricity causes no error. (Amplitude and phase of an
/// encoder on an eccentric disk: Heidenhain, *Rotary Encoders*, "Measuring accuracy".)
#[derive(Debug, Clone, PartialEq)]
pub struct RealEncoders {
    joints: Vec<Joint>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Joint {
    zero_error: f64,
    /// Amplitude and phase of the error once per turn, and of that twice per turn.
    harmonics: [[f64; 2]; 2],
    /// Their sum at homing.
    at_homing: f64,
    delay_s: f64,
}

impl RealEncoders {
    /// The encoders of a rig; none if they have neither error nor delay.
    pub fn of(rig: &Rig) -> Option<Self> {
        let errors = &rig.reality.sensors;
        let SensorErrors { homing_error_rad, eccentricity_rad, twice_per_turn_rad, sensor_delay_s, .. } =
            errors;
        let links: Vec<&Link> = rig.chain().iter().flat_map(|chain| &chain.links).collect();
        let errors_of_joints = [homing_error_rad, eccentricity_rad, twice_per_turn_rad, sensor_delay_s];
        let has_error = errors_of_joints.into_iter().any(PerJoint::is_any)
            || links.iter().any(|link| link.sensor_delay_s > 0.0 || !link.errors.are_none());
        let joint = |(joint, link): (usize, &&Link)| Joint::of(errors, joint, link);
        has_error.then(|| Self { joints: links.iter().enumerate().map(joint).collect() })
    }

    /// Measured value of the position with this index in `state`. Only angles have errors.
    pub fn measured(&self, index: usize, state: &[f64]) -> f64 {
        let joint = (index / 2).checked_sub(1).and_then(|joint| self.joints.get(joint));
        let rate = state.get(index + 1).copied().unwrap_or_default();
        joint
            .filter(|_| index.is_multiple_of(2))
            .map_or(state[index], |joint| joint.measured(state[index], rate))
    }
}

impl Joint {
    fn of(errors: &SensorErrors, joint: usize, stated: &Link) -> Self {
        let once = [errors.eccentricity_rad.of_joint(joint), errors.eccentricity_phase_rad.of_joint(joint)];
        let twice =
            [errors.twice_per_turn_rad.of_joint(joint), errors.twice_per_turn_phase_rad.of_joint(joint)];
        let [stated_once, stated_twice] = stated.errors.harmonics();
        let mut of = Self {
            zero_error: errors.homing_error_rad.of_joint(joint),
            harmonics: [sum_of_sines(once, stated_once), sum_of_sines(twice, stated_twice)],
            at_homing: 0.0,
            delay_s: stated.sensor_delay_s + errors.sensor_delay_s.of_joint(joint),
        };
        of.at_homing = of.periodic(if joint == 0 { PI } else { 0.0 });
        of
    }

    fn periodic(&self, angle: f64) -> f64 {
        let [[once, phase], [twice, phase_of_twice]] = self.harmonics;
        once * libm::sin(angle + phase) + twice * libm::sin(2.0 * angle + phase_of_twice)
    }

    fn measured(&self, angle: f64, rate: f64) -> f64 {
        let then = angle - self.delay_s * rate;
        then + self.zero_error + (self.periodic(then) - self.at_homing)
    }
}

/// Amplitude and phase of the sum of two sines of the same period, each given by its own.
pub fn sum_of_sines(first: [f64; 2], second: [f64; 2]) -> [f64; 2] {
    let [[a, p], [b, q]] = [first, second];
    if b == 0.0 {
        return first;
    }
    let (sin, cos) = (a * libm::sin(p) + b * libm::sin(q), a * libm::cos(p) + b * libm::cos(q));
    [libm::hypot(sin, cos), libm::atan2(sin, cos)]
}

/// The state (m, m/s, rad, rad/s …) in which the links of a chain are homed: hanging, but each joint off by its zero
/// error, because the firmware takes it as exactly hanging.
pub fn hanging_by_hand(rig: &Rig) -> Vec<f64> {
    let mut hanging = vec![0.0; rig.states()];
    hanging[2] = PI;
    for (joint, angle) in hanging[2..].iter_mut().step_by(2).enumerate() {
        *angle -= rig.reality.sensors.homing_error_rad.of_joint(joint);
    }
    hanging
}
