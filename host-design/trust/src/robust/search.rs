//! The search for the best candidates.

use serde::Serialize;
use upright::table::Law;

use super::candidate::Candidate;
use super::error::RobustError;
use super::front::{Front, SCALES, front};
use super::judge::{JudgeSettings, Judgement, judge};
use super::loops::{At, CandidateLoops};
use super::reason::reason;
use crate::verify::{PlantModel, VerifyError, chain};
use upright_design::design::design;
use upright_design::parallel::{self, Progress, ProgressStep};
use upright_design::rig::{Rig, Tolerances};
use upright_design::study::Study;
use upright_design::table::{Gains, TableValues};

/// Number of loops that are tried at the same time. It does not follow the number of processors, so that the same
/// loops are tried on every computer.
const TOGETHER: usize = 4;

/// The gains chosen for a rig and its tolerances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Choice {
    /// The chosen joint noise over that of the file.
    pub joint_noise_factor: f64,
    /// The chosen joint noise ((N·m)²·s), for both laws.
    pub joint_noise: Vec<f64>,
    /// One entry for each law that the rig asks for.
    pub laws: Vec<Chosen>,
}

/// The choice for one law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chosen {
    /// The law.
    pub law: Law,
    /// The chosen numbers.
    pub candidate: Candidate,
    /// Predicted rms of the force (N), or of the acceleration (m/s²), without imperfections.
    pub ripple_n: f64,
    /// The same with the numbers of the file; none if that loop is not stable.
    pub own_ripple_n: Option<f64>,
    /// The runs that it survived.
    pub judgement: Judgement,
}

/// Chooses the gains with the least ripple that survive `tolerances`; returns also a front over multiples of them if
/// `with_front`.
///
/// # Errors
/// [`RobustError::Unhelped`] with the reason if no candidate survives them; other errors if the rig or the
/// tolerances cannot be used.
pub fn choose(
    rig: &Rig,
    tolerances: &Tolerances,
    settings: &JudgeSettings,
    with_front: bool,
    progress: Progress<'_>,
) -> Result<(Choice, Option<Front>), RobustError> {
    chain(rig, "tolerances")?;
    if rig.kalman.is_none() {
        return Err(VerifyError::NoObserver.into());
    }
    if tolerances.each().all(|(_, _, value)| value == 0.0) {
        return Err(RobustError::NoTolerance);
    }
    if let Some((what, value, accepts)) = tolerances.too_large(rig.tick.period_s) {
        return Err(VerifyError::Setting { what, value, accepts }.into());
    }
    // Fault detection expects what is judged.
    let rig = &Rig { robust: Some(tolerances.clone()), ..rig.clone() };
    let own = design(rig)?;
    let loops = CandidateLoops::design(rig, tolerances, settings, &own, progress)?;
    let choice = Search { loops: &loops, tolerances, settings }.choice(progress)?;
    let front = with_front.then(|| front(&loops, &SCALES, progress)).transpose()?;
    Ok((choice, front))
}

struct Search<'a> {
    loops: &'a CandidateLoops<'a>,
    tolerances: &'a Tolerances,
    settings: &'a JudgeSettings,
}

impl Search<'_> {
    /// The loops with the least ripple that survive the tolerances, one of each law, with the same observer.
    ///
    /// `heads` has, for each law and observer, the place of the first loop that is not known to fall. The observer
    /// whose heads have the least total ripple comes first, so a loop is only tried if none with less ripple is left.
    fn choice(&self, progress: Progress<'_>) -> Result<Choice, RobustError> {
        let loops = self.loops;
        let corners = loops.plants.corners(1.0)?;
        let mut heads = vec![vec![0; loops.observers.len()]; loops.pools.len()];
        let trying = || {
            let count: usize = (0..loops.pools.len()).map(|pool| loops.of_pool(pool).count()).sum();
            progress(ProgressStep::Begin("trying the loops", count as u64));
        };
        trying();
        loop {
            let observers = loops.by_ripple(&heads);
            let Some(&best) = observers.first() else {
                return Err(RobustError::Unhelped(reason(loops, self.tolerances, progress)?));
            };
            if self.unknown(best, &heads).next().is_some() {
                let unknown = observers.iter().flat_map(|&observer| self.unknown(observer, &heads));
                self.try_all(&unknown.take(TOGETHER).collect::<Vec<_>>(), &corners, progress)?;
                self.skip_fallen(&mut heads);
                continue;
            }
            progress(ProgressStep::Begin("judging the choice", loops.pools.len() as u64));
            match self.judged(best, &heads, progress)? {
                Ok(laws) => {
                    let observer = &loops.observers[best];
                    return Ok(Choice {
                        joint_noise_factor: observer.factor,
                        joint_noise: observer.joint_noise.clone(),
                        laws,
                    });
                }
                Err(pool) => {
                    heads[pool][best] += 1;
                    self.skip_fallen(&mut heads);
                    trying();
                }
            }
        }
    }

    /// The heads of this observer that have not been tried.
    fn unknown<'h>(&'h self, observer: usize, heads: &'h [Vec<usize>]) -> impl Iterator<Item = At> + 'h {
        let at = move |(pool, heads): (usize, &Vec<usize>)| [pool, observer, heads[observer]];
        heads.iter().enumerate().map(at).filter(|&at| self.loops.known(at).is_none())
    }

    fn try_all(
        &self,
        all: &[At],
        corners: &[PlantModel<f64>],
        progress: Progress<'_>,
    ) -> Result<(), RobustError> {
        let one = |at: &At| -> Result<(), RobustError> {
            self.loops.trial(*at, corners)?;
            progress(ProgressStep::Done);
            Ok(())
        };
        parallel::try_map(all, one).map(|_: Vec<()>| ())
    }

    /// Moves each head past the loops that are known to fall.
    fn skip_fallen(&self, heads: &mut [Vec<usize>]) {
        for (pool, heads) in heads.iter_mut().enumerate() {
            for (observer, place) in heads.iter_mut().enumerate() {
                while self.loops.known([pool, observer, *place]).is_some_and(|trial| !trial.holds) {
                    *place += 1;
                }
            }
        }
    }

    /// Judges the loops at `heads` with this observer in full runs; returns the choices, or the index of the first law
    /// whose loop falls.
    fn judged(
        &self,
        observer: usize,
        heads: &[Vec<usize>],
        progress: Progress<'_>,
    ) -> Result<Result<Vec<Chosen>, usize>, RobustError> {
        let mut laws = Vec::new();
        for (pool, heads) in heads.iter().enumerate() {
            let at = [pool, observer, heads[observer]];
            let Some(one) = self.loops.at(at) else { return Ok(Err(pool)) };
            let rig = self.loops.rig_of(at);
            let table =
                design(&rig).ok().and_then(|found| TableValues::of(&rig, &found, Gains::Sampled).ok());
            let Some(table) = table else { return Ok(Err(pool)) };
            let law = self.loops.pools[pool].law;
            let judgement = judge(&rig, &table, law, self.tolerances, self.settings, &Study::whole())?;
            progress(ProgressStep::Done);
            if !judgement.survives() {
                return Ok(Err(pool));
            }
            laws.push(Chosen {
                law,
                candidate: self.loops.pools[pool].candidates[one.candidate].clone(),
                ripple_n: one.ripple_n,
                own_ripple_n: self.loops.own_ripple_n(pool),
                judgement,
            });
        }
        Ok(Ok(laws))
    }
}
