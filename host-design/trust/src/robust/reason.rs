//! Why no candidate survives the tolerances, and what share of them is within reach.

use super::error::RobustError;
use super::loops::{At, CandidateLoops};
use crate::verify::PlantModel;
use upright_design::parallel::{self, Progress, ProgressStep};
use upright_design::rig::Tolerances;

/// Shares of the tolerances that may be within reach.
const SHARES: [f64; 4] = [0.125, 0.25, 0.5, 0.75];
/// Number of loops of each law and observer that are tried at a share: half of them those that survived longest, half
/// those with the least ripple.
const TRIED: usize = 8;

/// The reason in words, after the search has tried all loops that might have been chosen.
pub(super) fn reason(
    loops: &CandidateLoops<'_>,
    tolerances: &Tolerances,
    progress: Progress<'_>,
) -> Result<String, RobustError> {
    let mut reasons = Vec::new();
    for (pool, law) in loops.pools.iter().map(|pool| pool.law).enumerate() {
        let all: Vec<At> = loops.of_pool(pool).collect();
        let trials: Vec<_> = all.iter().filter_map(|&at| loops.known(at)).collect();
        if trials.len() < all.len() || trials.iter().any(|trial| trial.holds) {
            continue;
        }
        let count = all.len();
        reasons.push(match trials.iter().filter(|trial| trial.is_stable).count() {
            0 if count == 0 => format!("{law}: no loop is stable, even with the masses of the file"),
            0 => format!(
                "{law}: none of {count} loops is stable with every combination of masses wrong by {} %; \
                 weigh the parts",
                tolerances.mass_percent
            ),
            _ => format!(
                "{law}: none of {count} loops survives friction, zeros and latency within the limits; \
                 smaller bearings, better zeros or a longer rail"
            ),
        });
    }
    if reasons.is_empty() {
        reasons.push("no joint noise serves everything: masses, friction and both laws".to_owned());
    }
    reasons.push(match within_reach(loops, progress)? {
        Some(share) => format!("{share} times the tolerances is within reach"),
        None => format!(
            "not even an eighth of the tolerances is within reach of the loops that survived longest and those with \
             the least ripple, {TRIED} of each law and joint noise"
        ),
    });
    Ok(reasons.join("; "))
}

/// The largest share of the tolerances that some of the loops tried survive, by bisection.
fn within_reach(loops: &CandidateLoops<'_>, progress: Progress<'_>) -> Result<Option<f64>, RobustError> {
    let [mut held, mut lost] = [0, SHARES.len() + 1];
    while lost - held > 1 {
        let middle = (held + lost) / 2;
        if serves(loops, SHARES[middle - 1], progress)? { held = middle } else { lost = middle }
    }
    Ok(held.checked_sub(1).map(|index| SHARES[index]))
}

/// Whether there is an observer with which a loop of each law survives this share of the tolerances.
fn serves(loops: &CandidateLoops<'_>, share: f64, progress: Progress<'_>) -> Result<bool, RobustError> {
    let corners = loops.plants.corners(share)?;
    progress(ProgressStep::Begin("what is within reach", loops.observers.len() as u64));
    let survives = |pool: usize, observer: usize| -> Result<bool, RobustError> {
        for at in tried(loops, [pool, observer], &corners)? {
            if loops.runs(at, share)?.holds {
                return Ok(true);
            }
        }
        Ok(false)
    };
    let of_observer = |observer: usize| -> Result<bool, RobustError> {
        for pool in 0..loops.pools.len() {
            if !survives(pool, observer)? {
                progress(ProgressStep::Done);
                return Ok(false);
            }
        }
        Ok(true)
    };
    // The first such observer ends the search.
    let found = parallel::try_map(0..loops.observers.len(), |observer| match of_observer(observer) {
        Ok(true) => Err(None),
        Ok(false) => Ok(()),
        Err(error) => Err(Some(error)),
    });
    match found.map(|_: Vec<()>| ()) {
        Ok(()) => Ok(false),
        Err(None) => Ok(true),
        Err(Some(error)) => Err(error),
    }
}

/// The loops of a law and an observer that are tried: of those that are stable with `corners`, the ones that survived
/// longest and the ones with the least ripple.
fn tried(
    loops: &CandidateLoops<'_>,
    [pool, observer]: [usize; 2],
    corners: &[PlantModel<f64>],
) -> Result<Vec<At>, RobustError> {
    let cheapest: Vec<At> =
        (0..loops.ranked[pool][observer].len()).map(|place| [pool, observer, place]).collect();
    let mut longest = cheapest.clone();
    let survived_s = |&at: &At| loops.known(at).map_or(0.0, |trial| trial.survived_s);
    longest.sort_by(|a, b| survived_s(b).total_cmp(&survived_s(a)));
    let mut found = Vec::new();
    for (all, count) in [(longest, TRIED / 2), (cheapest, TRIED)] {
        for at in all {
            if found.len() < count && !found.contains(&at) && loops.is_stable(at, corners)? {
                found.push(at);
            }
        }
    }
    Ok(found)
}
