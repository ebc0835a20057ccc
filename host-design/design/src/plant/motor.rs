//! The DC motor that drives the cart, with supply limit, back-EMF and dead zone.

use crate::rig;

/// Force on the cart from the motor's voltage, through gear and pulley.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorPlant {
    newtons_per_volt: f64,
    newtons_per_amp: f64,
    volts_per_speed: f64,
    dead_zone_v: f64,
    supply_v: f64,
}

impl MotorPlant {
    /// The motor that a rig file describes.
    pub fn of(motor: &rig::Motor) -> Self {
        Self {
            newtons_per_volt: motor.newtons_per_volt(),
            newtons_per_amp: motor.newtons_per_amp(),
            volts_per_speed: motor.volts_per_speed(),
            dead_zone_v: motor.dead_zone_v,
            supply_v: motor.supply_v,
        }
    }

    /// Force on the cart (N) at `duty` (clamped to -1 … 1) and cart speed `speed` (m/s). The dead zone reduces the
    /// magnitude of the voltage; a voltage inside the dead zone counts as zero.
    pub fn force(&self, duty: f64, speed: f64) -> f64 {
        self.force_at_supply(duty.clamp(-1.0, 1.0), speed, self.supply_v)
    }

    /// As [`MotorPlant::force`], at another supply voltage (V), and with a duty that is not clamped: a step with the
    /// impulse of a duty that fades within it may need a larger one.
    pub fn force_at_supply(&self, duty: f64, speed: f64, supply_v: f64) -> f64 {
        let volts = duty * supply_v;
        let effective = volts.signum() * (volts.abs() - self.dead_zone_v).max(0.0);
        self.newtons_per_volt * (effective - self.volts_per_speed * speed)
    }

    /// Winding resistance (Ω).
    pub fn resistance_ohm(&self) -> f64 {
        self.newtons_per_amp / self.newtons_per_volt
    }

    /// Force on the cart per current (N/A).
    pub fn newtons_per_amp(&self) -> f64 {
        self.newtons_per_amp
    }

    /// Back-EMF per speed of the cart (V·s/m).
    pub fn volts_per_speed(&self) -> f64 {
        self.volts_per_speed
    }

    /// Decrease of the force per speed of the cart (N·s/m).
    pub fn braking_n_s_per_m(&self) -> f64 {
        self.newtons_per_volt * self.volts_per_speed
    }

    /// Supply voltage without load (V).
    pub fn supply_v(&self) -> f64 {
        self.supply_v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_follows_voltage_less_dead_zone_and_back_emf() {
        let motor = MotorPlant {
            newtons_per_volt: 0.5,
            newtons_per_amp: 4.0,
            volts_per_speed: 4.0,
            dead_zone_v: 1.0,
            supply_v: 12.0,
        };
        assert_eq!(motor.force(0.5, 0.0), 2.5);
        assert_eq!(motor.force(-0.5, 0.25), -3.0);
        assert_eq!(motor.force(0.05, 0.0), 0.0);
        assert_eq!(motor.force(2.0, 0.0), 5.5);
    }
}
