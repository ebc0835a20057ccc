//! A servo that follows the speed of its pulses late.

use super::driven_cart::DrivenCart;
use crate::rig::{Held, Rig, lag_at};

/// Parts of a servo's time constant in which the acceleration of the cart is taken as constant, and the most of a tick.
const PARTS_OF_A_LAG: f64 = 10.0;
const MOST_PARTS: f64 = 1000.0;

/// A servo whose cart approaches the commanded speed `v_c` as `lag v̇ = v_c - v`, or with the natural frequency ω and
/// the damping ratio ζ as `v̈ = ω² (v_c - v) - 2 ζ ω v̇`. The same cart follows the commanded position: a servo for
/// positions whose loop has this bandwidth moves alike.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Servo {
    /// 1/lag, or ω (1/s).
    rate: f64,
    /// ζ, less than 1, of a servo of second order.
    damping: Option<f64>,
    /// Its acceleration (m/s²), of second order.
    acceleration: f64,
}

impl Servo {
    /// The servo in the real machine; none if the cart follows at once.
    pub(super) fn of(rig: &Rig) -> Option<Self> {
        let real = &rig.reality.step_motor;
        let lag_s = match (real.bandwidth_hz, rig.actuator.held()) {
            (Some(bandwidth_hz), Held::MeanSpeed | Held::LaggingSpeed { .. }) => lag_at(bandwidth_hz),
            (None, Held::LaggingSpeed { lag_s }) => lag_s,
            _ => return None,
        };
        let damping = real.servo_damping_percent.map(|percent| 0.01 * percent);
        Some(Self { rate: 1.0 / lag_s, damping, acceleration: 0.0 })
    }

    /// Time (s) by which the cart is behind its command at a constant speed.
    pub(super) fn lag_s(&self) -> f64 {
        2.0 * self.damping.unwrap_or(0.5) / self.rate
    }

    /// Its cart is held.
    pub(super) fn rest(&mut self) {
        self.acceleration = 0.0;
    }

    /// Simulates a tick in which the cart approaches a speed (m/s).
    pub(super) fn follow(&mut self, speed: f64, cart: &mut DrivenCart<'_>) {
        let parts = self.parts(cart.period_s, cart.substeps);
        let part_s = cart.period_s / parts as f64;
        for _ in 0..parts {
            let approached = self.approach(cart.state[1] - speed, part_s);
            cart.advance(approached / part_s, part_s, 1);
        }
    }

    /// Parts of a time (s), at least `least`, in which the acceleration is taken as constant.
    fn parts(&self, length_s: f64, least: usize) -> usize {
        (PARTS_OF_A_LAG * length_s * self.rate).ceil().clamp(least as f64, MOST_PARTS) as usize
    }

    /// Change of the cart's speed (m/s) in the next `part_s` (s) if it is `ahead` (m/s) of the commanded one, exactly.
    fn approach(&mut self, ahead: f64, part_s: f64) -> f64 {
        let Some(damping) = self.damping else { return libm::expm1(-part_s * self.rate) * ahead };
        let (decay, swing) = (damping * self.rate, self.rate * libm::sqrt(1.0 - damping * damping));
        let left = libm::exp(-decay * part_s);
        let (sin, cos) = (libm::sin(swing * part_s), libm::cos(swing * part_s));
        let before = self.acceleration;
        let other = (before + decay * ahead) / swing;
        self.acceleration =
            left * (before * cos - (self.rate * self.rate * ahead + decay * before) / swing * sin);
        left * (ahead * cos + other * sin) - ahead
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use super::*;

    fn servo(damping: Option<f64>) -> Servo {
        Servo { rate: TAU * 10.0, damping, acceleration: 0.0 }
    }

    /// The speed (m/s) after this time (s) at rest when 1 m/s is commanded, and how far the cart is then behind (m).
    fn step(servo: &mut Servo, length_s: f64) -> (f64, f64) {
        let parts = 20_000;
        let part_s = length_s / f64::from(parts);
        let (mut speed, mut behind) = (0.0, 0.0);
        for _ in 0..parts {
            let before = speed;
            speed += servo.approach(speed - 1.0, part_s);
            behind += part_s * (1.0 - 0.5 * (speed + before));
        }
        (speed, behind)
    }

    #[test]
    fn a_servo_is_behind_by_its_lag_and_one_of_second_order_overshoots() {
        for damping in [None, Some(0.7), Some(0.3)] {
            let (speed, behind) = step(&mut servo(damping), 2.0);
            assert!((speed - 1.0).abs() < 1e-9 && (behind - servo(damping).lag_s()).abs() < 1e-6, "{behind}");
        }
        // Half a period of its swing after the step: e^(-π ζ / √(1 - ζ²)) above.
        let half_s = 0.05 / (1.0f64 - 0.49).sqrt();
        let above = (-core::f64::consts::PI * 0.7 / (1.0f64 - 0.49).sqrt()).exp();
        assert!((step(&mut servo(Some(0.7)), half_s).0 - 1.0 - above).abs() < 1e-9);
        assert!((step(&mut servo(None), 0.05).0 - 1.0 + (-TAU * 0.5).exp()).abs() < 1e-9);
    }
}
