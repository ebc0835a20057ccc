//! The innovation of a rig that is pushed by hand.

use upright::supervision::finding::IN_A_ROW;

use super::lag::shares;
use super::zero_order_hold::zero_order_hold;
use super::{Design, Feedback, Kalman, continuous_plant};
use crate::numerics::Matrix;
use crate::rig::{Chain, Rig, defaults};

/// Durations of the pushes (s).
const DURATIONS_S: [f64; 5] = [0.005, 0.02, 0.1, 0.3, 1.0];
/// Where a link is pushed: shares of its length above its joint.
const ALONG: [f64; 3] = [0.5, 0.75, 1.0];
/// A loop is watched for this long after the push (s).
const AFTER_S: f64 = 1.5;
/// The hardest push lies between two powers of 2, which are this often brought together.
const HALVINGS: usize = 3;
/// Share of the largest angle up to which the linear loop stands for the rig.
const LINEAR_SHARE: f64 = 0.45;
/// The search ends this far from the force at which it begins (powers of 2).
const POWERS: usize = 40;

/// Largest innovation of each sensor (m or rad) under the hardest pushes, of 5 ms to 1 s at the cart or at the outer
/// half of a link, that one of the laws survives in the linear loop with its limited force. None for a model,
/// for another drive than a force, and without a law or a limit.
///
/// How hard they are follows from the laws; the error of the prediction then follows from the push, and from the
/// firmware, which rejects measurements of the cart whose innovation grows by more than `healthy` (m) in a tick.
pub(super) fn pushed(
    rig: &Rig,
    design: &Design<f64>,
    kalman: &Kalman<f64>,
    healthy: f64,
) -> Option<Vec<f64>> {
    let (chain, limit) = (rig.chain()?, rig.actuator.largest_input()?);
    if !rig.actuator.input().is_force() {
        return None;
    }
    let plant = continuous_plant::<f64>(rig).ok()?;
    let laws = design.sampled.each();
    laws.present().next()?;
    let pushed_loop = PushedLoop { rig, design, limit, limits: Limits::of(rig, chain) };
    let mut largest = vec![0.0f64; rig.sensors().len()];
    for arms_m in places(chain) {
        let turned = &plant.torque_inputs * &arms_m;
        let input = &plant.b + &turned;
        let push =
            UnitPush::new(&zero_order_hold(&plant.a, &input, &rig.tick.period_s).1, &pushed_loop, kalman);
        let mut force_n = limit;
        for (_, law) in laws.present() {
            for duration_s in DURATIONS_S {
                let lasts = ticks(rig, duration_s);
                force_n = hardest(force_n, |force_n| pushed_loop.survives(law, &push, lasts, force_n));
                let reached = pushed_loop.reached(kalman, &push, lasts, force_n, healthy);
                largest = largest.iter().zip(reached).map(|(most, e)| most.max(e)).collect();
            }
        }
    }
    Some(largest)
}

/// Height of the pushed point above each joint (m, negative: a push along +x turns a link clockwise), for each place.
fn places(chain: &Chain) -> Vec<Matrix<f64>> {
    let lengths_m: Vec<f64> = chain.links.iter().map(|link| link.length_m).collect();
    let at = |body: usize, along: f64| {
        let arm = |joint: usize| match joint + 1 {
            number if number < body => -lengths_m[joint],
            number if number == body => -along * lengths_m[joint],
            _ => 0.0,
        };
        // A torque at a joint acts on all links above it.
        let above = |joint: usize, _| (joint..lengths_m.len()).map(arm).sum();
        Matrix::from_fn(lengths_m.len(), 1, above)
    };
    let links = (1..=lengths_m.len()).flat_map(|body| ALONG.map(|along| at(body, along)));
    core::iter::once(at(0, 0.0)).chain(links).collect()
}

/// Number of ticks in this time, at least one.
fn ticks(rig: &Rig, seconds: f64) -> usize {
    (seconds / rig.tick.period_s).ceil().max(1.0) as usize
}

/// The largest force (N) that `is_survived`, near `force_n`.
fn hardest(mut force_n: f64, is_survived: impl Fn(f64) -> bool) -> f64 {
    let survived = is_survived(force_n);
    let factor = if survived { 2.0 } else { 0.5 };
    for _ in 0..POWERS {
        if is_survived(factor * force_n) != survived {
            break;
        }
        force_n *= factor;
    }
    if !survived {
        force_n *= factor;
    }
    let mut step = 2.0f64;
    for _ in 0..HALVINGS {
        step = step.sqrt();
        if is_survived(step * force_n) {
            force_n *= step;
        }
    }
    force_n
}

/// What a push of 1 N does that begins in the first tick and does not end.
struct UnitPush {
    /// Change of the state in a tick.
    held: Vec<f64>,
    /// Error of the corrected estimate in each tick.
    response: Vec<Vec<f64>>,
}

impl UnitPush {
    fn new(held: &Matrix<f64>, pushed_loop: &PushedLoop<'_>, kalman: &Kalman<f64>) -> Self {
        let rig = pushed_loop.rig;
        let mut predicted = PredictionError::new(pushed_loop, kalman);
        let response = (0..ticks(rig, DURATIONS_S[DURATIONS_S.len() - 1] + AFTER_S)).map(|_| {
            predicted.see();
            predicted.pass();
            predicted.push(held.entries());
            predicted.corrected.clone()
        });
        Self { response: response.collect(), held: held.entries().to_vec() }
    }
}

/// The error of the prediction, tick by tick.
struct PredictionError<'a> {
    ad: &'a Matrix<f64>,
    l_filter: &'a Matrix<f64>,
    c: Matrix<f64>,
    /// Error of the predicted state.
    error: Vec<f64>,
    /// What the sensors show of it (m or rad).
    seen: Vec<f64>,
    /// Error of the corrected estimate.
    corrected: Vec<f64>,
}

impl<'a> PredictionError<'a> {
    /// No error.
    fn new(pushed_loop: &PushedLoop<'a>, kalman: &'a Kalman<f64>) -> Self {
        let (ad, l_filter) = (&pushed_loop.design.ad, &kalman.l_filter);
        let c = pushed_loop.rig.measurement();
        let (zeros, seen) = (vec![0.0; ad.rows()], vec![0.0; c.rows()]);
        Self { ad, l_filter, c, error: zeros.clone(), seen, corrected: zeros }
    }

    /// The sensors show the error.
    fn see(&mut self) {
        self.c.times_column(&self.error, &mut self.seen);
    }

    /// A tick passes: the estimate is corrected by what was seen, and the error moves on with the state.
    fn pass(&mut self) {
        self.l_filter.times_column(&self.seen, &mut self.corrected);
        for i in 0..self.error.len() {
            self.corrected[i] = self.error[i] - self.corrected[i];
        }
        self.ad.times_column(&self.corrected, &mut self.error);
    }

    /// What a push changes in a tick.
    fn push(&mut self, change: &[f64]) {
        for (error, change) in self.error.iter_mut().zip(change) {
            *error += change;
        }
    }
}

/// The linear loop, with its limits.
struct PushedLoop<'a> {
    rig: &'a Rig,
    design: &'a Design<f64>,
    /// Largest force of the motor (N).
    limit: f64,
    limits: Limits,
}

/// Limits of the supervisor, about the middle of the rail.
struct Limits {
    rail_m: f64,
    speed_m_per_s: f64,
    angle_rad: f64,
}

impl Limits {
    fn of(rig: &Rig, chain: &Chain) -> Self {
        Self {
            rail_m: chain.cart.travel_m.into_iter().fold(0.0, |most: f64, end| most.max(end.abs())),
            speed_m_per_s: rig.limits.speed_m_per_s.unwrap_or(f64::INFINITY),
            angle_rad: LINEAR_SHARE * rig.limits.angle_rad.unwrap_or(defaults::ANGLE_RAD),
        }
    }

    /// Whether a state [x, ẋ, θ_1, θ̇_1 …] is within them; a link leans by the sum of the joints up to its own.
    fn allow(&self, state: &[f64]) -> bool {
        let (cart, joints) = state.split_at(2);
        let mut lean_rad = 0.0f64;
        let upright = joints.iter().step_by(2).all(|angle_rad| {
            lean_rad += angle_rad;
            lean_rad.abs() <= self.angle_rad
        });
        upright && cart[0].abs() <= self.rail_m && cart[1].abs() <= self.speed_m_per_s
    }
}

impl PushedLoop<'_> {
    /// Whether no limit is exceeded when the rig is pushed from rest with this force for `lasts` ticks.
    fn survives(&self, law: &Feedback<f64>, push: &UnitPush, lasts: usize, force_n: f64) -> bool {
        let [acts, stays] = shares(self.rig, self.rig.tick.period_s);
        let mut state = vec![0.0; push.held.len()];
        let (mut estimate, mut next) = (state.clone(), state.clone());
        let mut pending = 0.0;
        let watched = (lasts + ticks(self.rig, AFTER_S)).min(push.response.len());
        (0..watched).all(|tick| {
            let since_end = tick.checked_sub(lasts);
            for i in 0..state.len() {
                let after = since_end.map_or(0.0, |since| push.response[since][i]);
                estimate[i] = state[i] - force_n * (push.response[tick][i] - after);
            }
            let of_pending = if acts > 0.0 { law.k.row(0)[estimate.len()] * pending } else { 0.0 };
            let requested = law.force_n(0.0, &estimate) - of_pending;
            let applied = requested.clamp(-self.limit, self.limit);
            let acting = acts * pending + (1.0 - acts) * applied;
            pending = stays * pending + (1.0 - stays) * applied;
            let force_n = if since_end.is_none() { force_n } else { 0.0 };
            self.design.ad.times_column(&state, &mut next);
            for i in 0..state.len() {
                state[i] = next[i] + self.design.bd[(i, 0)] * acting + push.held[i] * force_n;
            }
            self.limits.allow(&state)
        })
    }

    /// Largest innovation of each sensor (m or rad) in three ticks in a row, after a push with this force for `lasts`
    /// ticks. As in the firmware, two measurements of the cart in a row are rejected whose innovations grow by more
    /// than `healthy` (m) beyond the last accepted one. Those of the links are not rejected here: with limits that
    /// allow for this, too, a dead motor of the quadruple is found too late.
    fn reached(
        &self,
        kalman: &Kalman<f64>,
        push: &UnitPush,
        lasts: usize,
        force_n: f64,
        healthy: f64,
    ) -> Vec<f64> {
        let held: Vec<f64> = push.held.iter().map(|held| held * force_n).collect();
        let mut predicted = PredictionError::new(self, kalman);
        let mut largest = vec![0.0f64; predicted.seen.len()];
        let mut last = vec![[0.0f64; IN_A_ROW as usize]; predicted.seen.len()];
        let (mut accepted, mut rejected) = (0.0f64, 0);
        for tick in 0..push.response.len() {
            predicted.see();
            let seen = &mut predicted.seen;
            for sensor in 0..seen.len() {
                last[sensor][tick % IN_A_ROW as usize] = seen[sensor].abs();
                let least = last[sensor].iter().copied().fold(f64::INFINITY, f64::min);
                largest[sensor] = largest[sensor].max(least);
            }
            let plausible = accepted.min(0.0) - healthy..=accepted.max(0.0) + healthy;
            if plausible.contains(&seen[0]) || rejected + 1 == IN_A_ROW {
                (accepted, rejected) = (seen[0], 0);
            } else {
                seen[0] = 0.0;
                rejected += 1;
            }
            predicted.pass();
            if tick < lasts {
                predicted.push(&held);
            }
        }
        largest
    }
}
