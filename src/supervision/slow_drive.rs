//! A drive with pulses while no control law commands it: it holds the cart, moves it slowly, shakes it, or brings it to
//! rest.

use crate::table::StepMap;

/// Speed at which the cart is homed (m/s): a step motor starts and stops at it without losing a step.
pub const HOMING_M_PER_S: f32 = 0.05;
/// Largest speed of the jog (m/s): the links answer it by some hundredths of a radian.
pub const JOG_M_PER_S: f32 = 0.1;

/// The drive's speed, and the part of a step that it has not yet made.
#[derive(Debug, Clone, Default)]
pub struct SlowDrive {
    speed_m_per_s: f32,
    wanted_m_per_s: f32,
    /// Travel left over from the ticks before (steps).
    rest: f32,
}

impl SlowDrive {
    /// Takes over from a control law that has left the cart at this speed (m/s).
    pub fn take_over(&mut self, speed_m_per_s: f32) {
        let is_finite = speed_m_per_s.is_finite();
        *self = Self { speed_m_per_s: if is_finite { speed_m_per_s } else { 0.0 }, ..Self::default() };
    }

    /// Its speed (m/s).
    pub fn speed_m_per_s(&self) -> f32 {
        self.speed_m_per_s
    }

    /// Stops dead, without a ramp.
    pub fn stop(&mut self) {
        *self = Self::default();
    }

    /// Requests a speed (m/s).
    pub fn want(&mut self, speed_m_per_s: f32) {
        self.wanted_m_per_s = speed_m_per_s;
    }

    /// Whether the cart moves, or is about to.
    pub fn is_moving(&self) -> bool {
        self.speed_m_per_s != 0.0 || self.wanted_m_per_s != 0.0
    }

    /// Approaches the requested speed within the limits of the drive, and returns the pulses of this tick of
    /// `tick_s` (s).
    pub fn pulses(&mut self, map: &StepMap, tick_s: f32) -> i32 {
        let wanted = (self.wanted_m_per_s - self.speed_m_per_s) / tick_s;
        let acceleration = map.limited(wanted, self.speed_m_per_s, tick_s);
        // Exactly the requested speed in the end, so that a cart that is at rest stays there.
        let is_there = acceleration == wanted;
        let reached = self.speed_m_per_s + acceleration * tick_s;
        self.reach(if is_there { self.wanted_m_per_s } else { reached }, map, tick_s)
    }

    /// Accelerates by `wanted` (m/s²) within the limits of the drive; returns the acceleration, and the pulses of this
    /// tick of `tick_s` (s).
    pub fn accelerate(&mut self, wanted: f32, map: &StepMap, tick_s: f32) -> (f32, i32) {
        let acceleration = map.limited(wanted, self.speed_m_per_s, tick_s);
        (acceleration, self.reach(self.speed_m_per_s + acceleration * tick_s, map, tick_s))
    }

    /// The pulses of a tick, at the end of which the drive has this speed.
    fn reach(&mut self, speed_m_per_s: f32, map: &StepMap, tick_s: f32) -> i32 {
        let before = core::mem::replace(&mut self.speed_m_per_s, speed_m_per_s);
        let steps = self.rest + 0.5 * (before + self.speed_m_per_s) * tick_s / map.step_m;
        let whole = (steps + f32::copysign(0.5, steps)) as i32;
        self.rest = steps - whole as f32;
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f32 = 0.001;
    const MAP: StepMap = StepMap {
        step_m: 1e-5,
        acceleration_limit_m_per_s2: 10.0,
        speed_limit_m_per_s: 0.5,
        ..StepMap::ideal(TICK_S)
    };

    /// The pulses until the drive stands, and the number of ticks for which they come.
    fn until_rest(drive: &mut SlowDrive) -> (i32, u32) {
        let (mut sum, mut ticks) = (0, 0);
        while drive.is_moving() {
            sum += drive.pulses(&MAP, TICK_S);
            ticks += 1;
            assert!(ticks < 10_000);
        }
        (sum, ticks)
    }

    #[test]
    fn a_moving_cart_comes_to_rest_with_the_limit_of_the_acceleration() {
        let mut drive = SlowDrive::default();
        drive.take_over(0.4);
        // 0.4 m/s at 10 m/s²: 40 ms, and half of 0.4 · 0.04 m.
        let (pulses, ticks) = until_rest(&mut drive);
        assert!((pulses - 800).abs() <= 1 && (40..=41).contains(&ticks), "{pulses} {ticks}");
        drive.take_over(0.4);
        drive.stop();
        assert_eq!(until_rest(&mut drive), (0, 0));
        drive.take_over(f32::NAN);
        assert_eq!(until_rest(&mut drive), (0, 0));
    }

    #[test]
    fn an_acceleration_moves_the_cart_as_far_as_it_should_and_stays_within_the_limits() {
        let mut drive = SlowDrive::default();
        let sum: i32 = (0..200).map(|_| drive.accelerate(2.0, &MAP, TICK_S).1).sum();
        // 2 m/s² for 0.2 s: 40 mm.
        assert!((sum - 4000).abs() <= 1, "{sum}");
        assert_eq!(drive.accelerate(90.0, &MAP, TICK_S).0, 10.0);
        for _ in 0..100 {
            drive.accelerate(90.0, &MAP, TICK_S);
        }
        assert!(drive.accelerate(90.0, &MAP, TICK_S).1 <= 51, "the drive's largest speed");
        drive.want(0.0);
        let (_, ticks) = until_rest(&mut drive);
        assert!((50..=51).contains(&ticks), "{ticks}");
    }

    #[test]
    fn what_is_rounded_off_is_not_lost_and_the_speed_is_the_requested_one() {
        let mut drive = SlowDrive::default();
        // A third of a step per tick.
        drive.want(1e-5 / 3.0 / TICK_S);
        let sum: i32 = (0..30_000).map(|_| drive.pulses(&MAP, TICK_S)).sum();
        assert!((sum - 10_000).abs() <= 2, "{sum}");
        drive.want(9.0);
        for _ in 0..1000 {
            assert!(drive.pulses(&MAP, TICK_S) <= 51);
        }
        assert!(drive.pulses(&MAP, TICK_S) >= 49, "the drive's largest speed");
    }
}
