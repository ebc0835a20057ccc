//! Motor driver and supply.

use upright::control::actuator::Drive;

use crate::plant::{Actuation, MotorPlant};
use crate::rig::{DriverErrors, Rig};

/// Below this share of the lag in a step, its moments are computed as series.
const SERIES_BELOW: f64 = 0.5;

/// Motor, its driver and its supply, between a command and the force on the cart.
///
/// - Motor: the back-EMF follows the speed at any time. A duty of 0 brakes by it, through the winding; a motor that is
///   off turns freely.
/// - Lag: the voltage, or the commanded force without a motor, follows the command as `τ u̇ = command - u`.
/// - Current limit: the force is at most that of the current.
/// - Supply with internal resistance `R_s`: at the duty `d` the driver takes `d i` from it, so that
///   `V = V_0 - R_s d i` with `R i = d V - E` (E: back-EMF). The supply takes no current back: V is at most V_0.
#[derive(Debug, Clone, PartialEq)]
pub struct Driver {
    motor: Option<MotorPlant>,
    lag_s: f64,
    force_factor: f64,
    current_limit_a: f64,
    supply_resistance_ohm: f64,
    /// The command after the lag: a duty, or a force (N) without a motor.
    lagged: f64,
    supply_share: f64,
}

impl Driver {
    /// The driver of a rig, at rest; none if the force is the commanded one.
    pub fn of(rig: &Rig) -> Option<Self> {
        let &DriverErrors { driver_lag_s, current_limit_a, supply_resistance_ohm, force_percent, .. } =
            &rig.reality.driver;
        let lag_s = driver_lag_s.or(rig.actuator.lag_s()).unwrap_or(0.0);
        let motor = rig.actuator.motor().map(MotorPlant::of);
        let is_ideal = motor.is_none() && lag_s == 0.0 && force_percent == 0.0;
        (!is_ideal).then(|| Self {
            motor,
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

    /// The force while the command `drive` acts from now on, together with a constant disturbing force (N).
    pub fn acting(&self, drive: Drive, disturbance_n: f64) -> ActingDrive<'_> {
        let command = match (drive, &self.motor) {
            (Drive::Duty(duty), Some(_)) => f64::from(duty).clamp(-1.0, 1.0),
            (Drive::Force(force), None) => f64::from(force),
            // A motor that is off; `[reality]` of a drive with pulses has no driver.
            _ => 0.0,
        };
        let is_free = self.motor.is_some() && !matches!(drive, Drive::Duty(_));
        ActingDrive { driver: self, command, disturbance_n, is_free }
    }

    /// Ends a time of `length_s` (s) in which the command `drive` acted; the motor is now at `speed` (m/s).
    pub fn finish(&mut self, drive: Drive, length_s: f64, speed: f64) {
        let acting = self.acting(drive, 0.0);
        let lagged = acting.input_after(length_s);
        let share = match &self.motor {
            Some(motor) if !acting.is_free => self.supply_at(motor, lagged, speed) / motor.supply_v(),
            _ => 1.0,
        };
        (self.lagged, self.supply_share) = (lagged, share);
    }

    /// Force (N) at a duty after the lag.
    fn motor_force(&self, motor: &MotorPlant, duty: f64, speed: f64) -> f64 {
        let most = self.current_limit_a * motor.newtons_per_amp();
        let force = motor.force_at_supply(duty, speed, self.supply_at(motor, duty, speed));
        force.clamp(-most, most)
    }

    /// Voltage of the supply under this load (V).
    fn supply_at(&self, motor: &MotorPlant, duty: f64, speed: f64) -> f64 {
        let supply = motor.supply_v();
        if self.supply_resistance_ohm == 0.0 {
            return supply;
        }
        let ratio = self.supply_resistance_ohm / motor.resistance_ohm();
        let emf = motor.volts_per_speed() * speed;
        ((supply + ratio * duty * emf) / (1.0 + ratio * duty * duty)).min(supply)
    }
}

/// A command that acts: the force as a function of the motor's speed and of the command after the lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActingDrive<'a> {
    driver: &'a Driver,
    command: f64,
    disturbance_n: f64,
    /// Whether the motor turns freely.
    is_free: bool,
}

impl ActingDrive<'_> {
    /// Force of the motor (N) when the command begins to act, without the disturbance.
    pub fn first_n(&self, speed: f64) -> f64 {
        Self { disturbance_n: 0.0, ..*self }.force_n(self.input_after(0.0), speed)
    }

    /// The command after the lag, `time_s` (s) after it was given.
    fn input_after(&self, time_s: f64) -> f64 {
        let Driver { lag_s, lagged, .. } = *self.driver;
        // A motor that is off has no current that would fade.
        if lag_s == 0.0 || self.is_free {
            return self.command;
        }
        self.command + (lagged - self.command) * libm::exp(-time_s / lag_s)
    }
}

impl Actuation for ActingDrive<'_> {
    /// With a lag, those of the parabola whose moments over the step, of order 0 to 2, are those of the lagged command:
    /// the impulse, and the travel of a mass, are exact whatever the step.
    fn inputs(&self, from_s: f64, step_s: f64) -> [f64; 3] {
        if self.driver.lag_s == 0.0 || self.is_free {
            return [self.command; 3];
        }
        let before = self.input_after(from_s) - self.command;
        parabola_of_decay(step_s / self.driver.lag_s).map(|node| self.command + before * node)
    }

    #[inline]
    fn force_n(&self, input: f64, speed_m_per_s: f64) -> f64 {
        let force = match &self.driver.motor {
            Some(_) if self.is_free => 0.0,
            Some(motor) => self.driver.motor_force(motor, input, speed_m_per_s),
            None => input,
        };
        self.driver.force_factor * force + self.disturbance_n
    }

    fn damping_n_s_per_m(&self) -> f64 {
        let motor = self.driver.motor.as_ref().filter(|_| !self.is_free);
        motor.map_or(0.0, |motor| self.driver.force_factor * motor.braking_n_s_per_m())
    }
}

/// Values at 0, 1/2 and 1 of the parabola with the same moments over \[0, 1\], of order 0 to 2, as `exp(-z s)`.
fn parabola_of_decay(z: f64) -> [f64; 3] {
    let [m0, m1, m2] = if z < SERIES_BELOW {
        // Σ (-z)^k / k! / (k + 1 + order)
        core::array::from_fn(|order| {
            let (mut sum, mut term) = (0.0, 1.0);
            for k in 0..12 {
                sum += term / (k + 1 + order) as f64;
                term *= -z / (k + 1) as f64;
            }
            sum
        })
    } else {
        let left = libm::exp(-z);
        let m0 = (1.0 - left) / z;
        let m1 = (m0 - left) / z;
        [m0, m1, (2.0 * m1 - left) / z]
    };
    let parabola = |s: f64| {
        (9.0 - 36.0 * s + 30.0 * s * s) * m0
            + (-36.0 + 192.0 * s - 180.0 * s * s) * m1
            + (30.0 - 180.0 * s + 180.0 * s * s) * m2
    };
    [0.0, 0.5, 1.0].map(parabola)
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

    /// Force and share of the supply 0.5 s after the command.
    fn force(reality: &str, duty: f32, speed: f64) -> (f64, f64) {
        let mut driver = Driver::of(&rig(reality)).unwrap();
        driver.finish(Drive::Duty(duty), 0.5, speed);
        (driver.acting(Drive::Duty(duty), 0.0).first_n(speed), driver.supply_share())
    }

    #[test]
    fn each_part_does_what_its_equation_says() {
        assert_eq!(force("", 1.0, 0.0), (12.0, 1.0));
        // Kt / r = 2 N/A; standing still at full duty, i = 12 V / 2 Ω = 6 A.
        assert_eq!(force("current_limit_a = 4", 1.0, 0.0), (8.0, 1.0));
        assert_eq!(force("current_limit_a = 4", -1.0, 0.0), (-8.0, 1.0));
        assert_eq!(force("force_percent = 50", 1.0, 0.0), (18.0, 1.0));
        // 12 V over 2 + 1 Ω: 4 A and 8 V.
        assert_eq!(force("supply_resistance_ohm = 1", 1.0, 0.0), (8.0, 8.0 / 12.0));
        // The motor runs so fast that it would charge the supply: 7 m/s is 14 V of back-EMF.
        assert_eq!(force("supply_resistance_ohm = 1", 1.0, 7.0), (-2.0, 1.0));
        assert!((force("driver_lag_s = 0.5", 1.0, 0.0).0 - 12.0 * (1.0 - (-1f64).exp())).abs() < 1e-14);
        // A duty of 0 brakes with 2 N/A · 2 V·s/m / 2 Ω; a motor that is off turns freely.
        assert_eq!(force("", 0.0, 0.25), (-0.5, 1.0));
        let driver = Driver::of(&rig("")).unwrap();
        assert_eq!(driver.acting(Drive::OFF, 0.0).first_n(0.25), 0.0);
    }

    /// RK4 with an input at its nodes adds `h/6 (f_0 + 4 f_½ + f_1)` to the speed of a mass and
    /// `h²/6 (f_0 + 2 f_½)` to its travel.
    #[test]
    fn the_nodes_of_a_lag_move_a_mass_exactly() {
        for z in [1e-6, 0.01, 0.49, 0.51, 2.0, 50.0] {
            let [begin, middle, end] = parabola_of_decay(z);
            let impulse = (begin + 4.0 * middle + end) / 6.0;
            let travel = (begin + 2.0 * middle) / 6.0;
            let (exact, left) = (-libm::expm1(-z) / z, libm::exp(-z));
            // ∫ (1 - s) exp(-z s) = m0 - m1 with m1 = (m0 - exp(-z)) / z.
            let exact_travel = if z < 1e-3 { 0.5 - z / 6.0 } else { exact - (exact - left) / z };
            assert!((impulse - exact).abs() < 1e-12 * exact, "{z}: {impulse} {exact}");
            assert!((travel - exact_travel).abs() < 1e-11 * exact_travel, "{z}: {travel} {exact_travel}");
            // Negative control: the mean, held over the step, moves it elsewhere.
            assert!(z < 0.1 || (0.5 * exact / exact_travel - 1.0).abs() > 1e-3, "{z}");
        }
    }
}
