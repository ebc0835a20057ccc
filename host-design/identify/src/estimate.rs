//! The whole identification: from logs to parameters, deviations and a verdict.

use std::path::PathBuf;

use upright_design::parallel::{Progress, ProgressStep};
use upright_design::rig::{Chain, Rig};

use crate::at_rest;
use crate::channel::chain_of;
use crate::counted;
use crate::covariance::{changes, deviations};
use crate::creeping;
use crate::doubt::Doubt;
use crate::error::IdentifyError;
use crate::estimated::{Estimate, Identification};
use crate::free;
use crate::imposed;
use crate::late;
use crate::log::Log;
use crate::model::Model;
use crate::old_values::old_values;
use crate::parameters::{ParameterKind, Prior, for_wiring, priors};
use crate::prediction::Filter;
use crate::realise::realise;
use crate::record::Record;
use crate::recordings::{Recorded, Recordings};
use crate::shooting::{Shooting, WINDOW_S};
use crate::suspect;
use crate::verdict::{HeldOut, Predicted, Refusal, accepted, channels, judge, judge_windows};
use crate::whole;
use crate::window_errors::{WindowErrors, window_errors};
use crate::wiring_search;
use crate::written::as_written;

/// Shortest log (s).
const LEAST_S: f64 = 5.0;
/// Time at the end of a log that is held out to compare the old and the new file (s), and largest share of the log.
const HELD_OUT: (f64, f64) = (10.0, 0.25);
/// Length of the windows in that comparison (s).
const HELD_OUT_WINDOW_S: f64 = 0.5;
/// Time at the beginning of a log that multiple shooting uses (s): it only has to start the prediction-error fit.
const SHOOTING_S: f64 = 20.0;
/// Iterations and rounds of multiple shooting, and iterations of the prediction-error fit.
const ITERATIONS: (usize, usize, usize) = (10, 3, 6);
/// Iterations of the fit of each half, which starts at that of the whole.
const ITERATIONS_OF_HALF: usize = 2;

/// Options of an identification.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// Whether the eccentricity of the encoders is identified, too.
    pub eccentricity: bool,
    /// First moment of the last link (kg·m), if it was weighed: it fixes the scale of masses and forces.
    pub weighed_kg_m: Option<f64>,
    /// Whether to take the wiring of the file on trust instead of checking it.
    pub trust_wiring: bool,
    /// Whether numbers that are doubted are written nevertheless.
    pub trust_numbers: bool,
    /// Whether to leave the air drag of the links out, of free swings.
    pub without_drag: bool,
    /// Whether to leave the dry friction of the joints out, of free swings.
    pub without_dry: bool,
}

impl Settings {
    fn leaves_out(&self, kind: ParameterKind) -> bool {
        match kind {
            ParameterKind::AirDrag(_) => self.without_drag,
            ParameterKind::JointDry(_) => self.without_dry,
            _ => false,
        }
    }
}

/// Identifies the machine of `rig` from its logs, each with the path of its file.
///
/// # Errors
/// [`IdentifyError`] if a log is not of the rig, the logs are too short, or a channel does not move in them. A misfit
/// is not an error: see [`Identification::refusal`].
pub fn identify(
    rig: &Rig,
    logs: &[(PathBuf, Log)],
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<Identification, IdentifyError> {
    identify_recordings(rig, None, &Recordings::Logs(logs.to_vec()), None, settings, progress)
}

/// Identifies the machine of `rig` from its recordings. Without a drive in them, the scale of masses and frictions
/// stays that of the file. The recordings `predict` are not used, but predicted with the old and the new numbers.
/// With the `text` of the rig's file, the new numbers are those of the new file, read again; without, as they were
/// found.
///
/// # Errors
/// [`IdentifyError`] if a recording is not of the rig, they are too short, or a channel does not move in them. A misfit
/// is not an error: see [`Identification::refusal`].
pub fn identify_recordings(
    rig: &Rig,
    text: Option<&str>,
    recordings: &Recordings,
    predict: Option<&Recordings>,
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<Identification, IdentifyError> {
    let chain = chain_of(rig)?;
    let Recorded { record, finer, lost_ticks, is_driven, rows } = recordings.recorded(rig)?;
    record.at_least(LEAST_S)?;
    record.moves()?;
    let model = Model { has_bristles: !is_driven, ..record.model(chain.gravity_m_per_s2) };
    let mut priors = priors(rig, chain, settings.eccentricity);
    let mut found = Identification {
        lost_ticks,
        rows,
        is_driven,
        is_log: matches!(recordings, Recordings::Logs(_)),
        delay_ticks: rig.tick.delay_ticks,
        ..Identification::of_record(&record)
    };
    if record.is_moved {
        imposed::known(model.layout, &mut priors);
    } else if !is_driven {
        free::known(rig, model.layout, &mut priors, record.is_clamped);
    }
    if !settings.trust_wiring {
        let loose = for_wiring(model.layout, &priors);
        let in_tables = wiring_search::find_in_tables(rig, recordings, &model, &loose, progress)?;
        let wiring = in_tables.unwrap_or_else(|| wiring_search::find(&model, &record, &loose, progress));
        found.wiring = Some(wiring.clone());
        if !wiring.is_as_in_file() {
            found.refusal = Some(Refusal::Wiring(Box::new(wiring)));
            return Ok(found);
        }
    }
    let to_write = ToWrite { rig, chain, text, weighed_kg_m: settings.weighed_kg_m };
    let are_as_recorded = rows.is_some_and(|rows| rows.uneven_s == 0.0);
    let between_counts = if are_as_recorded { counted::doubts(&record) } else { Vec::new() };
    let written = if is_driven {
        driven(&model, (record, finer), &priors, &to_write, &mut found, progress)?
    } else {
        progress(ProgressStep::Begin("free swings", free::FITS));
        let left_out = |kind| settings.leaves_out(kind);
        let free = free::fit(&model, &record, &priors, &left_out, &|| progress(ProgressStep::Done))?;
        free.write(rig, &model, &priors, &mut found);
        let written = to_write.written(&free.p, &mut found);
        free.compare(&model, &record, &priors, &written, &mut found);
        written
    };
    let errors = |recordings| predicted(rig, &model, &priors, &written, recordings);
    found.predicted = predict.map_or(Ok(Vec::new()), errors)?;
    found.doubts.extend(between_counts);
    decide(&mut found);
    Ok(found)
}

/// Identifies a machine with a drive, and returns all parameters as they are written; if the drive acts several ticks
/// late, that is found first.
fn driven(
    model: &Model,
    (mut record, mut finer): (Record, Option<Record>),
    priors: &[Prior],
    to_write: &ToWrite<'_>,
    found: &mut Identification,
    progress: Progress<'_>,
) -> Result<Vec<f64>, IdentifyError> {
    let mut shifts = 0;
    loop {
        let held_s = HELD_OUT.0.min(HELD_OUT.1 * record.seconds());
        let used_s = record.seconds() - held_s;
        let finer_used = finer.as_ref().map(|finer| finer.part(0.0, used_s));
        let (used, held) = (record.part(0.0, used_s), record.part(used_s, used_s + held_s + 1.0));
        let fitted =
            Fitted { rig: to_write.rig, priors, used: &used, held: &held, finer: finer_used.as_ref() };
        progress(ProgressStep::Begin("multiple shooting", 1));
        let shot = fitted.shoot(model);
        let ticks = if record.is_moved { 0 } else { late::ticks(model.layout, &shot) };
        if ticks == 0 || shifts == late::MOST_SHIFTS {
            let fit = fitted.run(model, &shot, found, progress)?;
            if !record.is_moved {
                found.doubts.extend(whole::doubts(&found.estimates));
            }
            found.add_to_delay();
            let written = to_write.written(&fit.p, found);
            progress(ProgressStep::Begin("held-out log", 1));
            fitted.compare(&fit, &written, found);
            return Ok(written);
        }
        shifts += 1;
        found.late_ticks += ticks;
        record = record.shifted(ticks);
        finer = finer.map(|finer| finer.shifted(ticks));
    }
}

/// The file to which the numbers are written.
struct ToWrite<'a> {
    rig: &'a Rig,
    chain: &'a Chain,
    text: Option<&'a str>,
    weighed_kg_m: Option<f64>,
}

impl ToWrite<'_> {
    /// The parameters `p` as the new file has them, or as they are if there is no such file.
    fn written(&self, p: &[f64], found: &mut Identification) -> Vec<f64> {
        match realise(self.chain, p, self.weighed_kg_m) {
            Ok(realised) => found.realised = Some(realised),
            Err(error) => found.refusal = Some(error.into()),
        }
        let Some(text) = self.text.filter(|_| found.realised.is_some()) else { return p.to_vec() };
        as_written(self.rig, text, found, p).unwrap_or_else(|error| {
            found.refusal = Some(Refusal::NotPhysical(error.to_string()));
            p.to_vec()
        })
    }
}

/// Whether the numbers may be written.
fn decide(found: &mut Identification) {
    let is_driven = found.is_driven;
    found.doubts.extend(suspect::unused(&found.predicted, &|window| accepted(is_driven, window)));
    if found.is_driven
        && let Err(refusal) = judge(&found.channels)
    {
        found.refusal = Some(refusal);
    }
    if let Err(refusal) = judge_windows(&found.left_out) {
        found.refusal = Some(refusal);
    }
}

/// Errors of predictions of `recordings`, with the old file and with the parameters `p`.
fn predicted(
    rig: &Rig,
    model: &Model,
    priors: &[Prior],
    p: &[f64],
    recordings: &Recordings,
) -> Result<Vec<WindowErrors>, IdentifyError> {
    let record = recordings.recorded(rig)?.record;
    let start: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
    let old = old_values(rig, model.layout, &start, p);
    Ok(window_errors(model, priors, &[(&record, [&old, p])]))
}

/// The model with the friction laws under which the measurements are most likely, and the parameters with them, from
/// `p`.
fn with_friction_laws(filter: &Filter<'_>, p: Vec<f64>, noise: &[f64]) -> (Model, Vec<f64>) {
    let mut model = filter.model.clone();
    model.smoothing = filter.smoothing(&p, noise);
    // With more links the search takes minutes.
    if model.layout.links <= 2 {
        model = at_rest::with_excess(&Filter { model: &model, ..*filter }, &p, noise);
    }
    let creeping = creeping::found(&Filter { model: &model, ..*filter }, &p, noise);
    creeping.unwrap_or((model, p))
}

/// The parts of the record, and the priors.
struct Fitted<'a> {
    rig: &'a Rig,
    priors: &'a [Prior],
    used: &'a Record,
    held: &'a Record,
    finer: Option<&'a Record>,
}

/// A fit of the used part.
struct DrivenFit {
    model: Model,
    p: Vec<f64>,
    noise: Vec<f64>,
}

impl Fitted<'_> {
    /// The parameters by multiple shooting.
    fn shoot(&self, model: &Model) -> Vec<f64> {
        let start: Vec<f64> = self.priors.iter().map(|prior| prior.value).collect();
        let first = self.used.part(0.0, SHOOTING_S);
        let shooting = Shooting { model, record: &first, priors: self.priors, free: true };
        shooting.fit(&start, WINDOW_S, ITERATIONS.0, ITERATIONS.1).p
    }

    /// Prediction-error fit from the parameters `shot`, and deviations.
    fn run(
        &self,
        model: &Model,
        shot: &[f64],
        found: &mut Identification,
        progress: Progress<'_>,
    ) -> Result<DrivenFit, IdentifyError> {
        progress(ProgressStep::Begin("prediction error", 1));
        let filter = Filter { model, record: self.used, priors: self.priors };
        let noise = filter.tuned(shot);
        let undetermined = || IdentifyError::Undetermined("the equations have no solution");
        let (p, _) = filter.fit(shot, &noise, ITERATIONS.2).ok_or_else(undetermined)?;
        // Noise and smoothing were tuned for the parameters before this fit.
        let (model, p) = with_friction_laws(&filter, p, &noise);
        found.doubts.extend(Doubt::of_friction(&model));
        let filter = Filter { model: &model, ..filter };
        let noise = filter.tuned(&p);
        let (p, normal) = filter.fit(&p, &noise, ITERATIONS.2).ok_or_else(undetermined)?;
        progress(ProgressStep::Begin("deviations", 1));
        let inverse = normal.factor(0.0).ok_or_else(undetermined)?.inverse();
        let changes = changes(&filter, self.finer, &p, &noise);
        let halves = self.halves(&filter, &p, &noise).ok_or_else(undetermined)?;
        let kinds = model.layout.kinds();
        let deviations = deviations(&kinds, self.priors, &inverse, &changes, &p, self.used);
        let active: Vec<usize> = (0..p.len()).filter(|&i| self.priors[i].deviation > 0.0).collect();
        found.estimates = active
            .iter()
            .map(|&i| Estimate {
                kind: kinds[i],
                old: self.priors[i].value,
                new: p[i],
                deviation: deviations[i],
                halves: Some([0, 1].map(|half: usize| halves[half][0][i])),
                held_by_prior: deviations[i] > 0.5 * self.priors[i].deviation,
            })
            .collect();
        let size = p.len();
        let of = |i: usize, j: usize| {
            inverse[i * size + j] / (inverse[i * size + i] * inverse[j * size + j]).sqrt()
        };
        found.correlations =
            active.iter().flat_map(|&i| active.iter().map(move |&j| (i, j))).map(|(i, j)| of(i, j)).collect();
        let unbounded = suspect::unbounded(model.layout, self.priors, &normal, &p);
        found.doubts.extend(suspect::values(model.layout, self.priors, &found.estimates, &unbounded));
        let scatter = |&i: &usize| halves[0][1][i].hypot(halves[1][1][i]);
        let scatters: Vec<f64> = active.iter().map(scatter).collect();
        found.doubts.extend(suspect::halves(&found.estimates, &scatters));
        Ok(DrivenFit { model, p, noise })
    }

    /// The parameters from the first and from the second half of the used part, each with their deviations.
    fn halves(&self, filter: &Filter<'_>, p: &[f64], noise: &[f64]) -> Option<[[Vec<f64>; 2]; 2]> {
        let seconds = self.used.seconds();
        let half = |from: f64| {
            let record = self.used.part(from * seconds, (from + 0.5) * seconds);
            let (p, normal) = Filter { record: &record, ..*filter }.fit(p, noise, ITERATIONS_OF_HALF)?;
            let inverse = normal.factor(0.0)?.inverse();
            let of = |i: usize| self.priors[i].deviation * inverse[i * p.len() + i].sqrt();
            let deviations = (0..p.len()).map(of).collect();
            Some([p, deviations])
        };
        Some([half(0.0)?, half(0.5)?])
    }

    /// The comparison on the held-out part, with the old file and the parameters `written`.
    fn compare(&self, fit: &DrivenFit, written: &[f64], found: &mut Identification) {
        let DrivenFit { model, p, noise } = fit;
        let filter = Filter { model, record: self.used, priors: self.priors };
        let over =
            filter.run(p, noise, false).merge(&Filter { record: self.held, ..filter }.run(p, noise, false));
        let start: Vec<f64> = self.priors.iter().map(|prior| prior.value).collect();
        let old = old_values(self.rig, model.layout, &start, p);
        let (held, of_found) = self.held_out(model, [&old, written, p]);
        let ranges: Vec<f64> = (0..self.used.channels).map(|channel| self.used.extent(channel)[1]).collect();
        let rms = [&held.rms[0], &of_found, &held.rms[1]].map(Vec::as_slice);
        found.doubts.extend(suspect::predictions(self.held, &ranges, rms));
        found.channels = channels(&over, held, &ranges, self.used.first_channel());
    }

    /// Predictions over windows whose initial states are fitted, with the first two sets of `values`, and the errors of
    /// the third.
    fn held_out(&self, model: &Model, values: [&[f64]; 3]) -> (HeldOut, Vec<f64>) {
        let shooting = Shooting { model, record: self.held, priors: self.priors, free: false };
        let [old, new, found] =
            values.map(|p| shooting.fit(p, HELD_OUT_WINDOW_S, ITERATIONS.0, ITERATIONS.1));
        let [by_file, by_found] = [&old, &new].map(|fit| shooting.predictions(fit));
        let (count, dt_s) = (self.held.channels, self.held.dt_s);
        let of = |channel: usize| {
            let both = by_file.iter().zip(&by_found).enumerate();
            let one = both.map(|(index, ((piece, sample, by_file), (.., by_found)))| Predicted {
                time_s: index as f64 * dt_s,
                measured: self.held.pieces[*piece].y[sample * count + channel],
                by_file: by_file[channel],
                by_found: by_found[channel],
            });
            one.collect()
        };
        (HeldOut { predictions: (0..count).map(of).collect(), rms: [old.rms, new.rms] }, found.rms)
    }
}
