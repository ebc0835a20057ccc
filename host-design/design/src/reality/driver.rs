//! Motor driver and supply.

use upright::control::actuator::Drive;

use crate::plant::MotorPlant;
use crate::rig::{DriverFaults, Rig};

/// Motor driver and supply, between a command and the force of the motor.
///
/// - Lag: the voltage, or the commanded force without a motor, follows the command as `τ u̇ = command - u`.
/// - Current limit: the force is at most that of the current.
/// - Supply with internal resistance `R_s`: at the duty `d` the driver takes `d i` from it, so that
///   `V = V_0 - R_s d i` with `R i = d V - E` (E: back-EMF). The supply takes no current back: V is at most V_0.
#[derive(Debug, Clone, PartialEq)]
pub struct Driver {
    lag_s: f64,
    force_factor: f64,
    current_limit_a: f64,
    supply_resistance_ohm: f64,
    /// The command after the lag: a duty, or a force (N) without a motor.
    lagged: f64,
    supply_share: f64,
}

impl Driver {
    /// The driver of a rig, at rest; none if it is ideal.
    pub fn of(rig: &Rig) -> Option<Self> {
        let &DriverFaults { driver_lag_s, current_limit_a, supply_resistance_ohm, force_percent, .. } =
            &rig.reality.driver;
        let lag_s = driver_lag_s.or(rig.actuator.driver_lag_s).unwrap_or(0.0);
        let ideal =
            lag_s == 0.0 && current_limit_a.is_none() && supply_resistance_ohm == 0.0 && force_percent == 0.0;
        (!ideal).then(|| Self {
            lag_s,
            force_factor: 1.0 + force_percent / 100.0,
            current_limit_a: current_limit_a.unwrap_or(f64::INFINITY),
            supply_resistance_ohm,
            lagged: 0.0,
            supply_share: 1.0,
        })
    }

    /// The supply voltage, as a share of the voltage without load.
    pub fn supply_share(&self) -> f64 {
        self.supply_share
    }

    /// Mean force on the cart (N) in the next `dt` (s) under the command `drive`, with the motor at `speed` (m/s).
    pub fn force(&mut self, drive: Drive, motor: Option<&MotorPlant>, speed: f64, dt: f64) -> f64 {
        let command = match drive {
            Drive::Force(force) => f64::from(force),
            Drive::Duty(duty) => f64::from(duty).clamp(-1.0, 1.0),
            // `[reality]` of such a rig has no driver.
            Drive::Steps(_) => 0.0,
        };
        let mean = self.follow(command, dt);
        let force = match (drive, motor) {
            (Drive::Force(_), _) => mean,
            (Drive::Duty(_), Some(motor)) => self.motor_force(motor, mean, speed),
            (Drive::Duty(_), None) | (Drive::Steps(_), _) => 0.0,
        };
        self.force_factor * force
    }

    /// Mean of the lagged command over `dt`, exactly.
    fn follow(&mut self, command: f64, dt: f64) -> f64 {
        if self.lag_s == 0.0 || dt == 0.0 {
            self.lagged = command;
            return command;
        }
        let (before, left) = (self.lagged - command, libm::exp(-dt / self.lag_s));
        self.lagged = command + before * left;
        command + before * (1.0 - left) * (self.lag_s / dt)
    }

    fn motor_force(&mut self, motor: &MotorPlant, duty: f64, speed: f64) -> f64 {
        let ratio = self.supply_resistance_ohm / motor.resistance_ohm();
        let emf = motor.volts_per_speed() * speed;
        let supply = motor.supply_v();
        let loaded = (supply + ratio * duty * emf) / (1.0 + ratio * duty * duty);
        let volts = if self.supply_resistance_ohm > 0.0 { loaded.min(supply) } else { supply };
        self.supply_share = volts / supply;
        let most = self.current_limit_a * motor.newtons_per_amp();
        motor.force_at_supply(duty, speed, volts).clamp(-most, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn rig(reality: &str) -> Rig {
        let text = format!(
            "name = \"driver\"\n[cart]\nmass_kg = 1\n[[link]]\nmass_kg = 1\nlength_m = 1\n[actuator]\nresistance_ohm = 2\n\
             torque_constant_n_m_per_a = 0.5\npulley_radius_m = 0.25\nsupply_v = 12\n[reality]\n{reality}\n"
        );
        Rig::from_toml(&text, Path::new("driver.toml")).unwrap()
    }

    fn force(reality: &str, duty: f32, speed: f64) -> (f64, f64) {
        let rig = rig(reality);
        let motor = rig.actuator.motor.as_ref().map(MotorPlant::of);
        let mut driver = Driver::of(&rig).unwrap();
        let force = driver.force(Drive::Duty(duty), motor.as_ref(), speed, 0.5);
        (force, driver.supply_share())
    }

    #[test]
    fn each_part_does_what_its_equation_says() {
        assert!(Driver::of(&rig("")).is_none());
        // Kt / r = 2 N/A; standing still at full duty, i = 12 V / 2 Ω = 6 A.
        assert_eq!(force("current_limit_a = 4", 1.0, 0.0), (8.0, 1.0));
        assert_eq!(force("current_limit_a = 4", -1.0, 0.0), (-8.0, 1.0));
        assert_eq!(force("force_percent = 50", 1.0, 0.0), (18.0, 1.0));
        // 12 V over 2 + 1 Ω: 4 A and 8 V.
        assert_eq!(force("supply_resistance_ohm = 1", 1.0, 0.0), (8.0, 8.0 / 12.0));
        // The motor runs so fast that it would charge the supply: 7 m/s is 14 V of back-EMF.
        assert_eq!(force("supply_resistance_ohm = 1", 1.0, 7.0), (-2.0, 1.0));
        // The mean of 1 - exp(-t / 0.5) over 0.5 s is exp(-1).
        assert!((force("driver_lag_s = 0.5", 1.0, 0.0).0 - 12.0 * (-1f64).exp()).abs() < 1e-14);
    }
}
