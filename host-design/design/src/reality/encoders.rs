//! Errors of encoders and of their zeros.

use core::f64::consts::PI;

use crate::rig::{Rig, SensorErrors};

/// What the encoders measure instead of the joints' angles: `θ + e + a (sin(θ + p) - sin(h + p))` for each joint.
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
    amplitude: f64,
    phase: f64,
    at_homing: f64,
}

impl RealEncoders {
    /// The encoders of a rig; none if they have no error.
    pub fn of(rig: &Rig) -> Option<Self> {
        let errors = &rig.reality.sensors;
        (errors.homing_error_rad.is_any() || errors.eccentricity_rad.is_any())
            .then(|| Self { joints: (0..rig.links()).map(|joint| Joint::of(errors, joint)).collect() })
    }

    /// Measured value of the state with this index, whose true value is `value`. Only angles have errors.
    pub fn measured(&self, state: usize, value: f64) -> f64 {
        let joint = (state / 2).checked_sub(1).and_then(|joint| self.joints.get(joint));
        joint.filter(|_| state.is_multiple_of(2)).map_or(value, |joint| joint.measured(value))
    }
}

impl Joint {
    fn of(errors: &SensorErrors, joint: usize) -> Self {
        let phase = errors.eccentricity_phase_rad.of(joint);
        Self {
            zero_error: errors.homing_error_rad.of(joint),
            amplitude: errors.eccentricity_rad.of(joint),
            phase,
            at_homing: libm::sin(if joint == 0 { PI } else { 0.0 } + phase),
        }
    }

    fn measured(&self, angle: f64) -> f64 {
        angle + self.zero_error + self.amplitude * (libm::sin(angle + self.phase) - self.at_homing)
    }
}

/// The state (m, m/s, rad, rad/s …) in which the links of a chain are homed: hanging, but each joint off by its zero
/// error, because the firmware takes it as exactly hanging.
pub fn hanging_by_hand(rig: &Rig) -> Vec<f64> {
    let mut hanging = vec![0.0; rig.states()];
    hanging[2] = PI;
    for (joint, angle) in hanging[2..].iter_mut().step_by(2).enumerate() {
        *angle -= rig.reality.sensors.homing_error_rad.of(joint);
    }
    hanging
}
