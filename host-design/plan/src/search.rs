//! The search for a motion: many candidates, of which the most robust is kept.
//!
//! 1. Candidates: for each, a duration, the largest force, the usable part of the rail and the weight of the links'
//!    rates are drawn at random, and multiple shooting with knots 5 or 10 ms apart solves the problem. If the
//!    interior-point method stalls, the cost is dropped, and Newton steps on the gaps alone finish the solution.
//! 2. Refinement from knots to ticks, with the force held over each tick, until the gaps are below 2e-8.
//! 3. Gains: a linear quadratic regulator along the motion with the weights of `[lqr]`, but four times those of the
//!    positions, because a link that leaves its plan soon falls. The terminal cost is the stationary one. A Kalman
//!    filter expects more noise than at rest: 100 times at the joints, 10 times at the cart, plus wrong friction. Both
//!    are slower for a long chain on a stepper.
//! 4. Selection: the score is from runs with every mass wrong by 0.5 % and all friction wrong by the spread, without
//!    noise. The 30 best are tested with 40 random runs each, and the best four of these with 160, with the control law
//!    alone in f64 and the unmodified weights of `[lqr]`, so that weak motions are exposed.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::SwingUpError;
use super::gains::motion;
use super::problem::{Bounds, Knots, TrajectoryProblem};
use super::refine::{Path, refine};
use super::robustness::{MotionSpread, score};
use super::setting::Setting;
use super::shooting;
use upright_design::motion::{PlannedMotion, Transition};
use upright_design::numerics::Matrix;
use upright_design::parallel;

/// Share of motor and speed that a plan uses, and the ranges for input and rail: what is left is for the feedback.
const SHARE: f64 = 0.9;
const INPUT_SHARE: [f64; 2] = [0.6, 0.9];
const RAIL_SHARE: [f64; 2] = [0.6, 0.9];
/// Durations in units of √(L/g).
const DURATION: [f64; 2] = [9.0, 20.0];
/// Between other equilibria, candidates from number `LATE` on may last up to `STRETCH` times as long.
const LATE: u64 = 100;
const STRETCH: f64 = 2.0;
/// Weight of the links' rates, in units of L/g: the range of its logarithm to base 10.
const RATE_WEIGHT: [f64; 2] = [-2.0, 0.5];
/// An input that changes by its limit within this time costs as much as one at its limit (s).
const RATE_TIME_S: f64 = 0.03;
/// How far a refined path may exceed a bound of the plan, as a share of it.
const EXCESS: f64 = 0.03;

/// Candidates are ranked with the weights of `[lqr]`. With [`POSITION_WEIGHT`](super::gains::POSITION_WEIGHT), most of
/// them survive all runs, and those that are then chosen are worse with coarse encoders and wrong zeros.
const RANKING_WEIGHT: f64 = 1.0;

/// The random values of a candidate.
struct Draw {
    /// Duration (s).
    duration_s: f64,
    /// Bounds of the plan.
    bounds: Bounds,
    /// Weight of the rates (s²/rad²).
    rate_weight: f64,
    /// Amplitudes of the harmonics in the input of the initial guess, as shares of its bound.
    wobble: [f64; 3],
    /// Links that turn the other way round if the motion changes them: a bit for each.
    reversed: u32,
}

/// A candidate that was solved.
pub(crate) struct MotionCandidate {
    pub(crate) knots: Knots,
    pub(crate) motion: PlannedMotion,
    /// Smaller is more robust.
    pub(crate) score: f64,
}

/// Limits that the rig file sets for a plan.
#[derive(Debug, Clone)]
pub(crate) struct SearchRanges {
    /// Ranges from which duration, largest input and largest distance from the middle of the rail are drawn.
    pub(crate) duration_s: [f64; 2],
    pub(crate) input: [f64; 2],
    pub(crate) rail_m: [f64; 2],
    /// The bounds that are not drawn.
    pub(crate) bounds: Bounds,
    pub(crate) spread: MotionSpread,
}

impl SearchRanges {
    pub(crate) fn of(setting: &Setting<'_>) -> Self {
        let (unit, rules) = (time_unit(setting), &setting.rules);
        let mut bounds = setting.actuator.scaled(SHARE);
        let asked = rules.speed_m_per_s.or(setting.rig.limits.speed_m_per_s.map(|speed| SHARE * speed));
        bounds.speed_m_per_s = match (asked, bounds.speed_m_per_s) {
            (Some(asked), Some(drive)) => Some(asked.min(drive)),
            (asked, drive) => asked.or(drive),
        };
        let full = setting.actuator.input;
        let input = match rules.input() {
            Some(largest) => [largest.min(full); 2],
            None => INPUT_SHARE.map(|share| share * full),
        };
        let [low, high] = setting.chain.cart.travel_m;
        let farthest = high.min(-low);
        let rail_m = match rules.rail_m {
            Some(rail) => [rail.min(farthest); 2],
            None => RAIL_SHARE.map(|share| share * farthest),
        };
        let [shortest, longest] = DURATION.map(|units| units * unit);
        let shortest = rules.shortest_s.unwrap_or_else(|| shortest.min(rules.longest_s.unwrap_or(shortest)));
        let duration_s = [shortest, rules.longest_s.unwrap_or(longest).max(shortest)];
        Self { duration_s, input, rail_m, bounds, spread: MotionSpread::asked(setting.rig) }
    }
}

/// √(L/g) (s).
fn time_unit(setting: &Setting<'_>) -> f64 {
    let length: f64 = setting.chain.links.iter().map(|link| link.length_m).sum();
    (length / setting.chain.gravity_m_per_s2).sqrt()
}

/// Draws candidate `number`.
fn draw(setting: &Setting<'_>, request: &SearchRanges, transition: Transition, number: u64) -> Draw {
    let mut random = Pcg64::seed_from_u64(number);
    let mut between = |[low, high]: [f64; 2]| low + (high - low) * random.random_range(0.0..=1.0);
    let unit = time_unit(setting);
    let is_between = matches!(transition, Transition::Between { .. });
    let [shortest, longest] = request.duration_s;
    let duration_s =
        between([shortest, if is_between && number >= LATE { STRETCH * longest } else { longest }]);
    let (input, rail_m) = (between(request.input), between(request.rail_m));
    let rate_weight = libm::exp10(between(RATE_WEIGHT)) * unit * unit;
    let wobble = core::array::from_fn(|_| if number == 0 { 0.0 } else { between([-0.05, 0.05]) });
    let bounds = Bounds { input, rail_m: Some([-rail_m, rail_m]), ..request.bounds.clone() };
    // The first candidate turns all links the same way, as in raising and lowering.
    let reversed =
        if is_between && number > 0 { random.random_range(0..1 << setting.chain.links.len()) } else { 0 };
    Draw { duration_s, bounds, rate_weight, wobble, reversed }
}

/// Ticks between two knots: 5 ms for the fast chains of four and more links, 10 ms otherwise.
pub(crate) fn ticks_per_knot(setting: &Setting<'_>) -> usize {
    let knot_s = if setting.chain.links.len() >= 4 { 0.005 } else { 0.01 };
    (knot_s / setting.tick_s).round().max(1.0) as usize
}

/// Solves candidate `number`. None if its gaps do not close, or a bound does not hold.
fn solve(
    setting: &Setting<'_>,
    request: &SearchRanges,
    transition: Transition,
    number: u64,
) -> Option<(Knots, Path)> {
    let draw = draw(setting, request, transition, number);
    let ticks = ticks_per_knot(setting);
    let knot_s = ticks as f64 * setting.tick_s;
    let [_, end] = transition.ends(setting.rig.states(), |link| draw.reversed >> link & 1 != 0);
    // To the last bit the ends with which the motion will be restored.
    let ends = transition.ends_near(&end);
    let [start, end] = ends.clone();
    let problem = TrajectoryProblem {
        dynamics: &*setting.dynamics,
        knot_s,
        steps: (draw.duration_s / knot_s).round().max(2.0) as usize,
        start,
        end,
        limits: draw.bounds.limits(),
        state_weights: rate_weights(setting, draw.rate_weight),
        input_weight: setting.actuator.input.powi(-2),
        rate_weight: (RATE_TIME_S / setting.actuator.input).powi(2),
    };
    let knots = shooting::solve(&problem, guess(&problem, &draw))?.rounded();
    let path = refine(&*setting.dynamics, &knots, ticks, setting.tick_s, &ends)?;
    within(&path, &draw.bounds).then_some((knots, path))
}

/// Initial guess: all links turn at constant rates, and the input is the one drawn.
fn guess(problem: &TrajectoryProblem<'_>, draw: &Draw) -> Knots {
    let (steps, turn) = (problem.steps, core::f64::consts::PI);
    let duration_s = steps as f64 * problem.knot_s;
    let mut knots = Knots { x: Vec::new(), u: Vec::new() };
    for knot in 0..=steps {
        let part = knot as f64 / steps as f64;
        let mut x: Vec<f64> =
            problem.start.iter().zip(&problem.end).map(|(a, b)| a + part * (b - a)).collect();
        if knot > 0 && knot < steps {
            for joint in (2..x.len()).step_by(2) {
                x[joint + 1] = (problem.end[joint] - problem.start[joint]) / duration_s;
            }
        }
        let wave = |(harmonic, share): (usize, &f64)| share * libm::sin(turn * part * (harmonic + 1) as f64);
        knots.x.push(x);
        knots.u.push(draw.bounds.input * draw.wobble.iter().enumerate().map(wave).sum::<f64>());
    }
    knots
}

/// `weight Σ φ̇_j²` in the relative rates.
fn rate_weights(setting: &Setting<'_>, weight: f64) -> Matrix<f64> {
    let (states, links) = (setting.rig.states(), setting.chain.links.len());
    Matrix::from_fn(states, states, |i, j| match (i % 2, j % 2) {
        (1, 1) if i > 1 && j > 1 => weight * (links + 1 - (i / 2).max(j / 2)) as f64,
        _ => 0.0,
    })
}

/// Whether the path keeps the bounds, except for the [`EXCESS`] that is allowed after a refinement.
pub(crate) fn within(path: &Path, bounds: &Bounds) -> bool {
    let limits = bounds.limits();
    path.x
        .iter()
        .zip(&path.u)
        .all(|(x, &u)| limits.iter().all(|limit| limit.room(x, u) >= -EXCESS * limit.bound))
}

/// Solves the candidates `numbers` on all threads, and returns the solved ones in the order of their numbers. `done`
/// is called after each, from any thread, with its score.
pub(crate) fn candidates(
    setting: &Setting<'_>,
    request: &SearchRanges,
    transition: Transition,
    numbers: core::ops::Range<u64>,
    done: &(dyn Fn(Option<f64>) + Sync),
) -> Result<Vec<MotionCandidate>, SwingUpError> {
    let one = |number: u64| -> Result<Option<MotionCandidate>, SwingUpError> {
        let Some((knots, path)) = solve(setting, request, transition, number) else {
            done(None);
            return Ok(None);
        };
        let motion = motion(setting, path, transition, RANKING_WEIGHT)?;
        let score = score(setting, &motion, transition, &request.spread)?;
        done(Some(score));
        Ok(Some(MotionCandidate { knots, motion, score }))
    };
    let all: Vec<_> = parallel::try_map(numbers, one)?;
    Ok(all.into_iter().flatten().collect())
}
