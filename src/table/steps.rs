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
        /// Time after which the drive has the commanded speed (s): the cart is at `x` and `v` when `x + lag_s v` is
        /// commanded; 0 for a drive that follows at once.
        pub lag_s: T,
        /// Speed above that of the cart which is commanded per acceleration (s). Half a tick without lag, since a tick
        /// has the mean speed; `T/(1 - e^(-T/lag))` with it, so that the cart is faster by `a T` after the tick `T`.
        pub lead_s: T,
    }
}

impl<T: Scalar> StepMap<T> {
    /// The step nearest to a position (m), counted from 0; none if the position is not a number or beyond all counts.
    #[inline(never)]
    pub fn nearest(&self, position: T) -> Option<i32> {
        let steps = (position / self.step_m).to_f32();
        let rounded = (steps + f32::copysign(0.5, steps)) as i32;
        (steps.is_finite() && rounded != i32::MAX && rounded != i32::MIN).then_some(rounded)
    }
}

impl StepMap {
    /// A drive that follows at once, without limits, for a tick of `tick_s` (s); its step is 1 m.
    #[cfg(test)]
    pub(crate) const fn ideal(tick_s: f32) -> Self {
        Self {
            step_m: 1.0,
            acceleration_limit_m_per_s2: f32::MAX,
            speed_limit_m_per_s: f32::MAX,
            lag_s: 0.0,
            lead_s: 0.5 * tick_s,
        }
    }

    /// Whether every acceleration maps to pulses.
    pub(crate) fn is_sound(&self) -> bool {
        self.step_m > 0.0
            && self.acceleration_limit_m_per_s2 > 0.0
            && self.speed_limit_m_per_s > 0.0
            && self.lag_s >= 0.0
            && self.lead_s > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_is_rounded_to_the_nearest_step_and_nonsense_to_none() {
        let map = StepMap { step_m: 0.25f32, ..StepMap::ideal(1.0) };
        assert_eq!(map.nearest(0.7), Some(3));
        assert_eq!(map.nearest(-0.6), Some(-2));
        assert_eq!(map.nearest(f32::NAN), None);
        assert_eq!(map.nearest(1e12), None);
    }
}
