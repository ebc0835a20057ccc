//! The front: the least ripple as a function of multiples of the tolerances.

use serde::Serialize;
use upright::table::Law;

use super::error::RobustError;
use super::loops::CandidateLoops;
use crate::verify::PlantModel;
use upright_design::design::DesignError;
use upright_design::parallel::{self, Progress, ProgressStep};

/// Multiples of the tolerances for which the front is made.
pub(super) const SCALES: [f64; 5] = [0.25, 0.5, 1.0, 1.5, 2.0];
/// A place beyond the end of every list: no loop.
const NONE: usize = usize::MAX;

/// The least ripple at each multiple of the tolerances, with the same joint noise for both laws.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Front(pub Vec<FrontPoint>);

/// One multiple of the tolerances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrontPoint {
    /// The multiple.
    pub scale: f64,
    /// The loops with the least ripple; none if no loop survives this multiple.
    pub best: Option<LeastRipple>,
}

/// The loops with the least ripple at one multiple of the tolerances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeastRipple {
    /// The joint noise over that of the file.
    pub joint_noise_factor: f64,
    /// One entry for each law that the rig asks for.
    pub laws: Vec<LawRipple>,
}

/// One loop of the front.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawRipple {
    /// The law.
    pub law: Law,
    /// How the numbers differ from the file, in words.
    pub name: String,
    /// Predicted rms of the force (N), or of the acceleration (m/s²).
    pub ripple_n: f64,
}

/// The front over `scales`, which are in ascending order.
pub(super) fn front(
    loops: &CandidateLoops<'_>,
    scales: &[f64],
    progress: Progress<'_>,
) -> Result<Front, RobustError> {
    let climbed = climbed(loops, scales, progress)?;
    let at = |(level, &scale): (usize, &f64)| {
        let heads: Vec<Vec<usize>> = climbed
            .chunks(loops.observers.len())
            .map(|pairs| pairs.iter().map(|levels| levels[level]).collect())
            .collect();
        let best = loops.by_ripple(&heads).first().map(|&observer| {
            let law = |(pool, heads): (usize, &Vec<usize>)| {
                let one = loops.at([pool, observer, heads[observer]])?;
                let pool = &loops.pools[pool];
                let name = pool.candidates[one.candidate].name.clone();
                Some(LawRipple { law: pool.law, name, ripple_n: one.ripple_n })
            };
            let laws = heads.iter().enumerate().filter_map(law).collect();
            LeastRipple { joint_noise_factor: loops.observers[observer].factor, laws }
        });
        FrontPoint { scale, best }
    };
    Ok(Front(scales.iter().enumerate().map(at).collect()))
}

/// The place of the loop with the least ripple at each scale, for every pair of a law and an observer. A loop that
/// falls at a smaller scale is not tried at a larger one.
fn climbed(
    loops: &CandidateLoops<'_>,
    scales: &[f64],
    progress: Progress<'_>,
) -> Result<Vec<Vec<usize>>, RobustError> {
    let corners: Vec<Vec<PlantModel<f64>>> =
        scales.iter().map(|&scale| loops.plants.corners(scale)).collect::<Result<_, DesignError>>()?;
    let pairs: Vec<[usize; 2]> = (0..loops.pools.len())
        .flat_map(|pool| (0..loops.observers.len()).map(move |one| [pool, one]))
        .collect();
    progress(ProgressStep::Begin("the front", pairs.len() as u64));
    let climb = |&[pool, observer]: &[usize; 2]| -> Result<Vec<usize>, RobustError> {
        let mut best = Vec::new();
        for place in 0..loops.ranked[pool][observer].len() {
            let at = [pool, observer, place];
            while best.len() < scales.len()
                && loops.is_stable(at, &corners[best.len()])?
                && loops.runs(at, scales[best.len()])?.holds
            {
                best.push(place);
            }
        }
        best.resize(scales.len(), NONE);
        progress(ProgressStep::Done);
        Ok(best)
    };
    parallel::try_map(&pairs, climb)
}
