//! Disturbances of the simulated machine.

use serde::Serialize;

use crate::rig::{CartInput, Rig};

/// Disturbances, drawn again in every tick and held for the tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Disturbance {
    /// Force on the cart (N rms).
    pub force_n: f64,
    /// Torque at each joint (N·m rms).
    pub torque_n_m: f64,
}

impl Disturbance {
    /// No disturbances.
    pub const NONE: Self = Self { force_n: 0.0, torque_n_m: 0.0 };

    /// What the rig file gives in `[verify]`, or otherwise what its `[kalman]` expects: an intensity is variance times
    /// tick. All joints get the torque of the one with the most noise.
    pub fn of(rig: &Rig) -> Self {
        let rms = |intensity: f64| (intensity / rig.tick.period_s).sqrt();
        // A drive that imposes the cart's acceleration expects no force.
        let forces = f64::from(u8::from(rig.actuator.input() == CartInput::Force));
        let expected = rig.kalman.as_ref().map_or(Self::NONE, |kalman| Self {
            force_n: forces * rms(kalman.force_noise_n2_s),
            torque_n_m: rms(kalman.joint_noise.iter().copied().fold(0.0, f64::max)),
        });
        Self {
            force_n: rig.verify.force_rms_n.unwrap_or(expected.force_n),
            torque_n_m: rig.verify.torque_rms_n_m.unwrap_or(expected.torque_n_m),
        }
    }
}
