//! The choice among the candidates.

use serde::Serialize;
use upright::table::Law;

use super::candidate::{Candidate, candidates, joint_noises};
use super::error::RobustError;
use super::judge::{JudgeSettings, Judgement, SHARES, judge, machine, one};
use super::linear::LinearPlants;
use crate::design::{Certified, DesignError, design};
use crate::parallel;
use crate::rig::{Rig, Tolerances};
use crate::study::Study;
use crate::table::{Gains, TableValues};
use crate::verify::{ControllerModel, PlantModel, Unverifiable, chain};

/// Multiples of the tolerances for which the front is made.
const SCALES: [f64; 5] = [0.25, 0.5, 1.0, 1.5, 2.0];
/// Length of the runs that sort out candidates (s).
const SHORT_RUN_S: f64 = 10.0;

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

/// What is chosen for one law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chosen {
    /// The law.
    pub law: Law,
    /// Its numbers.
    pub candidate: Candidate,
    /// Predicted rms of the force without imperfections (N).
    pub ripple_n: f64,
    /// The same for the numbers of the file (N); none if that loop is not stable.
    pub own_ripple_n: Option<f64>,
    /// The runs that it stood.
    pub judgement: Judgement,
}

/// The least ripple at each multiple of the tolerances, with the same joint noise for both laws.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Front(pub Vec<FrontPoint>);

/// One multiple of the tolerances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrontPoint {
    /// The multiple.
    pub scale: f64,
    /// The loops with the least ripple; none if nothing stands.
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
    /// What differs from the file.
    pub name: String,
    /// Predicted rms of the force (N).
    pub ripple_n: f64,
}

/// A law with the designs of its candidates.
struct Pool {
    law: Law,
    designs: Vec<(Candidate, Certified)>,
}

struct Observer {
    factor: f64,
    joint_noise: Vec<f64>,
    certified: Certified,
}

/// A stable loop of one law and one observer.
struct Ranked {
    design: usize,
    ripple_n: f64,
    controller: ControllerModel<f64>,
}

struct Search<'a> {
    rig: &'a Rig,
    tolerances: &'a Tolerances,
    settings: &'a JudgeSettings,
    plants: LinearPlants<'a>,
    pools: Vec<Pool>,
    observers: Vec<Observer>,
    /// For each pool and each observer: the stable loops, the least ripple first.
    ranked: Vec<Vec<Vec<Ranked>>>,
}

/// Chooses gains with the least ripple that stand `tolerances`; a front over multiples of them if `with_front`. `stage` is
/// told what is done next; there are 4 stages.
///
/// # Errors
/// [`RobustError::Unhelped`] with the reason if no candidate stands them.
pub fn choose(
    rig: &Rig,
    tolerances: &Tolerances,
    settings: &JudgeSettings,
    with_front: bool,
    stage: &dyn Fn(&'static str),
) -> Result<(Choice, Option<Front>), RobustError> {
    chain(rig, "tolerances")?;
    if rig.kalman.is_none() {
        return Err(Unverifiable::NoObserver.into());
    }
    if tolerances.each().all(|(_, _, value)| value == 0.0) {
        return Err(RobustError::NoTolerance);
    }
    if let Some((what, value, accepts)) = tolerances.too_large(rig.tick.period_s) {
        return Err(Unverifiable::Setting { what, value, accepts }.into());
    }
    stage("designing the candidates");
    let own = design(rig)?;
    let search = Search::new(rig, tolerances, settings, &own)?;
    stage("looking for the least ripple that stands");
    let choice = search.choice(stage)?;
    stage("the front");
    let front = with_front.then(|| search.front(&SCALES)).transpose()?;
    Ok((choice, front))
}

impl<'a> Search<'a> {
    fn new(
        rig: &'a Rig,
        tolerances: &'a Tolerances,
        settings: &'a JudgeSettings,
        own: &Certified,
    ) -> Result<Self, RobustError> {
        let plants = LinearPlants::of(rig, &own.double, tolerances, settings.disturbance)?;
        let mut pools = Vec::new();
        for law in Law::ALL {
            let alone = Rig { kalman: None, ..rig.with_law_alone(law) };
            let all = candidates(rig, law)?;
            // A candidate without a design is no candidate.
            let designed = parallel::map(&all, |one| {
                design(&one.applied(&alone)).ok().map(|certified| (one.clone(), certified))
            });
            let designed: Vec<_> = designed.into_iter().flatten().collect();
            if !designed.is_empty() {
                pools.push(Pool { law, designs: designed });
            }
        }
        let noises = joint_noises(rig.kalman.as_ref().map_or(&[][..], |kalman| &kalman.joint_noise));
        let observers = parallel::map(&noises, |(factor, joint_noise)| {
            let alone = Rig { lqr: None, pole_placement: None, integral: None, ..rig.clone() };
            let certified = design(&with_noise(&alone, joint_noise)).ok()?;
            Some(Observer { factor: *factor, joint_noise: joint_noise.clone(), certified })
        });
        let observers = observers.into_iter().flatten().collect();
        let mut search = Self { rig, tolerances, settings, plants, pools, observers, ranked: Vec::new() };
        let of_pool = |pool| parallel::map(&search.observers, |one| search.rank(pool, one));
        let ranked = search.pools.iter().map(of_pool).collect();
        search.ranked = ranked;
        Ok(search)
    }

    /// The stable loops of a law with an observer.
    fn rank(&self, pool: &Pool, observer: &Observer) -> Vec<Ranked> {
        let Some(kalman) = &observer.certified.double.kalman else { return Vec::new() };
        let loop_of = |(index, (_, certified)): (usize, &(Candidate, Certified))| {
            let controller = self.plants.controller(&certified.double, pool.law, kalman)?;
            let ripple_n = self.plants.ripple_n(&controller)?;
            Some(Ranked { design: index, ripple_n, controller })
        };
        let mut all: Vec<Ranked> = pool.designs.iter().enumerate().filter_map(loop_of).collect();
        all.sort_by(|a, b| a.ripple_n.total_cmp(&b.ripple_n));
        all
    }

    /// Predicted ripple of the file's own numbers (N).
    fn own_ripple_n(&self, pool: usize) -> Option<f64> {
        let own = self.ranked[pool].first()?.iter().find(|one| one.design == 0);
        own.map(|one| one.ripple_n)
    }

    /// Rig and table of a candidate with an observer.
    fn table(&self, pool: usize, observer: usize, design: usize) -> Option<(Rig, TableValues)> {
        let (pool, observer) = (&self.pools[pool], &self.observers[observer]);
        let (candidate, certified) = &pool.designs[design];
        let alone = candidate.applied(&self.rig.with_law_alone(pool.law));
        let rig = with_noise(&alone, &observer.joint_noise);
        let certified = observer.certified.clone().with_law_of(pool.law, certified);
        // A design without a table is no candidate.
        TableValues::of(&rig, &certified, Gains::Sampled).ok().map(|table| (rig, table))
    }

    /// Whether the linear loop holds every corner and a short run stands each share of the tolerances times `scale`.
    fn holds(&self, at: [usize; 3], scale: f64, corners: &[PlantModel<f64>]) -> Result<bool, RobustError> {
        let [pool, observer, place] = at;
        let one = &self.ranked[pool][observer][place];
        Ok(self.plants.holds(&one.controller, corners)? && self.runs_stand(at, scale)?)
    }

    fn runs_stand(&self, [pool, observer, place]: [usize; 3], scale: f64) -> Result<bool, RobustError> {
        let loop_ = &self.ranked[pool][observer][place];
        let Some((rig, table)) = self.table(pool, observer, loop_.design) else { return Ok(false) };
        let settings = JudgeSettings { duration_s: SHORT_RUN_S, ..*self.settings };
        let tolerances = self.tolerances.scaled(scale);
        // The largest share first: most candidates fall there, and early.
        for share in SHARES.into_iter().rev() {
            let real = machine(&rig, &tolerances, share);
            if !one(&real, &table, self.pools[pool].law, &settings, 1)?.stands {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The first loop from `place` on that holds.
    fn next(
        &self,
        [pool, observer, place]: [usize; 3],
        scale: f64,
        corners: &[PlantModel<f64>],
    ) -> Result<Option<usize>, RobustError> {
        for place in place..self.ranked[pool][observer].len() {
            if self.holds([pool, observer, place], scale, corners)? {
                return Ok(Some(place));
            }
        }
        Ok(None)
    }

    /// The pairs of a law and an observer.
    fn pairs(&self) -> Vec<[usize; 2]> {
        let observers = 0..self.observers.len();
        (0..self.pools.len()).flat_map(|pool| observers.clone().map(move |one| [pool, one])).collect()
    }

    fn choice(&self, stage: &dyn Fn(&'static str)) -> Result<Choice, RobustError> {
        let corners = self.plants.corners(1.0)?;
        let first = |&[pool, observer]: &[usize; 2]| self.next([pool, observer, 0], 1.0, &corners);
        let found: Vec<Option<usize>> = parallel::try_map(&self.pairs(), first)?;
        let mut heads: Vec<Vec<Option<usize>>> =
            found.chunks(self.observers.len()).map(<[_]>::to_vec).collect();
        stage("judging");
        loop {
            let Some(observer) = self.best(&heads) else {
                return Err(RobustError::Unhelped(self.reason(&corners)?));
            };
            match self.judged(observer, &heads)? {
                Ok(laws) => {
                    let Observer { factor, joint_noise, .. } = &self.observers[observer];
                    return Ok(Choice {
                        joint_noise_factor: *factor,
                        joint_noise: joint_noise.clone(),
                        laws,
                    });
                }
                Err(pool) => {
                    let after = heads[pool][observer].map_or(usize::MAX, |place| place + 1);
                    heads[pool][observer] = self.next([pool, observer, after], 1.0, &corners)?;
                }
            }
        }
    }

    /// The observer with which the ripple of all laws, each relative to that of the file, is least in sum.
    fn best(&self, heads: &[Vec<Option<usize>>]) -> Option<usize> {
        let sum = |observer: usize| {
            let ripple = |(pool, heads): (usize, &Vec<Option<usize>>)| {
                let own = self.own_ripple_n(pool).unwrap_or(1.0);
                heads[observer].map(|place| self.ranked[pool][observer][place].ripple_n / own)
            };
            heads.iter().enumerate().map(ripple).sum::<Option<f64>>()
        };
        let sums = (0..self.observers.len()).filter_map(|observer| Some((observer, sum(observer)?)));
        sums.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(observer, _)| observer)
    }

    /// The loops at `heads` with this observer in full, or the number of the first law whose loop falls.
    fn judged(
        &self,
        observer: usize,
        heads: &[Vec<Option<usize>>],
    ) -> Result<Result<Vec<Chosen>, usize>, RobustError> {
        let mut laws = Vec::new();
        for (pool, heads) in heads.iter().enumerate() {
            let Some(place) = heads[observer] else { return Ok(Err(pool)) };
            let loop_ = &self.ranked[pool][observer][place];
            let Some((rig, table)) = self.table(pool, observer, loop_.design) else { return Ok(Err(pool)) };
            let law = self.pools[pool].law;
            let judgement = judge(&rig, &table, law, self.tolerances, self.settings, &Study::whole())?;
            if !judgement.stands() {
                return Ok(Err(pool));
            }
            laws.push(Chosen {
                law,
                candidate: self.pools[pool].designs[loop_.design].0.clone(),
                ripple_n: loop_.ripple_n,
                own_ripple_n: self.own_ripple_n(pool),
                judgement,
            });
        }
        Ok(Ok(laws))
    }

    /// The loop with the least ripple at each scale, for every pair of a law and an observer. A loop that falls at a
    /// smaller scale is not tried at a larger one.
    fn climbed(&self, scales: &[f64]) -> Result<Vec<Vec<Option<usize>>>, RobustError> {
        let corners: Vec<Vec<PlantModel<f64>>> =
            scales.iter().map(|&scale| self.plants.corners(scale)).collect::<Result<_, DesignError>>()?;
        let climb = |&[pool, observer]: &[usize; 2]| -> Result<Vec<Option<usize>>, RobustError> {
            let mut best = Vec::new();
            for place in 0..self.ranked[pool][observer].len() {
                while best.len() < scales.len()
                    && self.holds([pool, observer, place], scales[best.len()], &corners[best.len()])?
                {
                    best.push(Some(place));
                }
            }
            best.resize(scales.len(), None);
            Ok(best)
        };
        parallel::try_map(&self.pairs(), climb)
    }

    fn front(&self, scales: &[f64]) -> Result<Front, RobustError> {
        let climbed = self.climbed(scales)?;
        let at = |(level, &scale): (usize, &f64)| {
            let heads: Vec<Vec<Option<usize>>> = climbed
                .chunks(self.observers.len())
                .map(|pairs| pairs.iter().map(|levels| levels[level]).collect())
                .collect();
            let best = self.best(&heads).map(|observer| {
                let law = |(pool, heads): (usize, &Vec<Option<usize>>)| {
                    let loop_ = &self.ranked[pool][observer][heads[observer]?];
                    let Pool { law, designs } = &self.pools[pool];
                    let name = designs[loop_.design].0.name.clone();
                    Some(LawRipple { law: *law, name, ripple_n: loop_.ripple_n })
                };
                let laws = heads.iter().enumerate().filter_map(law).collect();
                LeastRipple { joint_noise_factor: self.observers[observer].factor, laws }
            });
            FrontPoint { scale, best }
        };
        Ok(Front(scales.iter().enumerate().map(at).collect()))
    }

    /// Why no candidate stands the tolerances.
    fn reason(&self, corners: &[PlantModel<f64>]) -> Result<String, RobustError> {
        let mut reasons = Vec::new();
        for (pool, Pool { law, .. }) in self.pools.iter().enumerate() {
            let all = || {
                let ranked = self.ranked[pool].iter().enumerate();
                ranked.flat_map(|(observer, all)| (0..all.len()).map(move |place| [pool, observer, place]))
            };
            let count = all().count();
            let linear = |&[pool, observer, place]: &[usize; 3]| {
                self.plants.holds(&self.ranked[pool][observer][place].controller, corners)
            };
            let places: Vec<[usize; 3]> = all().collect();
            let stable: Vec<bool> = parallel::try_map(&places, linear)?;
            if !stable.contains(&true) {
                let percent = self.tolerances.mass_percent;
                reasons.push(format!(
                    "{law}: none of {count} loops is stable with every combination of masses wrong by {percent} %; \
                     weigh the parts"
                ));
                continue;
            }
            let stands = |at: &[usize; 3]| self.runs_stand(*at, 1.0);
            let stand: Vec<bool> = parallel::try_map(&places, stands)?;
            if !stand.contains(&true) {
                reasons.push(format!(
                    "{law}: none of {count} loops stands friction, zeros and latency within the limits; \
                     smaller bearings, better zeros or a longer rail"
                ));
            }
        }
        if reasons.is_empty() {
            reasons.push("no joint noise serves everything: masses, friction and both laws".to_owned());
        }
        let scales = [0.125, 0.25, 0.5, 0.75];
        let largest = self.front(&scales)?.0.into_iter().rev().find(|point| point.best.is_some());
        reasons.push(match largest {
            Some(FrontPoint { scale, .. }) => format!("{scale} times the tolerances is within reach"),
            None => "not even an eighth of the tolerances is within reach".to_owned(),
        });
        Ok(reasons.join("; "))
    }
}

fn with_noise(rig: &Rig, joint_noise: &[f64]) -> Rig {
    let mut rig = rig.clone();
    if let Some(kalman) = &mut rig.kalman {
        kalman.joint_noise = joint_noise.to_vec();
    }
    rig
}
