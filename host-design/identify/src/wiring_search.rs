//! The search for the wiring, or the reading of a table, that explains the measurements best.

use upright_design::parallel::{self, Progress, ProgressStep};
use upright_design::rig::Rig;

use crate::error::IdentifyError;
use crate::model::Model;
use crate::parameters::Prior;
use crate::record::Record;
use crate::recordings::Recordings;
use crate::shooting::Shooting;
use crate::wiring::{Wiring, WiringFound, wirings};

/// Begin and end of the part of the log that is used (s); of free swings, which are largest at their beginning.
const TIME_S: [f64; 2] = [0.5, 5.0];
const FREE_TIME_S: [f64; 2] = [0.0, 5.0];
/// How many of the best ones are fitted with all iterations.
const FINALISTS: usize = 8;
/// Rounds of iterations for the wiring of the file, each with new weights of the channels. It is not accused because
/// its fit is slow.
const ROUNDS_OF_FILE: usize = 3;
/// Residuals below this share of a step of the encoder are no better.
const LEAST_RMS: f64 = 0.2;
/// A fault is added to so many of the best ones.
const BEAM: usize = 4;
/// Time between the samples of free swings that are used, at least (s).
const FREE_SAMPLE_S: f64 = 0.008;

/// How thoroughly wirings are fitted.
struct WiringEffort {
    /// Length of the windows (s).
    window_s: f64,
    /// Iterations for each wiring, and then for so many of the best ones.
    iterations: [usize; 2],
    /// Rounds of these iterations for the best ones.
    rounds: usize,
    /// A wiring explains the log if its residuals are less than so many times the least. If the best one, other than
    /// that of the file, does not explain it, a fault is added to the best ones.
    explained: f64,
    /// How often one is added.
    more: usize,
}

/// A force moves the links at once: windows are short.
const DRIVEN: WiringEffort = WiringEffort {
    window_s: crate::shooting::WINDOW_S,
    iterations: [1, 4],
    rounds: 1,
    explained: 3.0,
    more: 2,
};
/// Free swings show their parameters more slowly, and their file may know next to nothing of the machine.
const FREE: WiringEffort =
    WiringEffort { window_s: 0.5, iterations: [2, 8], rounds: 2, explained: 30.0, more: 1 };

/// The measurements with each wiring undone.
struct WiringSearch<'a> {
    model: &'a Model,
    priors: &'a [Prior],
    effort: &'a WiringEffort,
    /// None if the measurements cannot be of this wiring.
    undone: &'a (dyn Fn(&Wiring) -> Option<Record> + Sync),
    progress: Progress<'a>,
}

/// Fits a few iterations with each wiring of a log.
pub(crate) fn find(model: &Model, record: &Record, priors: &[Prior], progress: Progress<'_>) -> WiringFound {
    let short = record.part(TIME_S[0], TIME_S[1]);
    let short = if short.pieces.is_empty() { record.clone() } else { short };
    let undone = |wiring: &Wiring| Some(wiring.undone(&short));
    let search = WiringSearch { model, priors, effort: &DRIVEN, undone: &undone, progress };
    let (file, others) = wirings(record.channels, record.is_moved, None);
    search.run(&short, file, &others)
}

/// Fits a few iterations with each reading of tables.
///
/// # Errors
/// [`IdentifyError`] if the tables cannot be read as it was said.
pub(crate) fn find_in_tables(
    rig: &Rig,
    recordings: &Recordings,
    model: &Model,
    priors: &[Prior],
    progress: Progress<'_>,
) -> Result<Option<WiringFound>, IdentifyError> {
    let Some(said) = recordings.said(rig)? else { return Ok(None) };
    let is_driven = recordings.recorded(rig)?.is_driven;
    let (effort, [from_s, to_s]) = if is_driven { (&DRIVEN, TIME_S) } else { (&FREE, FREE_TIME_S) };
    let beginning = recordings.beginning(rig, to_s + 1.0)?;
    let part = |record: Record| {
        let part = record.part(from_s, to_s);
        let part = if part.pieces.is_empty() { record } else { part };
        if is_driven { part } else { part.thinned((FREE_SAMPLE_S / part.dt_s) as usize) }
    };
    let undone = |wiring: &Wiring| {
        let record = beginning.reread(rig, &wiring.misread()).ok()?.record;
        (!record.pieces.is_empty()).then(|| part(record))
    };
    let (file, others) = wirings(model.layout.links + 1, model.is_imposed && is_driven, Some(said));
    let short = part(beginning.reread(rig, &[])?.record);
    // Without bristles, a joint has no state of its own that a short part does not show.
    let model = Model { has_bristles: false, substeps: short.model(model.gravity).substeps, ..model.clone() };
    let search = WiringSearch { model: &model, priors, effort, undone: &undone, progress };
    Ok(Some(search.run(&short, file, &others)))
}

impl WiringSearch<'_> {
    /// The best wiring; `short` are the measurements as they are.
    fn run(&self, short: &Record, file: Wiring, others: &[Wiring]) -> WiringFound {
        let effort = self.effort;
        (self.progress)(ProgressStep::Begin("wiring", (1 + others.len() + FINALISTS) as u64));
        let (of_file, file) = self.score(&file, effort.iterations[1], ROUNDS_OF_FILE);
        let mut scores = self.judge(others);
        scores.push((of_file, file));
        sort(&mut scores);
        for _ in 0..effort.more {
            if scores[0].1.faults.is_empty() || scores[0].0 < libm::log(effort.explained) + least(short) {
                break;
            }
            let mut more: Vec<Wiring> = Vec::new();
            for wiring in scores.iter().take(BEAM).flat_map(|(_, wiring)| wiring.with_another()) {
                let fitted = scores.iter().map(|(_, other)| other);
                if !more.iter().chain(fitted).any(|other| other.is_same(&wiring)) {
                    more.push(wiring);
                }
            }
            let steps = (more.len() + FINALISTS) as u64;
            (self.progress)(ProgressStep::Begin("more faults of the wiring", steps));
            scores.extend(self.judge(&more));
            sort(&mut scores);
        }
        WiringFound {
            best: scores[0].1.clone(),
            second: scores[1].1.clone(),
            margin: libm::exp(scores[1].0 - scores[0].0),
            file_is_worse_by: libm::exp(of_file - scores[0].0),
            residual: libm::exp(scores[0].0),
        }
    }

    /// All of them with few iterations, then the best ones with all.
    fn judge(&self, wirings: &[Wiring]) -> Vec<(f64, Wiring)> {
        let [few, all] = self.effort.iterations;
        let mut scores = parallel::map(wirings, |wiring| self.score(wiring, few, 1));
        sort(&mut scores);
        scores.truncate(FINALISTS);
        parallel::map(&scores, |(_, wiring)| self.score(wiring, all, self.effort.rounds))
    }

    fn score(&self, wiring: &Wiring, iterations: usize, rounds: usize) -> (f64, Wiring) {
        let score = (self.undone)(wiring).map_or(f64::INFINITY, |record| {
            let start: Vec<f64> = self.priors.iter().map(|prior| prior.value).collect();
            let shooting = Shooting { model: self.model, record: &record, priors: self.priors, free: true };
            let fit = shooting.fit_settled(&start, self.effort.window_s, iterations, rounds);
            // Relative to the motion: a factor on the counts must not make residuals small. With `max` alone, a fit
            // that has diverged would be the best.
            let of = |(channel, &rms): (usize, &f64)| match rms.is_finite() {
                true => libm::log(rms.max(LEAST_RMS * record.steps[channel]) / record.extent(channel)[1]),
                false => f64::INFINITY,
            };
            let first = record.first_channel();
            fit.rms.iter().enumerate().skip(first).map(of).sum::<f64>() / (record.channels - first) as f64
        });
        (self.progress)(ProgressStep::Done);
        (score, wiring.clone())
    }
}

fn sort(scores: &mut [(f64, Wiring)]) {
    scores.sort_by(|one, other| one.0.total_cmp(&other.0));
}

/// The score of the least residuals.
fn least(record: &Record) -> f64 {
    let of = |channel: usize| libm::log(LEAST_RMS * record.steps[channel] / record.extent(channel)[1]);
    let first = record.first_channel();
    (first..record.channels).map(of).sum::<f64>() / (record.channels - first) as f64
}
