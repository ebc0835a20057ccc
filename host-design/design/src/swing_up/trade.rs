//! Duration against force and robustness: what the candidates of a search are like.

use serde::Serialize;

use super::SwingUpError;
use super::plan::{Progress, Trying};
use super::search::{Request, candidates};
use super::setting::Setting;
use super::way::Way;
use crate::rig::Rig;

/// A candidate that was solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Solved {
    /// Duration (s).
    pub duration_s: f64,
    /// Largest force (N).
    pub force_n: f64,
    /// Largest distance of the cart from the middle (m).
    pub position_m: f64,
    /// Fragility: the smaller, the more errors of masses and friction it stands.
    pub score: f64,
}

/// The first `tried` candidates of the search for a raising that are solved, in their order.
///
/// # Errors
/// [`SwingUpError`] if the rig cannot be raised at all.
pub fn solved(rig: &Rig, tried: u64, progress: Progress<'_>) -> Result<Vec<Solved>, SwingUpError> {
    let setting = Setting::of(rig)?;
    let (request, way) = (Request::of(&setting), Way::Up);
    progress(Trying::Stage { way, what: "trajectories", steps: tried });
    let found = candidates(&setting, &request, way, 0..tried, &|score| progress(Trying::Step { score }))?;
    let solved = found.iter().map(|candidate| {
        let motion = &candidate.motion;
        let largest = |most: f64, value: f64| most.max(value.abs());
        Solved {
            duration_s: motion.duration_s(),
            force_n: motion.u.iter().copied().fold(0.0, largest),
            position_m: motion.x.iter().map(|x| x[0]).fold(0.0, largest),
            score: candidate.score,
        }
    });
    Ok(solved.collect())
}
