//! The loops of all candidates, sorted by predicted ripple, and what they survive.

use std::sync::OnceLock;

use upright::table::Law;

use super::candidate::{Candidate, candidates, joint_noises};
use super::error::RobustError;
use super::judge::{JudgeSettings, SHARES, one};
use super::linear::LinearPlants;
use crate::verify::{ControllerModel, PlantModel};
use upright_design::design::{Certified, Uncertified};
use upright_design::parallel::{self, Progress, ProgressStep};
use upright_design::reality::tolerated_machine;
use upright_design::rig::{Rig, Tolerances};
use upright_design::table::TableValues;

/// Duration of the short runs that eliminate candidates (s).
const SHORT_RUN_S: f64 = 10.0;

/// Position of a loop: index of its pool, index of its observer, and place in their list of ranked loops.
pub(super) type At = [usize; 3];

/// A law with its candidates.
pub(super) struct Pool {
    pub(super) law: Law,
    pub(super) candidates: Vec<Candidate>,
    designs: Vec<Option<Uncertified>>,
}

pub(super) struct CandidateObserver {
    pub(super) factor: f64,
    pub(super) joint_noise: Vec<f64>,
    design: Uncertified,
}

/// A stable loop of one law and one observer.
pub(super) struct Ranked {
    /// Number of the candidate.
    pub(super) candidate: usize,
    pub(super) ripple_n: f64,
    controller: ControllerModel<f64>,
    /// What it survives of the full tolerances; empty until it is tried.
    trial: OnceLock<LoopTrial>,
}

/// What a loop survives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoopTrial {
    /// Whether its linear loop is stable, with a margin, at every combination of wrong masses.
    pub(super) is_stable: bool,
    /// Total time for which it survived in the short runs (s). A loop that is not stable is not run.
    pub(super) survived_s: f64,
    /// Whether it survived in all short runs.
    pub(super) holds: bool,
}

pub(super) struct CandidateLoops<'a> {
    rig: &'a Rig,
    tolerances: &'a Tolerances,
    settings: &'a JudgeSettings,
    pub(super) plants: LinearPlants<'a>,
    pub(super) pools: Vec<Pool>,
    pub(super) observers: Vec<CandidateObserver>,
    /// For each pool and each observer: the stable loops, the least ripple first.
    pub(super) ranked: Vec<Vec<Vec<Ranked>>>,
}

impl<'a> CandidateLoops<'a> {
    /// Designs every candidate, without certification, and sorts the loops.
    pub(super) fn design(
        rig: &'a Rig,
        tolerances: &'a Tolerances,
        settings: &'a JudgeSettings,
        own: &Certified,
        progress: Progress<'_>,
    ) -> Result<Self, RobustError> {
        let plants = LinearPlants::new(rig, &own.double, tolerances, settings.disturbance)?;
        let of_law = |law| Ok((law, candidates(rig, law)?));
        let of_laws: Vec<(Law, Vec<Candidate>)> =
            Law::ALL.map(of_law).into_iter().collect::<Result<_, RobustError>>()?;
        let noises = joint_noises(rig.kalman.as_ref().map_or(&[][..], |kalman| &kalman.joint_noise));
        let count = noises.len() + of_laws.iter().map(|(_, all)| all.len()).sum::<usize>();
        progress(ProgressStep::Begin("designing the candidates", count as u64));
        let designed = |rig: &Rig| {
            // A candidate without a design is left out.
            let design = Uncertified::sampled_alone(rig).ok();
            progress(ProgressStep::Done);
            design
        };
        let pool = |(law, candidates): (Law, Vec<Candidate>)| {
            let designs = parallel::map(&candidates, |one| designed(&law_alone(rig, law, one)));
            Pool { law, candidates, designs }
        };
        let pools =
            of_laws.into_iter().map(pool).filter(|pool| pool.designs.iter().any(Option::is_some)).collect();
        let observers = parallel::map(&noises, |(factor, joint_noise)| {
            let design = designed(&observer_alone(rig, joint_noise))?;
            Some(CandidateObserver { factor: *factor, joint_noise: joint_noise.clone(), design })
        });
        let observers = observers.into_iter().flatten().collect();
        let mut loops = Self { rig, tolerances, settings, plants, pools, observers, ranked: Vec::new() };
        progress(ProgressStep::Begin(
            "sorting the loops",
            (loops.pools.len() * loops.observers.len()) as u64,
        ));
        let of_pool = |pool| {
            parallel::map(&loops.observers, |one| {
                let ranked = loops.rank(pool, one);
                progress(ProgressStep::Done);
                ranked
            })
        };
        loops.ranked = loops.pools.iter().map(of_pool).collect();
        Ok(loops)
    }

    /// The stable loops of a law with an observer.
    fn rank(&self, pool: &Pool, observer: &CandidateObserver) -> Vec<Ranked> {
        let Some(kalman) = &observer.design.double.kalman else { return Vec::new() };
        let loop_of = |(candidate, design): (usize, &Option<Uncertified>)| {
            let controller = self.plants.controller(&design.as_ref()?.double, pool.law, kalman)?;
            let ripple_n = self.plants.ripple_n(&controller)?;
            Some(Ranked { candidate, ripple_n, controller, trial: OnceLock::new() })
        };
        let mut all: Vec<Ranked> = pool.designs.iter().enumerate().filter_map(loop_of).collect();
        all.sort_by(|a, b| a.ripple_n.total_cmp(&b.ripple_n));
        all
    }

    pub(super) fn at(&self, [pool, observer, place]: At) -> Option<&Ranked> {
        self.ranked[pool][observer].get(place)
    }

    /// Predicted ripple of the file's own numbers (N).
    pub(super) fn own_ripple_n(&self, pool: usize) -> Option<f64> {
        let own = self.ranked[pool].first()?.iter().find(|one| one.candidate == 0);
        own.map(|one| one.ripple_n)
    }

    /// Positions of all loops of a law.
    pub(super) fn of_pool(&self, pool: usize) -> impl Iterator<Item = At> {
        let ranked = self.ranked[pool].iter().enumerate();
        ranked.flat_map(move |(observer, all)| (0..all.len()).map(move |place| [pool, observer, place]))
    }

    /// The rig with the numbers of a loop.
    pub(super) fn rig_of(&self, [pool, observer, place]: At) -> Rig {
        let candidate = self.ranked[pool][observer][place].candidate;
        let pool = &self.pools[pool];
        let alone = pool.candidates[candidate].applied(&self.rig.with_law_alone(pool.law));
        with_noise(&alone, &self.observers[observer].joint_noise)
    }

    /// The table for the trials of a loop; none if no table can be made.
    fn trial_table(&self, rig: &Rig, [pool, observer, place]: At) -> Option<TableValues> {
        let candidate = self.ranked[pool][observer][place].candidate;
        let (pool, observer) = (&self.pools[pool], &self.observers[observer]);
        let law = pool.designs[candidate].as_ref()?;
        let both = observer.design.clone().with_law_of(pool.law, law);
        TableValues::of_uncertified(rig, &both).ok()
    }

    /// What this loop survives of the full tolerances; `corners` are the plants with their combinations of wrong
    /// masses. It is tried only once.
    pub(super) fn trial(&self, at: At, corners: &[PlantModel<f64>]) -> Result<LoopTrial, RobustError> {
        let [pool, observer, place] = at;
        let one = &self.ranked[pool][observer][place];
        if let Some(known) = one.trial.get() {
            return Ok(*known);
        }
        let trial = match self.is_stable(at, corners)? {
            true => self.runs(at, 1.0)?,
            false => LoopTrial { is_stable: false, survived_s: 0.0, holds: false },
        };
        Ok(*one.trial.get_or_init(|| trial))
    }

    /// The result of [`trial`](Self::trial), if it was made.
    pub(super) fn known(&self, [pool, observer, place]: At) -> Option<LoopTrial> {
        self.ranked[pool][observer].get(place)?.trial.get().copied()
    }

    /// Whether the linear loop is stable, with a margin, with each of these plants.
    pub(super) fn is_stable(
        &self,
        [pool, observer, place]: At,
        corners: &[PlantModel<f64>],
    ) -> Result<bool, RobustError> {
        Ok(self.plants.holds(&self.ranked[pool][observer][place].controller, corners)?)
    }

    /// Short runs with each share of `scale` times the tolerances, up to the first that falls.
    pub(super) fn runs(&self, at: At, scale: f64) -> Result<LoopTrial, RobustError> {
        let mut trial = LoopTrial { is_stable: true, survived_s: 0.0, holds: false };
        let tolerances = self.tolerances.scaled(scale);
        let rig = Rig { robust: Some(tolerances.clone()), ..self.rig_of(at) };
        let Some(table) = self.trial_table(&rig, at) else { return Ok(trial) };
        let settings = JudgeSettings { duration_s: SHORT_RUN_S, ..*self.settings };
        // The largest share first: most candidates fall there, and early.
        for share in SHARES.into_iter().rev() {
            let real = tolerated_machine(&rig, &tolerances, share);
            let outcome = one(&real, &table, self.pools[at[0]].law, &settings, 1)?;
            trial.survived_s += outcome.survived_s;
            if outcome.ended_by.is_some() {
                return Ok(trial);
            }
        }
        Ok(LoopTrial { holds: true, ..trial })
    }

    /// The observers in ascending order of the total ripple of all laws, each relative to that of the file's own
    /// numbers. `heads` are the places of the loops; an observer that has no loop left for a law is left out.
    pub(super) fn by_ripple(&self, heads: &[Vec<usize>]) -> Vec<usize> {
        let sum = |observer: usize| {
            let ripple = |(pool, heads): (usize, &Vec<usize>)| {
                let own = self.own_ripple_n(pool).unwrap_or(1.0);
                self.at([pool, observer, heads[observer]]).map(|one| one.ripple_n / own)
            };
            heads.iter().enumerate().map(ripple).sum::<Option<f64>>()
        };
        let mut sums: Vec<(usize, f64)> =
            (0..self.observers.len()).filter_map(|observer| Some((observer, sum(observer)?))).collect();
        sums.sort_by(|a, b| a.1.total_cmp(&b.1));
        sums.into_iter().map(|(observer, _)| observer).collect()
    }
}

/// The rig with the numbers of this candidate, without observer.
fn law_alone(rig: &Rig, law: Law, candidate: &Candidate) -> Rig {
    candidate.applied(&Rig { kalman: None, ..rig.with_law_alone(law) })
}

/// The rig with this joint noise, without control law.
fn observer_alone(rig: &Rig, joint_noise: &[f64]) -> Rig {
    with_noise(&Rig { lqr: None, pole_placement: None, integral: None, ..rig.clone() }, joint_noise)
}

fn with_noise(rig: &Rig, joint_noise: &[f64]) -> Rig {
    let mut rig = rig.clone();
    if let Some(kalman) = &mut rig.kalman {
        kalman.joint_noise = joint_noise.to_vec();
    }
    rig
}
