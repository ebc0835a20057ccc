//! Where the rig may be while the motor is on.

use crate::supervision::fault::Fault;
use crate::table::limits::Limits;

/// The limit that the state `x` (m, m/s, rad, rad/s …) with the requested force (N) is beyond, if any.
///
/// Angles are summed from joint to joint: the limit is on the angle from the vertical. The corrected estimate is looked
/// at, so that a single bad measurement, which was rejected, does not count.
#[inline]
pub fn left<const NY: usize>(limits: &Limits<NY>, x: &[f32], requested: f32) -> Option<Fault> {
    // The request is a sum over all states: if one of them is not finite, it is not either.
    if !requested.is_finite() {
        return Some(Fault::NotFinite);
    }
    let mut states = x.iter();
    let mut next = || states.next().copied().unwrap_or_default();
    let (position, speed) = (next(), next());
    let [low, high] = limits.rail_m;
    if position < low || position > high {
        return Some(Fault::Rail);
    }
    let mut angle = 0.0;
    for joint in x.iter().skip(2).step_by(2) {
        angle += joint;
        if f32::abs(angle) > limits.angle_rad {
            return Some(Fault::Angle);
        }
    }
    (speed.abs() > limits.speed_m_per_s).then_some(Fault::Speed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::state_feedback::state_feedback;
    use nalgebra::SVector;

    #[test]
    fn whichever_state_is_not_finite_the_request_is_not_either() {
        // A gain of 0 as well: 0 times infinity is not a number.
        let k = SVector::from([1.0, -2.0, 0.0, 3.0]);
        for state in 0..4 {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut x = SVector::from([0.5; 4]);
                x[state] = bad;
                assert!(!state_feedback(1.0, 0.0, &k, &x).is_finite());
            }
        }
        assert!(state_feedback(1.0, 0.0, &k, &SVector::from([0.5; 4])).is_finite());
    }

    #[test]
    fn every_limit_is_watched_on_both_sides() {
        let limits =
            Limits::<3> { rail_m: [-1.0, 2.0], angle_rad: 0.3, speed_m_per_s: 1.5, ..Limits::none() };
        let found = |x: [f32; 6]| left(&limits, &x, 0.0);
        assert_eq!(found([1.9, -1.4, 0.2, 9.0, -0.45, -9.0]), None);
        assert_eq!(found([2.1, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(Fault::Rail));
        assert_eq!(found([-1.1, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(Fault::Rail));
        assert_eq!(found([0.0, -1.6, 0.0, 0.0, 0.0, 0.0]), Some(Fault::Speed));
        assert_eq!(found([0.0, 0.0, -0.31, 0.0, 0.0, 0.0]), Some(Fault::Angle));
        // Each joint within the limit, the second link not.
        assert_eq!(found([0.0, 0.0, 0.2, 0.0, 0.2, 0.0]), Some(Fault::Angle));
        for requested in [f32::INFINITY, f32::NAN] {
            assert_eq!(left(&limits, &[0.0; 6], requested), Some(Fault::NotFinite));
        }
    }
}
