//! From force to motor duty cycle, and back to the force actually applied.

#[cfg(feature = "firmware")]
use serde::{Deserialize, Serialize};

use crate::control::state_feedback::saturate;
use crate::table::{DriveMap, MotorMap, Scalar, StepMap};

/// Command to the power stage.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "firmware", derive(Serialize, Deserialize))]
pub enum Drive {
    /// A force (N), for rigs without motor data.
    Force(f32),
    /// A duty cycle from -1 to 1, positive along +x.
    Duty(f32),
    /// Pulses in this tick, spread evenly, positive along +x: for drives that impose the cart's acceleration.
    Steps(i32),
}

impl Drive {
    /// No force, motor off.
    pub const OFF: Self = Drive::Force(0.0);

    /// The command as a duty cycle from -1 to 1. A force becomes a fraction of the largest one of `map`: for a power
    /// stage that controls the motor current and reaches the limit at full scale.
    /// Pulses are no duty.
    #[inline]
    pub fn duty(self, map: &DriveMap) -> f32 {
        match self {
            Drive::Force(force) => saturate(force / map.largest_force_n(), 1.0),
            Drive::Duty(duty) => saturate(duty, 1.0),
            Drive::Steps(_) => 0.0,
        }
    }

    /// The number of the command: force (N), duty or pulses.
    pub fn value(self) -> f32 {
        match self {
            Drive::Force(value) | Drive::Duty(value) => value,
            Drive::Steps(pulses) => pulses as f32,
        }
    }
}

impl<T: Scalar> StepMap<T> {
    /// The acceleration nearest to `wanted` (m/s²) that is within the limits of the drive for a tick of `tick_s` (s),
    /// which begins at `speed` (m/s).
    #[inline(never)]
    pub fn limited(&self, wanted: T, speed: T, tick_s: T) -> T {
        let limited = saturate(wanted, self.acceleration_limit_m_per_s2);
        // A drive with lag is commanded more than the speed after the tick.
        let lead_s = if self.lead_s > tick_s { self.lead_s } else { tick_s };
        let next = speed + limited * lead_s;
        let within = saturate(next, self.speed_limit_m_per_s);
        if within == next {
            return limited;
        }
        saturate((within - speed) / lead_s, self.acceleration_limit_m_per_s2)
    }
}

impl<T: Scalar> MotorMap<T> {
    /// Voltage for the force `force` (N) at the cart speed `speed` (m/s), limited by the supply and by the slew rate
    /// from `last_v`; and the force that this voltage produces.
    ///
    /// ```text
    /// V = (R r / (efficiency gear Kt)) F + (gear Ke / r) ẋ
    /// ```
    pub fn volts_and_force(&self, force: T, speed: T, last_v: T) -> (T, T) {
        let back_emf = self.volts_per_speed * speed;
        let wanted = self.volts_per_newton * force + back_emf;
        // The duty cycle adds the dead zone on top of this voltage, so the limit leaves room for it.
        let within_supply = saturate(wanted, self.supply_v - self.dead_zone_v);
        let volts = last_v + saturate(within_supply - last_v, self.slew_v_per_tick);
        if volts == wanted { (volts, force) } else { (volts, (volts - back_emf) / self.volts_per_newton) }
    }

    /// Duty cycle for `force` (N) on a cart at rest.
    pub fn duty_at_rest(&self, force: T) -> T {
        self.duty(self.volts_per_newton * force)
    }

    /// Duty cycle for `volts`, with the dead zone compensated.
    ///
    /// The compensation rises ten times as fast as the voltage, up to the whole dead zone. So the duty cycle does not
    /// jump at 0, and less than a tenth of the dead zone is left uncompensated.
    pub fn duty(&self, volts: T) -> T {
        let lift = saturate(T::from_f32(10.0) * volts, self.dead_zone_v);
        saturate((volts + lift) / self.supply_v, T::from_f32(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{ForceMap, Late};

    const MOTOR: MotorMap = MotorMap {
        force: ForceMap { limit_n: 20.0, late: Late { acts: 0.0, stays: 0.0 } },
        volts_per_newton: 2.0,
        volts_per_speed: 4.0,
        dead_zone_v: 1.0,
        slew_v_per_tick: 100.0,
        supply_v: 12.0,
    };

    #[test]
    fn back_emf_is_made_up_for() {
        assert_eq!(MOTOR.volts_and_force(1.5, 0.5, 0.0), (5.0, 1.5));
    }

    #[test]
    fn the_force_that_is_left_at_the_supply_limit_is_reported() {
        // The dead zone leaves 11 V of 12 V; 4 V of them are back-EMF.
        assert_eq!(MOTOR.volts_and_force(10.0, 1.0, 0.0), (11.0, 3.5));
        assert_eq!(MOTOR.duty(11.0), 1.0);
        assert_eq!(MOTOR.duty(-11.0), -1.0);
    }

    #[test]
    fn the_voltage_changes_no_faster_than_the_slew_limit() {
        let slow = MotorMap { slew_v_per_tick: 0.5, ..MOTOR };
        assert_eq!(slow.volts_and_force(2.0, 0.0, 1.0), (1.5, 0.75));
        assert_eq!(slow.volts_and_force(-2.0, 0.0, 1.0), (0.5, 0.25));
    }

    #[test]
    fn the_dead_zone_is_jumped_without_a_jump_at_rest() {
        assert_eq!(MOTOR.duty(0.0), 0.0);
        assert_eq!(MOTOR.duty(0.0625), 0.6875 / 12.0);
        assert_eq!(MOTOR.duty(0.5), 1.5 / 12.0);
        assert_eq!(MOTOR.duty(2.0), 3.0 / 12.0);
    }

    #[test]
    fn a_force_is_a_share_of_the_limit() {
        for map in [DriveMap::Force(MOTOR.force), DriveMap::Volts(MOTOR)] {
            assert_eq!(Drive::Force(-5.0).duty(&map), -0.25);
            assert_eq!(Drive::Force(30.0).duty(&map), 1.0);
            assert_eq!(Drive::Duty(-0.5).duty(&map), -0.5);
            assert_eq!(Drive::OFF.duty(&map), 0.0);
            assert_eq!(Drive::Force(f32::NAN).duty(&map), 0.0);
        }
        assert_eq!(MOTOR.duty_at_rest(-2.5), -0.5);
        let pulses = DriveMap::Pulses(StepMap::ideal(0.001));
        assert_eq!((Drive::OFF.duty(&pulses), Drive::Steps(9).duty(&pulses)), (0.0, 0.0));
    }

    #[test]
    fn neither_acceleration_nor_speed_exceeds_the_limits_of_the_drive() {
        let drive =
            StepMap { acceleration_limit_m_per_s2: 8.0, speed_limit_m_per_s: 1.0, ..StepMap::ideal(0.0625) };
        assert_eq!(drive.limited(5.0, 0.5, 0.0625), 5.0);
        assert_eq!(drive.limited(-50.0, 0.5, 0.0625), -8.0);
        assert_eq!(drive.limited(5.0, 0.75, 0.0625), 4.0);
        assert_eq!(drive.limited(5.0, 1.0, 0.0625), 0.0);
        assert_eq!(drive.limited(-5.0, 1.0, 0.0625), -5.0);
        // Faster than allowed: it brakes as hard as it can.
        assert_eq!(drive.limited(5.0, 2.0, 0.0625), -8.0);
        assert_eq!(drive.limited(f32::NAN, 0.5, 0.0625), 0.0);
        // With a lead of a quarter of a second, the command is 0.25 m/s above the cart's speed at 1 m/s².
        let slow = StepMap { lag_s: 0.25, lead_s: 0.25, ..drive };
        assert_eq!(slow.limited(5.0, 0.75, 0.0625), 1.0);
    }

    #[test]
    fn nan_turns_the_motor_off() {
        assert_eq!(MOTOR.duty(f32::NAN), 0.0);
        assert_eq!(MOTOR.volts_and_force(f32::NAN, 0.0, 0.0).0, 0.0);
    }
}
