//! Identification of a machine that swings freely: multiple shooting alone, with deviations from left-out parts.
//!
//! Without a drive, a common factor of all masses and frictions changes no motion: the first moment of the last link is
//! that of the file. With a clamped cart, nothing is seen of the cart, and a tilt of the rail looks like a common zero.
//!
//! Dry friction is a bristle whose length is found, too, so that a link that comes to rest stays there. No friction can
//! be negative: one that would be is 0, and the others are fitted again with it (active set). A term is also 0 if -2 ln
//! L rises by less than ln N without it, with N windows (the Bayesian information criterion).
//!
//! All recordings are fitted, then all but one fifth, for each fifth, and then each half. A deviation is the largest of
//! three: from the scatter between the windows (residuals within a window depend on each other), from the spread of the
//! fits without a fifth, and half of the difference between both halves. The noise of an encoder shows in fourth
//! differences, in which smooth motion vanishes.

use upright_design::rig::Rig;

use crate::channel::channel_name;
use crate::doubt::Doubt;
use crate::error::IdentifyError;
use crate::estimated::{Estimate, Identification};
use crate::model::Model;
use crate::old_values::old_values;
use crate::parameters::{Layout, ParameterKind, Prior};
use crate::record::Record;
use crate::shooting::{Fit, Scatter, Shooting};
use crate::suspect;
use crate::window_errors::{Predicting, window_errors};

/// Length of a window (s).
const WINDOW_S: f64 = 0.5;
/// Iterations of a fit after each estimate of the weights, and number of these.
const ITERATIONS: (usize, usize) = (12, 3);
/// Number of parts, each of which is left out once.
const PARTS: usize = 5;
/// Prior deviation of a presliding, as a multiple of the usual one.
const PRESLIDING: f64 = 2.0;
/// Least difference between the halves, in its deviations, that is named.
const CONTRADICTION: f64 = 4.0;
/// Least residuals that are named, as a multiple of what the sensor allows.
const COARSE: f64 = 5.0;
/// Least residuals that are named, in percent of the motion: sound recordings with a fine encoder have up to 0.05.
const COARSE_PERCENT: f64 = 0.1;

/// The result of a fit of free swings.
pub(crate) struct FreeFit {
    pub(crate) p: Vec<f64>,
    /// Standard deviation of each parameter.
    deviations: Vec<f64>,
    /// Inverse of the scaled normal matrix, row by row.
    inverse: Vec<f64>,
    /// Parameters without the bounds.
    unbounded: Vec<f64>,
    /// Parameters from the first and from the second half of the record.
    halves: [Vec<f64>; 2],
    /// Each part of the record, with the parameters that were found without it.
    left_out: Vec<(Record, Vec<f64>)>,
    doubts: Vec<Doubt>,
}

/// Number of fits: with all terms of friction, without those left out on request, with those that the record wants,
/// without each part, and each half.
pub(crate) const FITS: u64 = 5 + PARTS as u64;

impl FreeFit {
    /// Writes estimates, correlations, doubts and errors of predictions into `found`.
    pub(crate) fn write(&self, rig: &Rig, model: &Model, priors: &[Prior], found: &mut Identification) {
        let (size, kinds) = (self.p.len(), model.layout.kinds());
        // Without dry friction there is no bristle.
        let layout = model.layout;
        let is_bare = |i: usize| {
            (0..layout.links).any(|j| i == layout.presliding(j) && self.p[layout.dry(j + 1)] == 0.0)
        };
        let active: Vec<usize> = (0..size).filter(|&i| priors[i].deviation > 0.0 && !is_bare(i)).collect();
        let estimate = |&i: &usize| {
            let of_file = kinds[i].of_file();
            Estimate {
                kind: kinds[i],
                old: of_file * priors[i].value,
                new: of_file * self.p[i],
                deviation: of_file * self.deviations[i],
                halves: Some([0, 1].map(|half: usize| of_file * self.halves[half][i])),
                held_by_prior: self.deviations[i] > 0.5 * priors[i].deviation,
            }
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
        found.doubts.clone_from(&self.doubts);
        found.doubts.extend(suspect::values(layout, priors, &found.estimates, &self.unbounded));
    }

    /// Doubts the parameters `written`, those of the new file, if they predict worse than the old file or than those
    /// that were found.
    pub(crate) fn compare(
        &self,
        model: &Model,
        record: &Record,
        priors: &[Prior],
        written: &[f64],
        found: &mut Identification,
    ) {
        let errors = &window_errors(model, priors, &[(record, [&self.p, written])])[0];
        let first = record.first_channel();
        let mut rms = [(); 3].map(|()| vec![0.0; record.channels]);
        let mut ranges = vec![1.0; record.channels];
        for (index, channel) in errors.channels.iter().enumerate() {
            // Parts that were left out show best whether the old file is better.
            let gain = channel.errors[0] / found.left_out[0].channels[index].errors[1];
            rms[0][first + index] = gain * found.left_out[0].channels[index].errors[0];
            [rms[1][first + index], rms[2][first + index]] = channel.errors;
            ranges[first + index] = channel.range;
        }
        let [old, new, written] = &rms;
        found.doubts.extend(suspect::predictions(record, &ranges, [old, new, written]));
    }
}

/// Fixes what free swings do not show at the values of the file, and frees the presliding of the joints.
pub(crate) fn known(rig: &Rig, layout: Layout, priors: &mut [Prior], is_clamped: bool) {
    let mut fixed = vec![layout.first_moment(layout.links - 1), layout.delay(), layout.dead_zone()];
    if is_clamped {
        fixed.extend([Layout::TOTAL_MASS, layout.viscous(0), layout.dry(0), layout.tilt(), layout.travel()]);
        priors[layout.dry(0)].value = rig.reality.friction.cart_friction_n;
        priors[layout.tilt()].value = rig.reality.sensors.rail_tilt_rad;
    }
    fixed.into_iter().for_each(|index| priors[index].deviation = 0.0);
    for link in 0..layout.links {
        let presliding = &mut priors[layout.presliding(link)];
        presliding.deviation = PRESLIDING * presliding.value;
    }
}

/// A fit of a part of the record.
struct FittedPart {
    fit: Fit,
    /// Standard deviations, as of the scatter between the windows.
    deviations: Vec<f64>,
    /// The same, with what parameters at their bounds may be.
    open: Vec<f64>,
    inverse: Vec<f64>,
    /// Parameters without the bounds.
    unbounded: Vec<f64>,
}

impl FittedPart {
    fn fit(model: &Model, record: &Record, priors: &[Prior], from: &[f64]) -> Result<Self, IdentifyError> {
        let shooting = Shooting { model, record, priors, free: true };
        let fit = shooting.fit_settled(from, WINDOW_S, ITERATIONS.0, ITERATIONS.1);
        let undetermined = IdentifyError::Undetermined("the equations have no solution");
        let Scatter { inverse, deviations, open, normal } = shooting.scatter(&fit).ok_or(undetermined)?;
        let unscaled = |scaled: Vec<f64>| {
            scaled.into_iter().zip(priors).map(|(scaled, prior)| scaled * prior.deviation).collect()
        };
        let unbounded = suspect::unbounded(model.layout, priors, &normal, &fit.p);
        Ok(Self { fit, deviations: unscaled(deviations), open: unscaled(open), inverse, unbounded })
    }

    /// By how much -2 ln L would rise without a term of friction, to second order.
    fn worth(&self, index: usize) -> f64 {
        if self.fit.p[index] <= 0.0 { 0.0 } else { (self.fit.p[index] / self.deviations[index]).powi(2) }
    }
}

/// Fits `record` from the values of `priors`, without the terms of friction that it does not want, and those that are
/// left out on request.
pub(crate) fn fit(
    model: &Model,
    record: &Record,
    priors: &[Prior],
    is_left_out: &dyn Fn(ParameterKind) -> bool,
    step: &dyn Fn(),
) -> Result<FreeFit, IdentifyError> {
    let shoot = |record: &Record, priors: &[Prior], from: &[f64]| {
        step();
        FittedPart::fit(model, record, priors, from)
    };
    let kinds = model.layout.kinds();
    let start: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
    let all = shoot(record, priors, &start)?;
    // What a parameter costs by the Bayesian information criterion (G. Schwarz, Annals of Statistics 6, 1978).
    let cost = (record.seconds() / WINDOW_S).ln();
    let doubted = |&(i, kind): &(usize, &ParameterKind)| is_left_out(*kind) && all.worth(i) > cost;
    let doubts = kinds.iter().enumerate().filter(doubted);
    let mut doubts: Vec<Doubt> =
        doubts.map(|(i, &kind)| Doubt::LeftOut { kind, worth: all.worth(i) }).collect();
    let asked = without(model.layout, priors, |i| is_left_out(kinds[i]));
    let rest = shoot(record, &asked, &values(&asked, &all.fit.p))?;
    let wanted = without(model.layout, &asked, |i| rest.worth(i) <= cost);
    let whole = shoot(record, &wanted, &values(&wanted, &rest.fit.p))?;
    let p = whole.fit.p.clone();
    let seconds = record.seconds();
    let cut = |from: f64, to: f64| record.part(from * seconds, to * seconds);
    let share = |part: usize| part as f64 / PARTS as f64;
    let others = |part: usize| cut(0.0, share(part)).with(cut(share(part + 1), 1.0));
    let one = |part: usize| Ok((cut(share(part), share(part + 1)), shoot(&others(part), &wanted, &p)?.fit.p));
    let left_out = (0..PARTS).map(one).collect::<Result<Vec<_>, IdentifyError>>()?;
    let half = |from: f64, to: f64| shoot(&cut(from, to), &wanted, &p);
    let halves = [half(0.0, 0.5)?, half(0.5, 1.0)?];
    doubts.extend(contradictions(&kinds, &halves));
    doubts.extend(coarse(record, &whole.fit.rms));
    let is_dropped = |i: usize| wanted[i].deviation == 0.0 && asked[i].deviation > 0.0;
    let has_dropped = (0..p.len()).any(is_dropped);
    let deviation = |i: usize| {
        let parts: Vec<f64> = left_out.iter().map(|(_, p)| p[i]).collect();
        let half = 0.5 * (halves[0].fit.p[i] - halves[1].fit.p[i]).abs();
        let is_off = wanted[i].deviation == 0.0 && priors[i].deviation > 0.0;
        // A term that was left out may be there after all, and then the others are those of the fit with it.
        let off = if has_dropped || is_off { all.open[i].hypot(all.fit.p[i] - p[i]) } else { 0.0 };
        whole.deviations[i].max(jackknife(&parts)).max(half).max(off)
    };
    Ok(FreeFit {
        deviations: (0..p.len()).map(deviation).collect(),
        unbounded: whole.unbounded,
        halves: halves.map(|half| half.fit.p),
        inverse: whole.inverse,
        left_out,
        doubts,
        p,
    })
}

/// The priors without the terms of friction that are `unwanted`; a joint without dry friction has no bristle.
fn without(layout: Layout, priors: &[Prior], unwanted: impl Fn(usize) -> bool) -> Vec<Prior> {
    let mut wanted = priors.to_vec();
    for index in (0..priors.len()).filter(|&index| layout.is_dissipative(index) && unwanted(index)) {
        wanted[index] = Prior { value: 0.0, deviation: 0.0 };
    }
    for joint in 0..layout.links {
        if wanted[layout.dry(joint + 1)].deviation == 0.0 {
            wanted[layout.presliding(joint)].deviation = 0.0;
        }
    }
    wanted
}

/// Start values: `p`, but the values of the priors where these are fixed.
fn values(priors: &[Prior], p: &[f64]) -> Vec<f64> {
    priors.iter().zip(p).map(|(prior, &p)| if prior.deviation > 0.0 { p } else { prior.value }).collect()
}

/// Parameters whose halves contradict each other.
fn contradictions(kinds: &[ParameterKind], halves: &[FittedPart; 2]) -> Option<Doubt> {
    let deviations = |i: usize| {
        let difference = (halves[0].fit.p[i] - halves[1].fit.p[i]).abs();
        difference / halves[0].deviations[i].hypot(halves[1].deviations[i])
    };
    let differ: Vec<usize> = (0..kinds.len()).filter(|&i| deviations(i) > CONTRADICTION).collect();
    let largest = differ.iter().map(|&i| deviations(i)).fold(0.0, f64::max);
    let kinds = differ.iter().map(|&i| kinds[i]).collect();
    (largest > 0.0).then_some(Doubt::Halves { kinds, deviations: largest })
}

/// Channels whose residuals `rms` are far above what their sensor allows.
fn coarse(record: &Record, rms: &[f64]) -> Vec<Doubt> {
    let one = |channel: usize| {
        let allowed = record.sensor_error(channel);
        let times = rms[channel] / allowed;
        let percent = 100.0 * rms[channel] / record.extent(channel)[1];
        (times > COARSE && percent > COARSE_PERCENT).then(|| Doubt::Residual {
            channel: channel_name(channel),
            allowed,
            times,
            percent,
        })
    };
    (record.first_channel()..record.channels).filter_map(one).collect()
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

    use super::*;
    use crate::cart_force::CartForce;
    use crate::parameters::priors;
    use crate::step::Step;
    use crate::table::RecordingRows;

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
        let mut rows =
            RecordingRows { period_s: 0.002, drive: vec![None; 12_000], ..RecordingRows::default() };
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
        let model = Model { has_bristles: true, ..record.model(9.81) };
        let found = fit(&model, &record, &priors, &|_| false, &|| ()).unwrap();
        let near = |index: usize, most: f64| {
            let error = (found.p[index] - truth[index]).abs();
            assert!(error < most, "{index}: {} instead of {}", found.p[index], truth[index]);
        };
        near(layout.length(0), 1e-3 * truth[layout.length(0)]);
        near(layout.first_moment(0), 1e-3 * truth[layout.first_moment(0)]);
        near(layout.drag(1), 0.1 * truth[layout.drag(1)]);
        near(layout.dry(1), 0.1 * truth[layout.dry(1)]);
        near(layout.dry(2), 0.1 * truth[layout.dry(2)]);
        // What the machine does not have is switched off, or as good as.
        assert!(found.p[layout.drag(0)] == 0.0 && found.p[layout.viscous(2)] < 1e-6, "{:?}", found.p);
        let left_out = |doubts: &[Doubt], wanted: ParameterKind| {
            doubts.iter().any(|doubt| matches!(doubt, Doubt::LeftOut { kind, .. } if *kind == wanted))
        };
        assert!(
            !found.doubts.iter().any(|doubt| matches!(doubt, Doubt::LeftOut { .. })),
            "{:?}",
            found.doubts
        );
        // The negative controls: without drag, the friction of a joint is wrong by far more than 10 %, and this is
        // said; so it is without dry friction.
        let drag = |kind| matches!(kind, ParameterKind::AirDrag(_));
        let without = fit(&model, &record, &priors, &drag, &|| ()).unwrap();
        let error = |index: usize| (without.p[index] / truth[index] - 1.0).abs();
        let worst = error(layout.dry(1)).max(error(layout.dry(2))).max(error(layout.viscous(1)));
        assert!(worst > 0.3, "{worst}");
        assert!(left_out(&without.doubts, ParameterKind::AirDrag(1)), "{:?}", without.doubts);
        let dry = |kind| matches!(kind, ParameterKind::JointDry(_));
        let without = fit(&model, &record, &priors, &dry, &|| ()).unwrap();
        assert!(left_out(&without.doubts, ParameterKind::JointDry(0)), "{:?}", without.doubts);
    }

    /// Small swings hardly show air drag; without it, dry friction takes its place.
    #[test]
    fn a_term_that_is_left_out_widens_the_deviations_of_the_others() {
        let rig = Rig::from_path(Path::new("../../rigs/double-quanser-dbpen.toml")).unwrap();
        let layout = Layout { links: 2 };
        let mut priors = priors(&rig, rig.chain().unwrap(), false);
        known(&rig, layout, &mut priors, true);
        let (record, truth) = swing(&rig, &priors);
        // The end of the decay.
        let record = record.part(14.0, 24.0);
        let model = Model { has_bristles: true, ..record.model(9.81) };
        let found = fit(&model, &record, &priors, &|_| false, &|| ()).unwrap();
        let (mut dropped, mut furthest) = (0, 0.0f64);
        for index in (0..truth.len()).filter(|&index| layout.is_dissipative(index)) {
            dropped += usize::from(found.p[index] == 0.0);
            let error = (found.p[index] - truth[index]).abs();
            println!("{index}: {} ± {}, {}", found.p[index], found.deviations[index], truth[index]);
            furthest = furthest.max(error / found.deviations[index]);
        }
        assert!(dropped > 0 && furthest < 2.5, "{dropped} {furthest:?}");
    }
}
