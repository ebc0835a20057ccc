//! Where the rig may be while the motor is on.

use crate::fault::Fault;
use crate::limits::Limits;

/// The limit that the state `x` (m, m/s, rad, rad/s …) with the requested force (N) is beyond, if any.
///
/// Angles are summed from joint to joint: the limit is on the angle from the vertical. The corrected estimate is looked
/// at, so that a single bad measurement, which was rejected, does not count.
#[inline]
pub fn left<const NY: usize>(limits: &Limits<NY>, x: &[f32], requested: f32) -> Option<Fault> {
    let sum: f32 = x.iter().sum();
    if !(sum + requested).is_finite() {
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
        assert_eq!(found([0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0]), Some(Fault::NotFinite));
        assert_eq!(left(&limits, &[0.0; 6], f32::INFINITY), Some(Fault::NotFinite));
    }
}
