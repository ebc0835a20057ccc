//! Duration against force and robustness over the candidates of a search.

use serde::Serialize;

use super::SwingUpError;
use super::robustness::{MotionSpread, RandomRuns, random_runs};
use super::search::{MotionCandidate, SearchRanges, candidates};
use super::setting::Setting;
use upright_design::motion::Transition;
use upright_design::parallel::{Progress, ProgressStep};
use upright_design::rig::Rig;

/// Random runs of each candidate.
const RUNS: usize = 100;

/// A candidate that was solved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SolvedCandidate {
    /// Duration (s).
    pub duration_s: f64,
    /// Largest force (N) or acceleration (m/s²).
    pub input: f64,
    /// Largest distance of the cart from the middle (m).
    pub position_m: f64,
    /// Fragility: the smaller, the larger errors of masses and friction it survives.
    pub score: f64,
    /// Random runs with the spreads of masses and friction of `[swing_up]`.
    pub runs: RandomRuns,
    /// Random runs with twice these spreads.
    pub wider: RandomRuns,
}

/// Those of `tried` candidates of the search for a raising that are solved, in their order. Seed 1 stands for the
/// first candidates of the search, 2 for those after them, and so on; it is also the seed of the first random run.
///
/// # Errors
/// [`SwingUpError`] if the rig cannot be raised at all.
pub fn solved(
    rig: &Rig,
    tried: u64,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<SolvedCandidate>, SwingUpError> {
    let setting = Setting::of(rig)?;
    let (request, transition) = (SearchRanges::of(&setting), Transition::Up);
    let first = seed.saturating_sub(1).saturating_mul(tried);
    progress(ProgressStep::Begin("trajectories", tried));
    let step = |score: Option<f64>| progress(score.map_or(ProgressStep::Done, ProgressStep::Solved));
    let found = candidates(&setting, &request, transition, first..first.saturating_add(tried), &step)?;
    progress(ProgressStep::Begin("random runs", found.len() as u64));
    let MotionSpread { mass, friction, .. } = request.spread;
    let twice = MotionSpread { mass: 2.0 * mass, friction: 2.0 * friction, ..request.spread };
    let judged = |candidate: &MotionCandidate| {
        let (motion, score) = (&candidate.motion, candidate.score);
        let runs = |spread: &MotionSpread| random_runs(&setting, motion, transition, spread, seed, RUNS);
        let (runs, wider) = (runs(&request.spread)?, runs(&twice)?);
        step(Some(score));
        Ok(SolvedCandidate {
            duration_s: motion.duration_s(),
            input: motion.input(),
            position_m: motion.position_m(),
            score,
            runs,
            wider,
        })
    };
    found.iter().map(judged).collect()
}
