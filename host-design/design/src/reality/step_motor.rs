//! The motor of a drive with pulses: a spring between its field, which the pulses turn, and its rotor.

use core::f64::consts::{PI, TAU};

use upright::table::Equilibrium;

use crate::plant::{ChainParameters, linearise};
use crate::rig::{CartInput, Chain, Rig};

/// Longest time for which the motor's force is taken as constant (s): a hundredth of the period of 1 kHz.
const LONGEST_S: f64 = 1e-5;

/// A step motor that pulls the cart towards the position of its pulses. If the cart is two full steps away, it slips.
#[derive(Debug, Clone, PartialEq)]
pub struct StepMotor {
    holding_n: f64,
    full_step_m: f64,
    corner_m_per_s: f64,
    damping_n_s_per_m: f64,
}

impl StepMotor {
    /// The motor of `[reality]`, if it is described there.
    pub fn of(rig: &Rig) -> Option<Self> {
        let data = &rig.reality.step_motor;
        let (holding_n, full_step_m) = data.holding_force_n.zip(data.full_step_m)?;
        let corner_m_per_s = data.corner_speed_m_per_s.unwrap_or(f64::INFINITY);
        let mut motor = Self { holding_n, full_step_m, corner_m_per_s, damping_n_s_per_m: 0.0 };
        let critical = 2.0 * (motor.stiffness_n_per_m() * rig.chain()?.cart.mass_kg?).sqrt();
        motor.damping_n_s_per_m = 0.01 * data.motor_damping_percent * critical;
        Some(motor)
    }

    /// Frequency (Hz) at which rotor and cart swing on the field, with the links free.
    pub fn resonance_hz(&self, chain: &Chain) -> Option<f64> {
        let parameters = ChainParameters::<f64>::of(&self.pulled(chain));
        let per_newton = linearise(&parameters, Equilibrium::UPRIGHT).ok()?.b[(1, 0)];
        Some((self.stiffness_n_per_m() * per_newton).sqrt() / TAU)
    }

    /// Stiffness of the field around the position of its pulses.
    fn stiffness_n_per_m(&self) -> f64 {
        0.5 * PI * self.holding_n / self.full_step_m
    }

    /// The chain that this motor moves by a force.
    pub fn pulled(&self, chain: &Chain) -> Chain {
        Chain { input: CartInput::Force, ..chain.clone() }
    }

    /// Number of parts of a time (s) in which the force is taken as constant.
    pub fn parts(&self, length_s: f64) -> usize {
        (length_s / LONGEST_S).ceil().max(1.0) as usize
    }

    /// Force on the cart (N) at its position and speed, if the pulses are at `commanded`: position (m) and speed (m/s).
    pub fn force_n(&self, commanded: [f64; 2], cart: [f64; 2]) -> f64 {
        let [ahead_m, faster] = [commanded[0] - cart[0], commanded[1] - cart[1]];
        let most_n = self.holding_n / (commanded[1] / self.corner_m_per_s).hypot(1.0);
        most_n * (0.5 * PI * ahead_m / self.full_step_m).sin() + self.damping_n_s_per_m * faster
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motor() -> StepMotor {
        StepMotor { holding_n: 60.0, full_step_m: 2e-4, corner_m_per_s: 0.75, damping_n_s_per_m: 3.0 }
    }

    #[test]
    fn the_force_is_largest_a_full_step_away_and_turns_around_two_away() {
        let force = |ahead_m: f64| motor().force_n([ahead_m, 0.0], [0.0, 0.0]);
        assert_eq!(force(0.0), 0.0);
        assert!((force(2e-4) - 60.0).abs() < 1e-9);
        assert!(force(3.9e-4) > 0.0 && force(4.1e-4) < 0.0);
        // Four full steps away is in step again: that far it slips.
        assert!(force(8e-4).abs() < 1e-9);
    }

    #[test]
    fn the_force_falls_with_the_speed_and_damps_the_lag() {
        let fast = motor().force_n([2e-4, 1.0], [0.0, 1.0]);
        assert!((fast - 36.0).abs() < 1e-9, "{fast}");
        assert!((motor().force_n([0.0, 1.0], [0.0, 0.0]) - 3.0).abs() < 1e-9);
    }
}
