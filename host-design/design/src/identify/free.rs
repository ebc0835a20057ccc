//! Identification of a machine that swings freely: multiple shooting alone, with deviations from left-out parts.
//!
//! Without a drive, a common factor of all masses and frictions changes no motion: the first moment of the last link is
//! that of the file. With a clamped cart, nothing is seen of the cart, and a tilt of the rail looks like a common zero.

use super::error::IdentifyError;
use super::estimated::{Estimate, Identification};
use super::model::Model;
use super::old_values::old_values;
use super::parameters::{Layout, Prior};
use super::record::Record;
use super::shooting::Shooting;
use super::window_errors::{Predicting, window_errors};
use crate::rig::Rig;

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
pub(super) struct FreeFit {
    pub(super) p: Vec<f64>,
    /// Standard deviation of each parameter.
    deviations: Vec<f64>,
    /// Inverse of the scaled normal matrix, row by row.
    inverse: Vec<f64>,
    /// Parameters from the first and from the second half of the record.
    halves: [Vec<f64>; 2],
    /// Each part of the record, with the parameters that were found without it.
    left_out: Vec<(Record, Vec<f64>)>,
}

/// Number of fits: the whole, without each part, and each half.
pub(super) const FITS: u64 = 3 + PARTS as u64;

impl FreeFit {
    /// Writes estimates, correlations and errors of predictions into `found`.
    pub(super) fn write(&self, rig: &Rig, model: &Model, priors: &[Prior], found: &mut Identification) {
        let (size, kinds) = (self.p.len(), model.layout.kinds());
        let active: Vec<usize> = (0..size).filter(|&i| priors[i].deviation > 0.0).collect();
        let estimate = |&i: &usize| Estimate {
            kind: kinds[i],
            old: priors[i].value,
            new: self.p[i],
            deviation: self.deviations[i],
            halves: Some([self.halves[0][i], self.halves[1][i]]),
            held_by_prior: self.deviations[i] > 0.5 * priors[i].deviation,
        };
        found.estimates = active.iter().map(estimate).collect();
        let entry = |i: usize, j: usize| self.inverse[i * size + j];
        let correlation = |i: usize, j: usize| entry(i, j) / (entry(i, i) * entry(j, j)).sqrt();
        found.correlations =
            active.iter().flat_map(|&i| active.iter().map(move |&j| correlation(i, j))).collect();
        let start: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
        let old: Vec<Vec<f64>> =
            self.left_out.iter().map(|(_, p)| old_values(rig, model.layout, &start, p)).collect();
        let parts: Vec<Predicting<'_>> = self
            .left_out
            .iter()
            .zip(&old)
            .map(|((part, p), old)| (part, [old.as_slice(), p.as_slice()]))
            .collect();
        found.left_out = window_errors(model, priors, &parts);
    }
}

/// Fixes what free swings do not show at the values of the file, and frees the drag of the links.
pub(super) fn known(rig: &Rig, layout: Layout, priors: &mut [Prior], is_clamped: bool) {
    let mut fixed = vec![layout.first_moment(layout.links - 1), layout.delay(), layout.dead_zone()];
    if is_clamped {
        fixed.extend([Layout::TOTAL_MASS, layout.viscous(0), layout.dry(0), layout.tilt()]);
        priors[layout.dry(0)].value = rig.reality.friction.cart_friction_n;
        priors[layout.tilt()].value = rig.reality.sensors.rail_tilt_rad;
    }
    fixed.into_iter().for_each(|index| priors[index].deviation = 0.0);
    for link in 0..layout.links {
        let usual = USUAL_DRAG * priors[layout.second_moment(link)].value;
        priors[layout.drag(link)] = Prior { value: 0.0, deviation: DRAG * usual };
    }
}

/// Fits `record` from the values of `priors`.
pub(super) fn fit(
    model: &Model,
    record: &Record,
    priors: &[Prior],
    step: &dyn Fn(),
) -> Result<FreeFit, IdentifyError> {
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
    let undetermined = || IdentifyError::Undetermined("the equations have no solution");
    let shooting = Shooting { model, record, priors, free: true };
    let inverse = shooting.inverse(&whole).ok_or_else(undetermined)?;
    let size = whole.p.len();
    let deviation = |i: usize| {
        let statistical = priors[i].deviation * inverse[i * size + i].sqrt();
        let parts: Vec<f64> = left_out.iter().map(|(_, p)| p[i]).collect();
        let half = 0.5 * (halves[0][i] - halves[1][i]).abs();
        statistical.hypot(jackknife(&parts)).max(half)
    };
    Ok(FreeFit { deviations: (0..size).map(deviation).collect(), inverse, halves, left_out, p: whole.p })
}

/// Standard deviation of an estimate, from its values without one part of the data each (B. Efron, C. Stein, "The
/// jackknife estimate of variance", Annals of Statistics 9(3), 1981).
fn jackknife(without: &[f64]) -> f64 {
    let count = without.len() as f64;
    let mean = without.iter().sum::<f64>() / count;
    let squares: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
    ((count - 1.0) / count * squares).sqrt()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::model::CartForce;
    use super::super::parameters::priors;
    use super::super::step::Step;
    use super::super::table::RecordingRows;
    use super::*;

    /// 24 s of a clamped double pendulum that swings down from 100°, in counts, and its true parameters. Its lengths
    /// and moments are not those of the file.
    fn swing(rig: &Rig, priors: &[Prior]) -> (Record, Vec<f64>) {
        let mut p: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
        let layout = Layout { links: 2 };
        (p[layout.length(0)], p[layout.first_moment(0)]) =
            (0.9 * p[layout.length(0)], 1.1 * p[layout.first_moment(0)]);
        (p[layout.dry(1)], p[layout.dry(2)]) = (5e-4, 3e-4);
        (p[layout.viscous(1)], p[layout.viscous(2)]) = (2e-4, 0.0);
        (p[layout.drag(0)], p[layout.drag(1)]) = (0.0, 0.004 * p[layout.second_moment(1)]);
        let mut model = Record::of_rows(rig, Vec::new(), false, true).model(9.81);
        model.smoothing[1] = 0.01;
        let mut step = Step::new(&model, false);
        let mut state = vec![0.0, 1.4, 2.6, 0.0, 0.0, 0.0, 0.0];
        let counts: Vec<f64> = rig.sensors().iter().map(|sensor| sensor.step()).collect();
        let mut rows = RecordingRows { period_s: 0.002, y: Vec::new(), drive: vec![None; 12_000] };
        for _ in 0..rows.drive.len() {
            rows.y.extend((0..3).map(|channel| {
                let value = model.measure(&p, &state, channel).value;
                counts[channel] * (value / counts[channel]).round()
            }));
            for _ in 0..4 {
                step.take(&model, &p, &state, &CartForce::default(), 0.0005);
                state.copy_from_slice(&step.end);
            }
        }
        (Record::of_rows(rig, vec![rows], false, true), p)
    }

    #[test]
    fn drag_and_friction_of_free_swings_are_told_apart() {
        let rig = Rig::from_path(Path::new("../../rigs/double-quanser-dbpen.toml")).unwrap();
        let chain = rig.chain().unwrap();
        let layout = Layout { links: 2 };
        let mut priors = priors(&rig, chain, false);
        known(&rig, layout, &mut priors, true);
        let (record, truth) = swing(&rig, &priors);
        let model = record.model(9.81);
        let found = fit(&model, &record, &priors, &|| ()).unwrap();
        let near = |index: usize, most: f64| {
            let error = (found.p[index] - truth[index]).abs();
            assert!(error < most, "{index}: {} instead of {}", found.p[index], truth[index]);
        };
        near(layout.length(0), 1e-3 * truth[layout.length(0)]);
        near(layout.first_moment(0), 1e-3 * truth[layout.first_moment(0)]);
        near(layout.drag(1), 0.1 * truth[layout.drag(1)]);
        near(layout.dry(1), 0.1 * truth[layout.dry(1)]);
        near(layout.dry(2), 0.1 * truth[layout.dry(2)]);
        for index in (0..found.p.len()).filter(|&index| layout.is_dissipative(index)) {
            assert!(found.p[index] >= 0.0, "{index}: {}", found.p[index]);
        }
        // The negative control: without drag in the model, the friction of a joint is wrong by far more than 10 %.
        (0..2).for_each(|link| priors[layout.drag(link)].deviation = 0.0);
        let start: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
        let without = Shooting { model: &model, record: &record, priors: &priors, free: true }.fit_settled(
            &start,
            WINDOW_S,
            ITERATIONS.0,
            ITERATIONS.1,
        );
        let error = |index: usize| (without.p[index] / truth[index] - 1.0).abs();
        let worst = error(layout.dry(1)).max(error(layout.dry(2))).max(error(layout.viscous(1)));
        assert!(worst > 0.3, "{worst}");
    }
}
