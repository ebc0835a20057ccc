//! Limits on position, speed and angles while the motor is on.
//!
//! A new limit on the state belongs here; its value belongs to [`Limits`].

use crate::supervision::fault::Fault;
use crate::table::{Limits, MotionLimits};

/// The fault of the first limit that the state `x` (m, m/s, rad, rad/s …) or the requested force (N) exceeds.
///
/// In this order: request not finite, rail, angle, speed. Joint angles are added up, because the limit is on each
/// link's angle from the vertical. `x` is the corrected estimate: a single bad measurement was rejected before and
/// does not count.
#[inline]
pub fn exceeded(limits: &Limits, x: &[f32], requested_n: f32) -> Option<Fault> {
    // The request is a sum over all states: if one of them is not finite, neither is the sum.
    if !requested_n.is_finite() {
        return Some(Fault::NotFinite);
    }
    let mut states = x.iter();
    let mut next = || states.next().copied().unwrap_or_default();
    let (position, speed) = (next(), next());
    let [low, high] = limits.rail_m;
    if position < low || position > high {
        return Some(Fault::Rail);
    }
    let is_fast = speed.abs() > limits.speed_m_per_s;
    let (mut angle, mut leans) = (0.0, false);
    for joint in x.chunks(2).skip(1) {
        angle += joint.first().copied().unwrap_or_default();
        leans |= f32::abs(angle) > limits.angle_rad;
    }
    leans.then_some(Fault::Angle).or(is_fast.then_some(Fault::Speed))
}

/// The same for a rig that follows a planned motion, in this order: request not finite, rail, tracking error, speed.
/// Instead of the angles from the vertical, the distances of cart and links from the `planned` state are limited.
#[inline]
pub fn exceeded_in_motion(
    limits: &MotionLimits,
    x: &[f32],
    planned: &[f32],
    requested_n: f32,
) -> Option<Fault> {
    if !requested_n.is_finite() {
        return Some(Fault::NotFinite);
    }
    let mut states = x.iter();
    let mut next = || states.next().copied().unwrap_or_default();
    let (position, speed) = (next(), next());
    let [low, high] = limits.rail_m;
    if position < low || position > high {
        return Some(Fault::Rail);
    }
    let mut positions = x.iter().zip(planned).step_by(2).map(|(x, planned)| x - planned);
    let mut is_off = f32::abs(positions.next().unwrap_or_default()) > limits.deviation_m;
    let mut angle = 0.0;
    for joint in positions {
        angle += joint;
        is_off |= f32::abs(angle) > limits.deviation_rad;
    }
    let is_fast = speed.abs() > limits.speed_m_per_s;
    is_off.then_some(Fault::TrackingError).or(is_fast.then_some(Fault::Speed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::state_feedback::state_feedback;
    use nalgebra::SVector;

    #[test]
    fn a_state_that_is_not_finite_makes_the_request_not_finite() {
        // With a gain of 0, too: 0 times infinity is NaN.
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
        let limits = Limits { rail_m: [-1.0, 2.0], angle_rad: 0.3, speed_m_per_s: 1.5, ..Limits::none() };
        let found = |x: [f32; 6]| exceeded(&limits, &x, 0.0);
        assert_eq!(found([1.9, -1.4, 0.2, 9.0, -0.45, -9.0]), None);
        assert_eq!(found([2.1, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(Fault::Rail));
        assert_eq!(found([-1.1, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(Fault::Rail));
        assert_eq!(found([0.0, -1.6, 0.0, 0.0, 0.0, 0.0]), Some(Fault::Speed));
        assert_eq!(found([0.0, 0.0, -0.31, 0.0, 0.0, 0.0]), Some(Fault::Angle));
        // Each joint within the limit, the second link not.
        assert_eq!(found([0.0, 0.0, 0.2, 0.0, 0.2, 0.0]), Some(Fault::Angle));
        for requested_n in [f32::INFINITY, f32::NAN] {
            assert_eq!(exceeded(&limits, &[0.0; 6], requested_n), Some(Fault::NotFinite));
        }
        // A linear model may have an odd number of states.
        assert_eq!(exceeded(&limits, &[2.1], 0.0), Some(Fault::Rail));
        assert_eq!(exceeded(&limits, &[0.0, 0.0, 0.31], 0.0), Some(Fault::Angle));
        assert_eq!(exceeded(&limits, &[0.0, 0.0, 0.29], 0.0), None);
    }

    #[test]
    fn a_planned_motion_may_pass_any_angle_but_is_not_left() {
        let limits =
            MotionLimits { deviation_rad: 0.35, deviation_m: 0.1, speed_m_per_s: 1.5, rail_m: [-1.0, 0.58] };
        let planned = [0.5, 1.0, 3.0, 9.0, -2.0, 5.0];
        let found = |x: [f32; 6]| exceeded_in_motion(&limits, &x, &planned, 0.0);
        assert_eq!(found(planned), None);
        assert_eq!(found([0.57, 1.4, 3.3, 0.0, -2.0, 0.0]), None);
        assert_eq!(found([0.39, 1.0, 3.0, 9.0, -2.0, 5.0]), Some(Fault::TrackingError));
        assert_eq!(found([0.5, 1.0, 2.64, 9.0, -2.0, 5.0]), Some(Fault::TrackingError));
        // Each joint is near its own plan, the second link is not near its angle from the vertical.
        assert_eq!(found([0.5, 1.0, 3.2, 9.0, -1.8, 5.0]), Some(Fault::TrackingError));
        assert_eq!(found([0.59, 1.0, 3.0, 9.0, -2.0, 5.0]), Some(Fault::Rail));
        assert_eq!(found([-1.1, 1.0, 3.0, 9.0, -2.0, 5.0]), Some(Fault::Rail));
        assert_eq!(found([0.5, 1.6, 3.0, 9.0, -2.0, 5.0]), Some(Fault::Speed));
        assert_eq!(found([0.5, -1.6, 3.0, 9.0, -2.0, 5.0]), Some(Fault::Speed));
        let request = exceeded_in_motion(&limits, &planned, &planned, f32::NAN);
        assert_eq!(request, Some(Fault::NotFinite));
    }
}
