//! The governor's bound on the speed of the set-point.

use upright::table::SETPOINT_MARGIN;

use super::synthesis::{Design, Feedback};
use crate::numerics::Matrix;
use crate::rig::{Rig, defaults};

/// Share of the limits on angle and force, or on angle, acceleration and speed, that a motion of the set-point may use;
/// the rest is left for disturbances.
const SHARE: f64 = 0.5;

/// Largest change of the set-point per tick (m). In the linear model, every link and the force then stay within half
/// of their limits, whatever path the set-point takes, and the cart within half of the margin that set-points keep from
/// the ends of the rail, when one of them is reached and left again. None if the plant is not a chain, or if no such
/// bound is found.
///
/// The set-point's path is a sum of small steps, one per tick, and the response is the same sum of step responses:
/// `|θ(k)| <= step · Σ_j |s(j)|` with the unit step response s of the design's own sampled loop. The paper says that a
/// criterion for keeping the states in their linear zone is missing; this is such a criterion. It holds for every path
/// and needs one number in the table.
#[doc(alias = "reference_governor")]
#[doc(alias = "command_governor")]
pub fn setpoint_step(rig: &Rig, design: &Design<f64>, law: &Feedback<f64>) -> Option<f64> {
    let chain = rig.chain()?;
    let (matrix, input) = (design.sampled_loop(rig, law), design.setpoint_input(rig, law)?);
    let (links, n) = (chain.links.len(), law.n?);

    let mut state = Matrix::zeros(matrix.rows(), 1);
    let mut sums = vec![0.0; links + 2];
    let mut beyond = Beyond::default();
    let most_ticks = (300.0 / rig.tick.period_s).clamp(1e4, 1e6) as usize;
    for tick in 0..most_ticks {
        let force = n - (&law.k * &state)[(0, 0)];
        let mut angle = 0.0;
        let mut largest = force.abs();
        for (link, sum) in sums.iter_mut().take(links).enumerate() {
            angle += state[(2 + 2 * link, 0)];
            *sum += f64::abs(angle);
            largest = largest.max(f64::abs(angle));
        }
        sums[links] += force.abs();
        sums[links + 1] += state[(1, 0)].abs();
        beyond.take(state[(0, 0)]);
        let settled = largest < 1e-9 && (state[(0, 0)] - 1.0).abs() < 1e-6;
        if settled && tick > 10 {
            return bound(rig, &sums, &beyond);
        }
        state = &(&matrix * &state) + &input;
    }
    None
}

/// How far the cart goes beyond a set-point at which it arrives and from which it returns, per step of the set-point in
/// a tick, by the unit step response s: first it overshoots, by the largest sum of s - 1 over any interval, then it
/// moves outwards before it returns, by the largest sum of -s from the beginning.
#[derive(Debug, Default)]
struct Beyond {
    /// The largest sum of s - 1 over an interval that ends now, and over any.
    overshoot: [f64; 2],
    /// The sum of -s until now, and the largest so far.
    outwards: [f64; 2],
}

impl Beyond {
    fn take(&mut self, s: f64) {
        let [now, most] = self.overshoot;
        let now = f64::max(now + s - 1.0, 0.0);
        self.overshoot = [now, most.max(now)];
        let [now, most] = self.outwards;
        self.outwards = [now - s, most.max(now - s)];
    }

    fn most(&self) -> f64 {
        self.overshoot[1] + self.outwards[1]
    }
}

fn bound(rig: &Rig, sums: &[f64], beyond: &Beyond) -> Option<f64> {
    let (speed, sums) = sums.split_last()?;
    let (force, angles) = sums.split_last()?;
    let angle_limit = rig.limits.angle_rad.unwrap_or(defaults::ANGLE_RAD).min(defaults::ANGLE_RAD);
    let by_angle = angles.iter().map(|sum| SHARE * angle_limit / sum);
    let by_force = rig.actuator.largest_input().map(|limit| SHARE * limit / force);
    let most = rig.actuator.largest_speed_m_per_s(rig.tick.period_s);
    let by_speed = most.map(|limit| SHARE * limit / speed);
    let by_rail = rig.chain().map(|chain| {
        let [low, high] = rig.soft_rail_m(chain);
        SHARE * f64::from(SETPOINT_MARGIN) * (high - low) / beyond.most()
    });
    by_angle
        .chain(by_force)
        .chain(by_speed)
        .chain(by_rail)
        .filter(|step| step.is_finite())
        .min_by(f64::total_cmp)
}
