//! Compensation of known Coulomb friction.
//!
//! ```text
//! f_i = -clamp(slope_i ω_i, ±coulomb_i),   u = … + Σ p_i f_i,   x̂⁻(next tick) = … + Σ g_i f_i
//! ```
//!
//! The rate ω_i of axis i is state 2i + 1.

use crate::control::state_feedback::saturate;
use crate::table::{FrictionMap, Law, Scalar};

impl<const NX: usize, const NY: usize, T: Scalar> FrictionMap<NX, NY, T> {
    /// Force on the cart (N) that compensates the friction of all axes at the rates of `estimate`. Writes the friction
    /// of each axis to `friction` (N, for joints N m).
    pub(crate) fn force(&self, law: Law, estimate: &[T; NX], friction: &mut [T; NY]) -> T {
        let mut force = T::default();
        let axes = self.axes.data.0.iter().zip(estimate.as_chunks::<2>().0);
        for (friction, (axis, [_, rate])) in friction.iter_mut().zip(axes) {
            let [coulomb, slope, lqr, pole_placement] = axis;
            let per_friction = match law {
                Law::Lqr => *lqr,
                Law::PolePlacement => *pole_placement,
            };
            *friction = -saturate(*slope * *rate, *coulomb);
            force += per_friction * *friction;
        }
        force
    }

    /// Adds the effect of this friction during one tick to the prediction.
    pub(crate) fn add_to(&self, prediction: &mut [T; NX], friction: &[T; NY]) {
        for (column, friction) in self.effect.data.0.iter().zip(friction) {
            for (x, effect) in prediction.iter_mut().zip(column) {
                *x += *effect * *friction;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::columns;

    #[test]
    fn friction_opposes_the_rate_is_bounded_and_acts_on_force_and_prediction() {
        let map = FrictionMap {
            axes: columns([[2.0, 4.0, -1.0, 0.0], [1.0, 8.0, 3.0, 0.0]]),
            effect: columns([[0.0, 1.0, 0.0, 0.5], [0.0, 0.25, 0.0, 1.0]]),
        };
        // The cart is slow, the joint fast: frictions -1 and 1.
        let x = [9.0, 0.25, 9.0, -1.0];
        let mut friction = [0.0; 2];
        assert_eq!(map.force(Law::Lqr, &x, &mut friction), 4.0);
        assert_eq!(friction, [-1.0, 1.0]);
        assert_eq!(map.force(Law::PolePlacement, &x, &mut friction), 0.0);
        let mut next = [0.0, 1.0, 2.0, 3.0];
        map.add_to(&mut next, &friction);
        assert_eq!(next, [0.0, 0.25, 2.0, 3.5]);
        assert_eq!(map.force(Law::Lqr, &[0.0, f32::NAN, 0.0, f32::INFINITY], &mut friction), -3.0);
    }
}
