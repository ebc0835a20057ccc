//! Refines a trajectory at knots to one at ticks, with the force held over each tick.

use super::dynamics::Dynamics;
use super::hold::{after_tick, tick};
use super::problem::Knots;
use super::riccati::{Stage, minimise};
use upright_design::numerics::Matrix;

/// States at the ticks (steps + 1) and held forces (steps).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Path {
    pub(crate) x: Vec<Vec<f64>>,
    pub(crate) u: Vec<f64>,
}

/// Largest number of Newton steps.
const STEPS: usize = 12;
/// Largest gap of a refined path, in the units of the states.
pub(crate) const GAP: f64 = 2e-8;
/// Weight of the last state's distance from the end.
const END_WEIGHT: f64 = 1e8;
/// Largest change of a position by the refinement (m, rad).
const MOVED: f64 = 0.05;

/// The path at ticks, with `ticks` of them between two knots. Each Newton step is the least change that closes the
/// gaps to first order. None if the gaps stay above [`GAP`], or a position moves too far from its knot.
pub(crate) fn refine(
    dynamics: &dyn Dynamics,
    knots: &Knots,
    ticks: usize,
    tick_s: f64,
    [start, end]: &[Vec<f64>; 2],
) -> Option<Path> {
    let mut path = Path { x: Vec::new(), u: Vec::new() };
    for (x, ends) in knots.x.iter().zip(knots.u.windows(2)) {
        let mut state = x.clone();
        for i in 0..ticks {
            let force = ends[0] + (ends[1] - ends[0]) * (i as f64 + 0.5) / ticks as f64;
            path.u.push(force);
            path.x.push(state.clone());
            after_tick(dynamics, &mut state, force, tick_s);
        }
    }
    path.x.push(end.clone());
    path.x[0].clone_from(start);
    let path = close(dynamics, path, tick_s)?;
    let at_knots = path.x.iter().step_by(ticks);
    is_near(knots, at_knots.map(Vec::as_slice)).then_some(path)
}

/// Whether the positions of a refined path are still near those of its knots: from knots of another spacing or of
/// another rig, Newton steps may lead to quite another motion.
fn is_near<'a>(knots: &Knots, path: impl Iterator<Item = &'a [f64]>) -> bool {
    let near = |(knot, x): (&Vec<f64>, &[f64])| {
        knot.iter().zip(x).step_by(2).all(|(knot, x)| (knot - x).abs() < MOVED)
    };
    knots.x.iter().zip(path).all(near)
}

/// Closes the gaps of a path and keeps its first and last states. None if they stay above [`GAP`].
pub(crate) fn close(dynamics: &dyn Dynamics, mut path: Path, tick_s: f64) -> Option<Path> {
    let end = path.x[path.u.len()].clone();
    let mut gap = largest_gap(dynamics, &path, tick_s);
    for _ in 0..STEPS {
        if gap < 0.1 * GAP {
            break;
        }
        let step = newton(dynamics, &path, tick_s)?;
        let mut share = 1.0;
        (path, gap) = loop {
            let next = moved(&path, &step, share);
            let after = largest_gap(dynamics, &next, tick_s);
            if after < gap {
                break (next, after);
            }
            share *= 0.5;
            if share < 1e-3 {
                return (gap < GAP).then_some(path);
            }
        };
    }
    // The remaining distance to the end is far below [`GAP`].
    let last = path.u.len();
    path.x[last] = end;
    (largest_gap(dynamics, &path, tick_s) < GAP).then_some(path)
}

fn newton(dynamics: &dyn Dynamics, path: &Path, tick_s: f64) -> Option<super::riccati::Minimum> {
    let s = path.x[0].len();
    let stages: Vec<Stage> = path
        .x
        .iter()
        .zip(&path.u)
        .zip(&path.x[1..])
        .map(|((x, &u), next)| {
            let tick = tick(dynamics, x, u, tick_s);
            Stage {
                q: Matrix::identity(s).scaled(&1e-6),
                q_linear: vec![0.0; s],
                r: 1.0,
                r_linear: 0.0,
                a: tick.a(),
                b: tick.b(),
                d: tick.end.iter().zip(next).map(|(end, next)| end - next).collect(),
            }
        })
        .collect();
    minimise(&stages, &Matrix::identity(s).scaled(&END_WEIGHT), &vec![0.0; s])
}

fn moved(path: &Path, step: &super::riccati::Minimum, share: f64) -> Path {
    let plus = |x: &f64, z: &f64| x + share * z;
    Path {
        x: path
            .x
            .iter()
            .zip(&step.z)
            .map(|(x, z)| x.iter().zip(z).map(|(x, z)| plus(x, z)).collect())
            .collect(),
        u: path.u.iter().zip(&step.w).map(|(u, w)| plus(u, w)).collect(),
    }
}

/// Largest gap: difference between a state and the end of the tick before it.
pub(crate) fn largest_gap(dynamics: &dyn Dynamics, path: &Path, tick_s: f64) -> f64 {
    let mut largest: f64 = 0.0;
    let mut end = vec![0.0; path.x[0].len()];
    for ((x, &u), next) in path.x.iter().zip(&path.u).zip(&path.x[1..]) {
        end.copy_from_slice(x);
        after_tick(dynamics, &mut end, u, tick_s);
        for (end, next) in end.iter().zip(next) {
            let gap = (end - next).abs();
            largest = if gap.is_nan() { f64::INFINITY } else { largest.max(gap) };
        }
    }
    largest
}
