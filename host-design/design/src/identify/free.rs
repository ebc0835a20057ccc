//! Identification of a machine that swings freely: multiple shooting alone, with deviations from left-out parts.
//!
//! Without a drive, a common factor of all masses and frictions changes no motion: the first moment of the last link is
//! that of the file. With a clamped cart, nothing is seen of the cart, and a tilt of the rail looks like a common zero.

use super::model::Model;
use super::parameters::{Layout, Prior};
use super::record::Record;
use super::shooting::Shooting;

/// Length of a window (s).
const WINDOW_S: f64 = 0.5;
/// Iterations of a fit after each estimate of the weights, and number of these.
const ITERATIONS: (usize, usize) = (12, 3);
/// Number of parts, each of which is left out once.
const PARTS: usize = 5;
/// Drag of a link as a multiple of its moment of inertia (1/rad²): measured ones are 0.004 to 0.006.
const USUAL_DRAG: f64 = 0.005;
/// Prior deviation of a drag, as a multiple of the usual one.
const DRAG: f64 = 10.0;

/// The result of a fit of free swings.
pub(super) struct Found {
    pub(super) model: Model,
    pub(super) p: Vec<f64>,
    /// Standard deviation of each parameter.
    pub(super) deviations: Vec<f64>,
    /// Inverse of the scaled normal matrix, row by row.
    pub(super) inverse: Option<Vec<f64>>,
    /// Parameters from the first and from the second half of the record.
    pub(super) halves: [Vec<f64>; 2],
    /// Each part of the record, with the parameters that were found without it.
    pub(super) left_out: Vec<(Record, Vec<f64>)>,
    /// Root mean square of the residuals of each channel in the windows (m, rad).
    pub(super) residuals: Vec<f64>,
}

/// Fixes what free swings do not show, and frees the drag of the links.
pub(super) fn known(layout: Layout, priors: &mut [Prior], is_clamped: bool) {
    let mut fixed = vec![layout.first_moment(layout.links - 1), layout.delay(), layout.dead_zone()];
    if is_clamped {
        fixed.extend([Layout::TOTAL_MASS, layout.viscous(0), layout.dry(0), layout.tilt()]);
    }
    fixed.into_iter().for_each(|index| priors[index].deviation = 0.0);
    for link in 0..layout.links {
        let usual = USUAL_DRAG * priors[layout.second_moment(link)].value;
        priors[layout.drag(link)] = Prior { value: 0.0, deviation: DRAG * usual };
    }
}

/// Fits `record` from the values of `priors`.
pub(super) fn fit(model: &Model, record: &Record, priors: &[Prior], step: &(dyn Fn() + Sync)) -> Found {
    let start: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
    let shoot = |model: &Model, record: &Record, from: &[f64]| {
        let shooting = Shooting { model, record, priors, free: true };
        let found = shooting.fit_settled(from, WINDOW_S, ITERATIONS.0, ITERATIONS.1);
        step();
        found
    };
    let whole = shoot(model, record, &start);
    let seconds = record.seconds();
    let cut = |from: f64, to: f64| record.part(from * seconds, to * seconds);
    let share = |part: usize| part as f64 / PARTS as f64;
    let without: Vec<Record> =
        (0..PARTS).map(|part| cut(0.0, share(part)).with(cut(share(part + 1), 1.0))).collect();
    let left_out: Vec<(Record, Vec<f64>)> = without
        .iter()
        .enumerate()
        .map(|(part, others)| (cut(share(part), share(part + 1)), shoot(model, others, &whole.p).p))
        .collect();
    let halves = [[0.0, 0.5], [0.5, 1.0]].map(|[from, to]| shoot(model, &cut(from, to), &whole.p).p);
    let inverse = Shooting { model, record, priors, free: true }.inverse(&whole);
    let size = whole.p.len();
    let deviation = |i: usize| {
        let statistical =
            inverse.as_ref().map_or(0.0, |inverse| priors[i].deviation * inverse[i * size + i].sqrt());
        let parts: Vec<f64> = left_out.iter().map(|(_, p)| p[i]).collect();
        statistical.hypot(jackknife(&parts))
    };
    Found {
        model: model.clone(),
        deviations: (0..size).map(deviation).collect(),
        inverse,
        halves,
        left_out,
        residuals: whole.rms.clone(),
        p: whole.p,
    }
}

/// Standard deviation of an estimate, from its values without one part of the data each (B. Efron, C. Stein, "The
/// jackknife estimate of variance", Annals of Statistics 9(3), 1981).
fn jackknife(without: &[f64]) -> f64 {
    let count = without.len() as f64;
    let mean = without.iter().sum::<f64>() / count;
    let squares: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
    ((count - 1.0) / count * squares).sqrt()
}
