//! Backlash and an elastic belt between the motor and the cart.

use crate::rig::{DriveTrain, Rig};

/// Damping ratio of rotor and belt.
const DAMPING_RATIO: f64 = 0.1;
/// The rotor's share of the cart's mass if the file does not give it.
const ROTOR_SHARE: f64 = 0.1;
/// Without a given compliance, the teeth yield by this share of the backlash under the largest force.
const TEETH_SHARE: f64 = 0.1;
/// Largest force (N) in that rule if the file gives no limit.
const FORCE_N: f64 = 10.0;

/// State of the motor's rotor, converted to travel of the cart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotor {
    /// Position (m).
    pub position: f64,
    /// Speed (m/s).
    pub speed: f64,
}

impl Rotor {
    /// `self + factor · rate`.
    #[inline]
    pub fn plus(&self, factor: f64, rate: &Self) -> Self {
        Self { position: self.position + factor * rate.position, speed: self.speed + factor * rate.speed }
    }
}

/// Two masses with backlash and a spring between them (M. Nordin, P.-O. Gutman, "Controlling mechanical systems with
/// backlash: a survey", Automatica 38, 2002). With the stretch `s` beyond the play, the belt pulls with `k s + c ṡ`,
/// but never pushes when it is slack: the force has the sign of `s` or is zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Belt {
    /// Mass of the rotor, as seen by the cart (kg).
    pub rotor_kg: f64,
    /// Half of the play (m).
    half_play: f64,
    /// Stiffness k (N/m).
    pub stiffness: f64,
    /// Damping c (N·s/m).
    damping: f64,
}

impl Belt {
    /// The belt of a rig; none if its `[reality]` has neither backlash nor an elastic belt.
    pub fn of(rig: &Rig, cart_kg: f64) -> Option<Self> {
        let &DriveTrain { backlash_m, belt_compliance_m_per_n, rotor_mass_kg } = &rig.reality.drive_train;
        if backlash_m == 0.0 && belt_compliance_m_per_n == 0.0 {
            return None;
        }
        let rotor_kg = rotor_mass_kg.unwrap_or(ROTOR_SHARE * cart_kg);
        let stiffness = if belt_compliance_m_per_n > 0.0 {
            1.0 / belt_compliance_m_per_n
        } else {
            rig.actuator.largest_force_n().unwrap_or(FORCE_N) / (TEETH_SHARE * backlash_m)
        };
        let damping = 2.0 * DAMPING_RATIO * (stiffness * rotor_kg).sqrt();
        Some(Self { rotor_kg, half_play: 0.5 * backlash_m, stiffness, damping })
    }

    /// Force on the cart (N).
    #[inline]
    pub fn force(&self, rotor: &Rotor, position: f64, speed: f64) -> f64 {
        let apart = rotor.position - position;
        let stretch = apart - apart.clamp(-self.half_play, self.half_play);
        let pull = self.stiffness * stretch + self.damping * (rotor.speed - speed);
        if stretch > 0.0 {
            pull.max(0.0)
        } else if stretch < 0.0 {
            pull.min(0.0)
        } else {
            0.0
        }
    }

    /// Energy in the stretched belt (J).
    pub fn energy(&self, rotor: &Rotor, position: f64) -> f64 {
        let apart = rotor.position - position;
        let stretch = apart - apart.clamp(-self.half_play, self.half_play);
        0.5 * self.stiffness * stretch * stretch
    }
}
