//! A drive that imposes the cart's acceleration, as seen by the controller.

use crate::numbers::Scalar;
use crate::table::part::part;

part! {
    /// A drive that imposes the cart's acceleration by step pulses. A limit that the rig does not have is `f32::MAX`.
    #[derive(Copy)]
    pub struct StepMap<; T> {
        /// Travel of the cart per pulse (m).
        pub step_m: T,
        /// Largest acceleration of the cart (m/s²).
        pub acceleration_limit_m_per_s2: T,
        /// Largest speed of the cart (m/s).
        pub speed_limit_m_per_s: T,
    }
}

impl<T: Scalar> StepMap<T> {
    /// The step nearest to a position (m), counted from 0; none if the position is not a number or beyond all counts.
    pub fn nearest(&self, position: T) -> Option<i32> {
        let steps = (position / self.step_m).to_f32();
        let rounded = (steps + f32::copysign(0.5, steps)) as i32;
        (steps.is_finite() && rounded != i32::MAX && rounded != i32::MIN).then_some(rounded)
    }
}

impl StepMap {
    /// Whether every acceleration maps to pulses.
    pub(crate) fn is_sound(&self) -> bool {
        self.step_m > 0.0 && self.acceleration_limit_m_per_s2 > 0.0 && self.speed_limit_m_per_s > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_is_rounded_to_the_nearest_step_and_nonsense_to_none() {
        let map = StepMap { step_m: 0.25f32, acceleration_limit_m_per_s2: 1.0, speed_limit_m_per_s: 1.0 };
        assert_eq!(map.nearest(0.7), Some(3));
        assert_eq!(map.nearest(-0.6), Some(-2));
        assert_eq!(map.nearest(f32::NAN), None);
        assert_eq!(map.nearest(1e12), None);
    }
}
