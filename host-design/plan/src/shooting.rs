//! Multiple shooting: Gauss-Newton steps on all knots at once, limits by an interior-point method.
//!
//! A step solves the linear-quadratic problem about the current knots, including the gaps between them. It is accepted
//! if, compared with each earlier iterate, it makes the gaps smaller or the cost lower (a filter: Fletcher & Leyffer,
//! *Mathematical Programming* 91, 2002). Gauss-Newton steps stall near feasibility; then the cost is dropped, and
//! damped Newton steps close the gaps.

use super::interior_point::Slacks;
use super::problem::{Knots, TrajectoryProblem};
use super::riccati::{Minimum, Stage, dot, minimise, times};
use upright_design::numerics::Matrix;

/// Gap at which a trajectory counts as solved, in the units of the states.
const CLOSED: f64 = 1e-7;
/// Largest number of steps with the cost, and without it.
const WITH_COST: usize = 80;
const FEASIBILITY_ONLY: usize = 60;
/// Number of Gauss-Newton steps with little gain after which the cost is dropped.
const SLOW: usize = 12;
/// Weight of the last state's distance from the end.
const END_WEIGHT: f64 = 1e8;

/// The current iterate.
struct Iterate {
    knots: Knots,
    slacks: Slacks,
    /// Multipliers of the conditions at the end.
    end: Vec<f64>,
    /// Barrier parameter.
    mu: f64,
}

/// Gaps: the largest, and the sum of all.
#[derive(Clone, Copy)]
struct Gaps {
    largest: f64,
    sum: f64,
}

/// An accepted iterate.
struct Accepted {
    next: Iterate,
    /// Its share of the full step.
    share: f64,
    gaps: Gaps,
    cost: f64,
}

/// Solves `problem` from a guess. None if the gaps do not close.
pub(crate) fn solve(problem: &TrajectoryProblem<'_>, guess: Knots) -> Option<Knots> {
    let mu = 1e-2 * problem.knot_s;
    let slacks = Slacks::new(&problem.limits, &guess, mu);
    let mut at = Iterate { knots: guess, slacks, end: vec![0.0; problem.end.len() + 1], mu };
    with_cost(problem, &mut at);
    feasibility_only(problem, &mut at);
    let gaps = gaps(problem, &at);
    (gaps.largest < CLOSED).then_some(at.knots)
}

/// Gauss-Newton with the cost, until it converges or stalls.
fn with_cost(problem: &TrajectoryProblem<'_>, at: &mut Iterate) {
    let mut filter: Vec<(f64, f64)> = Vec::new();
    let (mut damping, mut slow) = (1e-4, 0);
    let mut before = gaps(problem, at);
    for _ in 0..WITH_COST {
        let cost_before = cost(problem, at);
        if slow >= SLOW {
            return;
        }
        let Some(step) = newton(problem, at, Some(damping)) else { return };
        filter.push((before.sum, cost_before));
        let accepts = |gaps: Gaps, cost: f64| {
            filter.iter().all(|&(gap, earlier)| gaps.sum < 0.999 * gap || cost < earlier - 1e-3 * gap)
        };
        match search(problem, at, &step, &accepts) {
            Some(Accepted { next, share, gaps: after, cost }) => {
                let gain = (cost_before - cost) / cost_before.abs().max(1e-9);
                slow = if share < 0.1 || (gain.abs() < 1e-3 && after.sum > 0.9 * before.sum) {
                    slow + 1
                } else {
                    0
                };
                *at = next;
                damping = if share > 0.5 { damping * 0.3 } else { damping };
                for (multiplier, z) in at.end.iter_mut().zip(end_distance(problem, &at.knots)) {
                    *multiplier += END_WEIGHT * z;
                }
                at.mu = (0.3 * at.slacks.complementarity()).clamp(1e-6 * problem.knot_s, at.mu);
                if after.largest < CLOSED && gain.abs() < 1e-4 {
                    return;
                }
                before = after;
            }
            None => {
                filter.pop();
                damping *= 10.0;
                slow += 2;
            }
        }
    }
}

/// Damped Newton on the gaps alone: each step is the least change that closes them to first order.
fn feasibility_only(problem: &TrajectoryProblem<'_>, at: &mut Iterate) {
    at.mu = 1e-3 * problem.knot_s;
    let mut before = gaps(problem, at);
    for _ in 0..FEASIBILITY_ONLY {
        at.slacks = at.slacks.centred(at.mu);
        if before.largest < 0.1 * CLOSED {
            return;
        }
        let Some(step) = newton(problem, at, None) else { return };
        match search(problem, at, &step, &|gaps, _| gaps.sum < (1.0 - 1e-4) * before.sum) {
            Some(Accepted { next, gaps, .. }) => (*at, before) = (next, gaps),
            None => return,
        }
    }
}

/// The iterate after the first accepted share of the step.
fn search(
    problem: &TrajectoryProblem<'_>,
    at: &Iterate,
    step: &Minimum,
    accepts: &dyn Fn(Gaps, f64) -> bool,
) -> Option<Accepted> {
    let (slack_step, most_s, most_nu) = at.slacks.step(&problem.limits, &at.knots, &step.z, at.mu);
    let mut share = most_s;
    for _ in 0..10 {
        let next = Iterate {
            knots: moved(&at.knots, step, share),
            slacks: at.slacks.moved(&slack_step, share, most_nu),
            end: at.end.clone(),
            mu: at.mu,
        };
        let (gaps, cost) = (gaps(problem, &next), cost(problem, &next));
        if accepts(gaps, cost) {
            return Some(Accepted { next, share, gaps, cost });
        }
        share *= 0.5;
    }
    None
}

/// The full step: with a damping it lowers the cost, without one it is the least change that closes the gaps.
fn newton(problem: &TrajectoryProblem<'_>, at: &Iterate, damping: Option<f64>) -> Option<Minimum> {
    let (knots, h, s) = (&at.knots, problem.knot_s, problem.end.len());
    let weights = problem.state_weights.scaled(&(2.0 * h));
    let mut stages: Vec<Stage> = Vec::with_capacity(problem.steps + 1);
    for knot in 0..=problem.steps {
        let (x, u) = (&knots.x[knot], knots.u[knot]);
        let mut stage = stage_cost(problem, &weights, x, u, damping);
        if knot > 0 {
            // The least change needs no barrier that pushes away from the limits: approaching them only costs more.
            let mu = if damping.is_some() { at.mu } else { 0.0 };
            at.slacks.add_to(&problem.limits, knots, knot, mu, &mut stage);
        }
        if knot < problem.steps {
            let u_next = knots.u[knot + 1];
            let step = problem.dynamics.step_with_derivatives(x, [u, u_next], h);
            // z = [x; u], w = u̇: the force at the end of the step is u + h w.
            stage.a = Matrix::from_fn(s + 1, s + 1, |i, j| match (i == s, j == s) {
                (false, false) => step.by[(i, j)],
                (false, true) => step.by[(i, s)] + step.by[(i, s + 1)],
                (true, false) => 0.0,
                (true, true) => 1.0,
            });
            stage.b = (0..=s).map(|i| if i == s { h } else { h * step.by[(i, s + 1)] }).collect();
            let gap = step.end.iter().zip(&knots.x[knot + 1]).map(|(end, next)| end - next);
            stage.d = gap.chain([0.0]).collect();
            let rate = (u_next - u) / h;
            stage.r = 2.0 * h * problem.rate_weight;
            stage.r_linear = if damping.is_some() { stage.r * rate } else { 0.0 };
        }
        stages.push(stage);
    }
    let mut last = stages.pop()?;
    for (i, (distance, multiplier)) in end_distance(problem, knots).iter().zip(&at.end).enumerate() {
        last.q[(i, i)] += END_WEIGHT;
        last.q_linear[i] += END_WEIGHT * distance + if damping.is_some() { *multiplier } else { 0.0 };
    }
    minimise(&stages, &last.q, &last.q_linear)
}

/// Cost of one knot to second order, without the limits. `weights` are the second derivatives by the states.
fn stage_cost(
    problem: &TrajectoryProblem<'_>,
    weights: &Matrix<f64>,
    x: &[f64],
    u: f64,
    damping: Option<f64>,
) -> Stage {
    let (s, h) = (x.len(), problem.knot_s);
    let mut q = Matrix::zeros(s + 1, s + 1);
    let mut q_linear = vec![0.0; s + 1];
    match damping {
        Some(damping) => {
            q_linear[..s].copy_from_slice(&times(weights, x));
            q = q.with_block(0, 0, weights);
            q[(s, s)] = 2.0 * h * problem.input_weight;
            q_linear[s] = q[(s, s)] * u;
            for i in 0..s {
                q[(i, i)] += damping * h;
            }
        }
        None => {
            for i in 0..s {
                q[(i, i)] = 1e-3 * h;
            }
            q[(s, s)] = 2.0 * h * problem.input_weight;
        }
    }
    let (a, b, d) = (Matrix::zeros(0, 0), Vec::new(), Vec::new());
    Stage { q, q_linear, r: 0.0, r_linear: 0.0, a, b, d }
}

/// Difference of the last state and force from the end at rest, s + 1 entries.
fn end_distance(problem: &TrajectoryProblem<'_>, knots: &Knots) -> Vec<f64> {
    let last = knots.x[problem.steps].iter().zip(&problem.end).map(|(x, end)| x - end);
    last.chain([knots.u[problem.steps]]).collect()
}

fn moved(knots: &Knots, step: &Minimum, share: f64) -> Knots {
    let x = knots.x.iter().zip(&step.z);
    let u = knots.u.iter().zip(&step.z);
    Knots {
        x: x.map(|(x, z)| x.iter().zip(z).map(|(x, z)| x + share * z).collect()).collect(),
        u: u.map(|(u, z)| u + share * z[z.len() - 1]).collect(),
    }
}

fn gaps(problem: &TrajectoryProblem<'_>, at: &Iterate) -> Gaps {
    let (mut largest, mut sum) = (0.0f64, 0.0f64);
    let mut take = |gap: f64| {
        largest = largest.max(gap.abs());
        sum += gap.abs();
    };
    let mut end = problem.end.clone();
    for knot in 0..problem.steps {
        end.copy_from_slice(&at.knots.x[knot]);
        problem.dynamics.step(&mut end, [at.knots.u[knot], at.knots.u[knot + 1]], problem.knot_s);
        end.iter().zip(&at.knots.x[knot + 1]).for_each(|(end, next)| take(end - next));
    }
    end_distance(problem, &at.knots).into_iter().for_each(&mut take);
    take(at.slacks.infeasibility(&problem.limits, &at.knots));
    // NaN counts as an infinite gap.
    if sum.is_nan() { Gaps { largest: f64::INFINITY, sum: f64::INFINITY } } else { Gaps { largest, sum } }
}

fn cost(problem: &TrajectoryProblem<'_>, at: &Iterate) -> f64 {
    let (knots, h) = (&at.knots, problem.knot_s);
    let mut sum = at.mu * at.slacks.barrier();
    for (knot, (x, &u)) in knots.x.iter().zip(&knots.u).enumerate() {
        let of_states: f64 =
            x.iter().zip(problem.state_weights.row_slices()).map(|(x_i, row)| x_i * dot(row, x)).sum();
        sum += h * (of_states + problem.input_weight * u * u);
        if let Some(next) = knots.u.get(knot + 1) {
            let rate = (next - u) / h;
            sum += h * problem.rate_weight * rate * rate;
        }
    }
    sum
}
