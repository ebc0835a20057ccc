//! Plans the two motions of a rig: search, selection, independent check, random runs of the firmware.

use core::ops::Range;

use serde::Serialize;

use super::SwingUpError;
use super::advice::{advice, is_enough, smaller_errors};
use super::check::{Peaks, check};
use super::firmware_runs::{Condition, FirmwareRuns, firmware_runs};
use super::gains::{POSITION_WEIGHT, motion};
use super::in_table::designed_table;
use super::refine::refine;
use super::robustness::{MotionSpread, RandomRuns, random_runs, score};
use super::search::{MotionCandidate, SearchRanges, candidates, ticks_per_knot};
use super::setting::{JUDGING_RUNS, Setting};
use super::stored::{Stored, StoredKnots};
use upright_design::motion::{PlannedMotion, RaiseAndLower, Transition};
use upright_design::parallel::{self, Progress, ProgressStep};
use upright_design::rig::Rig;
use upright_design::study::Study;
use upright_design::table::TableValues;

/// Number of candidates for the way up and for the way down; the second constant is for chains of four and more links.
const CANDIDATES: [u64; 2] = [100, 40];
const CANDIDATES_OF_LONG_CHAINS: [u64; 2] = [40, 24];
/// Two rounds of selection, each with the number of best candidates that it tests, and of random runs for each.
const ROUNDS: [(usize, usize); 2] = [(30, 40), (4, 160)];

/// Both motions of a rig, and their judgements.
#[derive(Debug, Clone, PartialEq)]
pub struct SwingUpPlan {
    /// The motions with their gains.
    pub motions: RaiseAndLower,
    /// The rig's gain table with the motions in it, with which they were judged.
    pub table: TableValues,
    /// Knots of the motions, for the file beside the rig file.
    pub stored: Stored,
    /// Judgement of the raising.
    pub raise: MotionJudgement,
    /// Judgement of the lowering.
    pub lower: MotionJudgement,
}

/// How a motion was found, and how it passed its tests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MotionJudgement {
    /// Which motion.
    pub transition: Transition,
    /// Number of candidates tried and solved; none for a stored motion.
    pub search: Option<[usize; 2]>,
    /// Fragility: the smaller, the larger errors of masses and friction it survives.
    pub score: f64,
    /// Peak values from the independent check.
    pub peaks: Peaks,
    /// Random runs of the whole firmware with the table of [`SwingUpPlan`]; for a lowering, those that were raised.
    pub runs: RandomRuns,
}

/// Searches for both motions of `rig`.
///
/// The result depends on nothing but the rig file: seeds and numbers of steps are fixed, and threads change only the
/// time it takes.
///
/// # Errors
/// [`SwingUpError`]: the rig cannot be raised at all, no candidate was solved, or the best one fails its check or too
/// many random runs.
pub fn search(rig: &Rig, progress: Progress<'_>) -> Result<SwingUpPlan, SwingUpError> {
    let setting = Setting::of(rig)?;
    let request = SearchRanges::of(&setting);
    let found = |transition| -> Result<FoundMotion, SwingUpError> {
        let counts = if setting.chain.links.len() >= 4 { CANDIDATES_OF_LONG_CHAINS } else { CANDIDATES };
        let tried = counts[usize::from(transition == Transition::Down)];
        match best(&setting, &request, transition, 0..tried, progress)? {
            Some(found) => Ok(found),
            None => Err(SwingUpError::NoTrajectory {
                transition,
                tried,
                help: advice(rig, transition, progress)?,
            }),
        }
    };
    let (raise, lower) = (found(Transition::Up)?, found(Transition::Down)?);
    judged(&setting, raise, lower, progress)
}

/// Judges stored motions again, as if they had just been found. The rig file may have changed since.
///
/// # Errors
/// As for [`search`]; [`SwingUpError::Outdated`] if a stored motion does not fit the rig any more.
pub fn judge(rig: &Rig, stored: &Stored, progress: Progress<'_>) -> Result<SwingUpPlan, SwingUpError> {
    let setting = Setting::of(rig)?;
    let (raise, lower) = parallel::both(
        || found(&setting, Transition::Up, stored.raise.clone()),
        || found(&setting, Transition::Down, stored.lower.clone()),
    );
    judged(&setting, raise?, lower?, progress)
}

/// The motions that are stored for exactly this rig, with their gains. They are checked again, except for the random
/// runs, which they passed before they were stored.
///
/// # Errors
/// [`SwingUpError::Outdated`] if the rig file has changed since.
pub fn motions(rig: &Rig, stored: &Stored) -> Result<RaiseAndLower, SwingUpError> {
    if stored.is_of(rig) { refined(rig, stored) } else { Err(SwingUpError::Outdated) }
}

/// Stored motions, refined for `rig`, which may differ a little from the one that they are stored for.
///
/// # Errors
/// [`SwingUpError::Outdated`] if they do not fit the rig any more.
pub fn refined(rig: &Rig, stored: &Stored) -> Result<RaiseAndLower, SwingUpError> {
    let setting = Setting::of(rig)?;
    let checked = |transition, knots| -> Result<PlannedMotion, SwingUpError> {
        let motion = restored(&setting, transition, knots)?;
        check(&setting, &motion, transition)?;
        Ok(motion)
    };
    let (raise, lower) = parallel::both(
        || checked(Transition::Up, &stored.raise),
        || checked(Transition::Down, &stored.lower),
    );
    Ok(RaiseAndLower { raise: raise?, lower: lower? })
}

pub(crate) fn restored(
    setting: &Setting<'_>,
    transition: Transition,
    stored: &StoredKnots,
) -> Result<PlannedMotion, SwingUpError> {
    let states = setting.rig.states();
    let knots = stored.knots(states).ok_or(SwingUpError::Outdated)?;
    let ends = transition.ends_near(knots.x.last().ok_or(SwingUpError::Outdated)?);
    let path = refine(&*setting.dynamics, &knots, stored.ticks, setting.tick_s, &ends);
    motion(setting, path.ok_or(SwingUpError::Outdated)?, transition, POSITION_WEIGHT)
}

/// A motion that is to be judged.
pub(crate) struct FoundMotion {
    pub(crate) motion: PlannedMotion,
    pub(crate) stored: StoredKnots,
    /// See [`MotionJudgement::score`] and [`MotionJudgement::search`].
    score: f64,
    pub(crate) search: Option<[usize; 2]>,
}

/// The motion restored from these knots, with its score.
fn found(
    setting: &Setting<'_>,
    transition: Transition,
    stored: StoredKnots,
) -> Result<FoundMotion, SwingUpError> {
    let motion = restored(setting, transition, &stored)?;
    let score = score(setting, &motion, transition, &MotionSpread::asked(setting.rig))?;
    Ok(FoundMotion { motion, stored, score, search: None })
}

/// The most robust of the candidates `numbers` for one transition, if any is solved.
pub(crate) fn best(
    setting: &Setting<'_>,
    request: &SearchRanges,
    transition: Transition,
    numbers: Range<u64>,
    progress: Progress<'_>,
) -> Result<Option<FoundMotion>, SwingUpError> {
    let tried = numbers.end.saturating_sub(numbers.start);
    progress(ProgressStep::Begin(&format!("{transition}: trajectories"), tried));
    let done = |score: Option<f64>| progress(score.map_or(ProgressStep::Done, ProgressStep::Solved));
    let mut solved = candidates(setting, request, transition, numbers, &done)?;
    if solved.is_empty() {
        return Ok(None);
    }
    let count = solved.len();
    solved.sort_by(|a, b| a.score.total_cmp(&b.score));
    for (kept, runs) in ROUNDS {
        solved.truncate(kept);
        solved = ranked(setting, request, transition, solved, runs, progress)?;
    }
    // The first that passes the check; otherwise the best, whose judgement then says what does not hold.
    let passes = |candidate: &MotionCandidate| check(setting, &candidate.motion, transition).is_ok();
    let chosen = solved.swap_remove(solved.iter().position(passes).unwrap_or(0));
    let stored = StoredKnots::new(ticks_per_knot(setting), &chosen.knots);
    Ok(Some(FoundMotion { search: Some([tried as usize, count]), ..found(setting, transition, stored)? }))
}

/// The candidates sorted by the number of random runs that they survive; among equals, the one with the smallest
/// peak deviation comes first.
fn ranked(
    setting: &Setting<'_>,
    request: &SearchRanges,
    transition: Transition,
    candidates: Vec<MotionCandidate>,
    runs: usize,
    progress: Progress<'_>,
) -> Result<Vec<MotionCandidate>, SwingUpError> {
    let stage = format!("{transition}: random runs of the best");
    progress(ProgressStep::Begin(&stage, candidates.len() as u64));
    let mut all: Vec<(RandomRuns, MotionCandidate)> = Vec::new();
    for candidate in candidates {
        let seed = JUDGING_RUNS as u64 + 1;
        let found = random_runs(setting, &candidate.motion, transition, &request.spread, seed, runs)?;
        progress(ProgressStep::Solved(candidate.score));
        all.push((found, candidate));
    }
    all.sort_by(|(a, _), (b, _)| b.arrived.cmp(&a.arrived).then(a.deviation_rad.total_cmp(&b.deviation_rad)));
    Ok(all.into_iter().map(|(_, candidate)| candidate).collect())
}

/// Checks both motions, and runs the whole firmware with the table that has them.
fn judged(
    setting: &Setting<'_>,
    raise: FoundMotion,
    lower: FoundMotion,
    progress: Progress<'_>,
) -> Result<SwingUpPlan, SwingUpError> {
    let rig = setting.rig;
    let peaks =
        [check(setting, &raise.motion, Transition::Up)?, check(setting, &lower.motion, Transition::Down)?];
    let [raising, lowering] = [&raise, &lower].map(|found| (found.search, found.score));
    let stored = Stored::new(rig, raise.stored, lower.stored);
    let motions = RaiseAndLower { raise: raise.motion, lower: lower.motion };
    let table = designed_table(rig, &motions)?;
    progress(ProgressStep::Begin("random runs of the firmware", 1));
    let runs = arriving(rig, &table, &motions)?;
    progress(ProgressStep::Done);
    let is_searched = raise.search.is_some();
    for transition in Transition::BOTH {
        let found = runs.runs_of(transition);
        if is_enough(rig, &found) {
            continue;
        }
        let help = smaller_errors(rig, |rig| {
            let motions = refined(rig, &stored)?;
            Ok(arriving(rig, &designed_table(rig, &motions)?, &motions)?.runs_of(transition))
        })?;
        let mut help = format!("{}; {help}", runs.ended_text());
        if is_searched {
            help = format!("{help}; {}", advice(rig, transition, progress)?);
        }
        let needed = setting.rules.success_percent;
        return Err(SwingUpError::NotRobust {
            transition,
            arrived: found.arrived,
            runs: found.runs,
            needed,
            help,
        });
    }
    let [up, down] = peaks;
    let [raised, lowered] = Transition::BOTH.map(|transition| runs.runs_of(transition));
    let judgement =
        |transition, (search, score), peaks, runs| MotionJudgement { transition, search, score, peaks, runs };
    Ok(SwingUpPlan {
        raise: judgement(Transition::Up, raising, up, raised),
        lower: judgement(Transition::Down, lowering, down, lowered),
        motions,
        table,
        stored,
    })
}

/// Runs of the whole firmware of `table` with the errors of `[swing_up]`.
fn arriving(rig: &Rig, table: &TableValues, motions: &RaiseAndLower) -> Result<FirmwareRuns, SwingUpError> {
    let seeds = 1..1 + JUDGING_RUNS as u64;
    firmware_runs(rig, table, motions, &Condition::asked(rig), seeds, &Study::whole())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_law_alone_brings_up_what_is_stored() {
        let file = "../../rigs/single-quanser-ip02.toml";
        let rig = Rig::from_path(file.as_ref()).unwrap();
        let motions = motions(&rig, &Stored::beside(file.as_ref()).unwrap()).unwrap();
        let setting = Setting::of(&rig).unwrap();
        let law = random_runs(
            &setting,
            &motions.raise,
            Transition::Up,
            &MotionSpread::asked(&rig),
            1,
            JUDGING_RUNS,
        )
        .unwrap();
        assert!(is_enough(&rig, &law), "{law:?}");
    }
}
