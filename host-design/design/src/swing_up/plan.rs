//! From a rig to its two motions: search, selection, random runs, independent check.

use serde::Serialize;

use super::SwingUpError;
use super::advice::{advice, is_enough, narrower};
use super::check::{Peaks, check};
use super::gains::motion;
use super::motion::{Motion, SwingUp};
use super::refine::refine;
use super::robustness::{Runs, random_runs, score};
use super::search::{Candidate, Request, candidates, ticks_per_knot};
use super::setting::Setting;
use super::stored::{Stored, StoredKnots};
use super::way::Way;
use crate::parallel;
use crate::rig::Rig;

/// Candidates of the way up and of the way down; of chains with four and more links.
const CANDIDATES: [u64; 2] = [100, 40];
const CANDIDATES_OF_LONG_CHAINS: [u64; 2] = [40, 24];
/// So many candidates with the best scores go through so many random runs each, in two rounds.
const ROUNDS: [(usize, usize); 2] = [(30, 40), (4, 160)];
/// Random runs of the judgement, with the seeds from 1 on. Those of the rounds come after them.
pub(super) const RUNS: usize = 200;

/// What is being tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trying {
    /// A stage of this many steps begins.
    Stage {
        /// Which motion.
        way: Way,
        /// What each step does.
        what: &'static str,
        /// Number of steps.
        steps: u64,
    },
    /// A step is done.
    Step {
        /// Fragility of the candidate; none if it was not solved.
        score: Option<f64>,
    },
}

/// Called with what is being tried, from any thread.
pub type Progress<'a> = &'a (dyn Fn(Trying) + Sync);

/// Both motions of a rig, and how they were found to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The motions with their gains.
    pub motions: SwingUp,
    /// What is stored of them.
    pub stored: Stored,
    /// How the raising was found to be.
    pub raise: Judgement,
    /// How the lowering was found to be.
    pub lower: Judgement,
}

/// How a motion was found to be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// Which motion.
    pub way: Way,
    /// Candidates tried and solved; none for a stored motion.
    pub search: Option<[usize; 2]>,
    /// Fragility: the smaller, the more errors of masses and friction it stands.
    pub score: f64,
    /// What the independent check found.
    pub peaks: Peaks,
    /// The random runs.
    pub runs: Runs,
}

/// Searches both motions of `rig`.
///
/// The result depends on nothing but the rig file: seeds and numbers of steps are fixed, and threads change only the
/// time it takes.
///
/// # Errors
/// [`SwingUpError`]: the rig cannot be raised at all, no candidate was solved, or none stands enough random runs.
pub fn search(rig: &Rig, progress: Progress<'_>) -> Result<Plan, SwingUpError> {
    let setting = Setting::of(rig)?;
    let request = Request::of(&setting);
    let (raise, stored_raise, up) = best(&setting, &request, Way::Up, progress)?;
    let (lower, stored_lower, down) = best(&setting, &request, Way::Down, progress)?;
    Ok(Plan {
        motions: SwingUp { raise, lower },
        stored: Stored::new(rig, stored_raise, stored_lower),
        raise: up,
        lower: down,
    })
}

/// Judges stored motions again, as if they had just been found. The rig file may have changed since.
///
/// # Errors
/// As for [`search`]; [`SwingUpError::Outdated`] if a stored motion does not fit the rig any more.
pub fn judge(rig: &Rig, stored: &Stored, progress: Progress<'_>) -> Result<Plan, SwingUpError> {
    let setting = Setting::of(rig)?;
    let request = Request::of(&setting);
    let judged = |way, stored: &StoredKnots| -> Result<(Motion, Judgement), SwingUpError> {
        let motion = restored(&setting, way, stored)?;
        let score = score(&setting, &motion, way, &request.spread)?;
        let judgement = judgement(&setting, &request, way, (&motion, stored), score, None, progress)?;
        Ok((motion, judgement))
    };
    let (raise, up) = judged(Way::Up, &stored.raise)?;
    let (lower, down) = judged(Way::Down, &stored.lower)?;
    let stored = Stored::new(rig, stored.raise.clone(), stored.lower.clone());
    Ok(Plan { motions: SwingUp { raise, lower }, stored, raise: up, lower: down })
}

/// The motions that are stored for exactly this rig, with their gains, checked but for the random runs: those they have
/// stood before they were stored.
///
/// # Errors
/// [`SwingUpError::Outdated`] if the rig file has changed since.
pub fn motions(rig: &Rig, stored: &Stored) -> Result<SwingUp, SwingUpError> {
    if stored.is_of(rig) { refined(rig, stored) } else { Err(SwingUpError::Outdated) }
}

/// Stored motions, refined for `rig`, which may differ a little from the one that they are stored for.
///
/// # Errors
/// [`SwingUpError::Outdated`] if they do not fit the rig any more.
pub fn refined(rig: &Rig, stored: &Stored) -> Result<SwingUp, SwingUpError> {
    let setting = Setting::of(rig)?;
    let checked = |way, knots| -> Result<Motion, SwingUpError> {
        let motion = restored(&setting, way, knots)?;
        check(&setting, &motion, way)?;
        Ok(motion)
    };
    let (raise, lower) =
        parallel::both(|| checked(Way::Up, &stored.raise), || checked(Way::Down, &stored.lower));
    Ok(SwingUp { raise: raise?, lower: lower? })
}

fn restored(setting: &Setting<'_>, way: Way, stored: &StoredKnots) -> Result<Motion, SwingUpError> {
    let states = setting.rig.states();
    let knots = stored.knots(states).ok_or(SwingUpError::Outdated)?;
    let path = refine(&*setting.dynamics, &knots, stored.ticks, setting.tick_s, &way.ends(states));
    motion(setting, path.ok_or(SwingUpError::Outdated)?, way)
}

/// The most robust candidate of one way.
fn best(
    setting: &Setting<'_>,
    request: &Request,
    way: Way,
    progress: Progress<'_>,
) -> Result<(Motion, StoredKnots, Judgement), SwingUpError> {
    let counts = if setting.chain.links.len() >= 4 { CANDIDATES_OF_LONG_CHAINS } else { CANDIDATES };
    let tried = counts[usize::from(way == Way::Down)];
    progress(Trying::Stage { way, what: "trajectories", steps: tried });
    let mut solved = candidates(setting, request, way, 0..tried, &|score| progress(Trying::Step { score }))?;
    if solved.is_empty() {
        return Err(SwingUpError::NoTrajectory { way, tried, help: advice(setting.rig, way, progress)? });
    }
    let count = solved.len();
    solved.sort_by(|a, b| a.score.total_cmp(&b.score));
    for (kept, runs) in ROUNDS {
        solved.truncate(kept);
        solved = ranked(setting, request, way, solved, runs, progress)?;
    }
    // The first that passes the check; else the best, whose judgement then says what does not hold.
    let passes = |candidate: &Candidate| check(setting, &candidate.motion, way).is_ok();
    let chosen = solved.swap_remove(solved.iter().position(passes).unwrap_or(0));
    let search = Some([tried as usize, count]);
    let stored = StoredKnots::new(ticks_per_knot(setting), &chosen.knots);
    let motion = (&chosen.motion, &stored);
    let judgement = judgement(setting, request, way, motion, chosen.score, search, progress)?;
    Ok((chosen.motion, stored, judgement))
}

/// The candidates by the number of random runs that they stand; of equals, the one with the smallest largest deviation
/// first.
fn ranked(
    setting: &Setting<'_>,
    request: &Request,
    way: Way,
    candidates: Vec<Candidate>,
    runs: usize,
    progress: Progress<'_>,
) -> Result<Vec<Candidate>, SwingUpError> {
    progress(Trying::Stage { way, what: "random runs of the best", steps: candidates.len() as u64 });
    let mut all: Vec<(Runs, Candidate)> = Vec::new();
    for candidate in candidates {
        let seed = RUNS as u64 + 1;
        let found = random_runs(setting, &candidate.motion, way, &request.spread, seed, runs)?;
        progress(Trying::Step { score: Some(candidate.score) });
        all.push((found, candidate));
    }
    all.sort_by(|(a, _), (b, _)| b.stood.cmp(&a.stood).then(a.deviation_rad.total_cmp(&b.deviation_rad)));
    Ok(all.into_iter().map(|(_, candidate)| candidate).collect())
}

fn judgement(
    setting: &Setting<'_>,
    request: &Request,
    way: Way,
    (motion, stored): (&Motion, &StoredKnots),
    score: f64,
    search: Option<[usize; 2]>,
    progress: Progress<'_>,
) -> Result<Judgement, SwingUpError> {
    let peaks = check(setting, motion, way)?;
    progress(Trying::Stage { way, what: "random runs", steps: 1 });
    let runs = random_runs(setting, motion, way, &request.spread, 1, RUNS)?;
    progress(Trying::Step { score: Some(score) });
    if !is_enough(setting.rig, &runs) {
        let mut help = narrower(setting.rig, |rig| {
            let setting = Setting::of(rig)?;
            let motion = restored(&setting, way, stored)?;
            random_runs(&setting, &motion, way, &Request::of(&setting).spread, 1, RUNS)
        })?;
        if search.is_some() {
            help = format!("{help}; {}", advice(setting.rig, way, progress)?);
        }
        let needed = setting.rules.success_percent;
        return Err(SwingUpError::NotRobust { way, stood: runs.stood, runs: RUNS, needed, help });
    }
    Ok(Judgement { way, search, score, peaks, runs })
}
