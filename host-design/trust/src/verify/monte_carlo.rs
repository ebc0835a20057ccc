//! Monte Carlo: many runs with random errors in all parameters at once.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use upright::table::Law;

use super::error::{VerifyError, within};
use super::trial::{Horizon, Outcome, disturbed, leaning, trials};
use upright_design::plant::LANES;
use upright_design::rig::{Chain, Rig};
use upright_design::simulate::{Disturbance, Scenario};
use upright_design::study::Study;
use upright_design::table::TableValues;

/// Size of the Monte Carlo part.
#[derive(Debug, Clone, Copy)]
pub struct Effort<'a> {
    /// Monte Carlo runs for each law.
    pub runs: usize,
    /// Seed of the first of them.
    pub seed: u64,
    /// Share of the runs with one tick more delay than designed for.
    pub late: f64,
    /// Whether the runs are made here, or split over processes.
    pub study: &'a Study,
}

/// How random plants are drawn for `rig`: by its `[verify]`, a share `late` of them with one more tick of delay.
pub fn spread(rig: &Rig, late: f64) -> Spread {
    let share = rig.verify.spread_percent / 100.0;
    Spread { mass: share, length: share, inertia: share, other_delay: late, ..Spread::of(rig) }
}

/// The ranges from which each run's plant and start are drawn, uniformly. A share of 0.02 means from -2 % to +2 %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Range of the cart's and each link's mass.
    pub mass: f64,
    /// Range of each link's length; its centre of mass is scaled with it.
    pub length: f64,
    /// Range of each link's inertia, beyond what follows from mass and length (m l²).
    pub inertia: f64,
    /// Range of the cart's and each joint's friction.
    pub friction: f64,
    /// Share of runs in which the force acts one tick later than the table was designed for (0 to 1); a rig designed
    /// for one tick of delay then has none.
    pub other_delay: f64,
    /// Each link starts with an angle from the vertical within ± this (rad).
    pub tilt_rad: f64,
    /// Disturbances in every run.
    pub disturbance: Disturbance,
    /// Duration of a run (s).
    pub duration_s: f64,
}

impl Spread {
    /// ±2 % of masses, lengths and inertia, ±20 % of friction, the disturbances that the rig file expects, and a start
    /// within ±0.5 mrad.
    pub fn of(rig: &Rig) -> Self {
        Self {
            mass: 0.02,
            length: 0.02,
            inertia: 0.02,
            friction: 0.2,
            other_delay: 0.0,
            tilt_rad: 5e-4,
            disturbance: Disturbance::of(rig),
            duration_s: 10.0,
        }
    }
}

/// The worst run: the first to fall, or, if none falls, that with the largest angle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorstCase {
    /// Seed with which [`sample`] returns its plant and scenario.
    pub seed: u64,
    /// Its outcome.
    pub outcome: Outcome,
}

/// Outcome of many runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonteCarlo {
    /// Seed of the first run; each following run has the next one.
    pub base_seed: u64,
    /// Number of runs made.
    pub runs: usize,
    /// Number of runs without a fall.
    pub survived: usize,
    /// Share of runs without a fall.
    pub success_rate: f64,
    /// 95 % confidence interval of the success rate (Wilson).
    pub interval: [f64; 2],
    /// The worst run; none if there was no run.
    pub worst: Option<WorstCase>,
}

/// Plant and scenario of the run with this seed.
///
/// Masses and lengths are drawn first.
pub fn sample(rig: &Rig, law: Law, spread: &Spread, seed: u64) -> (Rig, Scenario) {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut between = |share: f64| share * random.random_range(-1.0..=1.0);
    let mut drawn = rig.clone();
    if let Some(chain) = drawn.chain_mut() {
        draw_chain(chain, spread, &mut between);
    }
    let angles: Vec<f64> = (0..rig.links()).map(|_| between(spread.tilt_rad)).collect();
    if 0.5 * (1.0 + between(1.0)) < spread.other_delay {
        drawn.tick.delay_ticks = 1 - drawn.tick.delay_ticks.min(1);
    }
    let mut scenario = disturbed(rig, law, spread.duration_s, &spread.disturbance, seed);
    if rig.links() > 0 {
        scenario.start = leaning(rig, &angles);
    }
    (drawn, scenario)
}

fn draw_chain(chain: &mut Chain, spread: &Spread, between: &mut impl FnMut(f64) -> f64) {
    let factor = 1.0 + between(spread.mass);
    chain.cart.mass_kg = chain.cart.mass_kg.map(|mass| factor * mass);
    chain.cart.friction_n_s_per_m *= 1.0 + between(spread.friction);
    for link in &mut chain.links {
        let (mass, length) = (1.0 + between(spread.mass), 1.0 + between(spread.length));
        link.scale(mass, length, 1.0 + between(spread.inertia));
        link.friction_n_m_s_per_rad *= 1.0 + between(spread.friction);
    }
}

/// Runs with the seeds from `effort.seed` on, a part of `study`, on all threads; the outcome does not depend on their
/// number. `done` is called after each run, from any thread.
///
/// # Errors
/// [`VerifyError`] if a run cannot be started or a setting is invalid.
pub fn monte_carlo(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    spread: &Spread,
    effort: &Effort<'_>,
    done: &(dyn Fn() + Sync),
) -> Result<MonteCarlo, VerifyError> {
    for (what, share) in [
        ("mass", spread.mass),
        ("length", spread.length),
        ("inertia", spread.inertia),
        ("friction", spread.friction),
    ] {
        within(what, share, 0.0..=0.9, "a share from 0 to 0.9")?;
    }
    within("other_delay", spread.other_delay, 0.0..=1.0, "a share from 0 to 1")?;
    within("tilt_rad", spread.tilt_rad, 0.0..=1.5, "an angle from 0 to 1.5 rad")?;
    let &Effort { runs, seed: base_seed, study, .. } = effort;
    let batch = |numbers: &[u64]| -> Result<Vec<WorstCase>, VerifyError> {
        let seeds: Vec<u64> = numbers.iter().map(|number| base_seed.wrapping_add(*number)).collect();
        let cases: Vec<(Rig, Scenario)> = seeds.iter().map(|&seed| sample(rig, law, spread, seed)).collect();
        let outcomes = trials(table, &cases, &Horizon::default())?;
        seeds.iter().for_each(|_| done());
        Ok(seeds.into_iter().zip(outcomes).map(|(seed, outcome)| WorstCase { seed, outcome }).collect())
    };
    let all = study.outcomes_in_batches(law.key(), runs as u64, LANES, batch)?;
    let runs = all.len();
    let survived = all.iter().filter(|case| case.outcome.survives()).count();
    Ok(MonteCarlo {
        base_seed,
        runs,
        survived,
        success_rate: survived as f64 / runs.max(1) as f64,
        interval: wilson(survived, runs),
        worst: all
            .into_iter()
            .reduce(|worst, case| if case.outcome.is_worse_than(&worst.outcome) { case } else { worst }),
    })
}

impl MonteCarlo {
    /// If these runs cannot decide whether at least this share survives, because it lies within their interval: the
    /// fewest runs that could show that it does, with as many falls.
    pub fn fewest_to_decide(&self, share: f64) -> Option<usize> {
        let [low, high] = self.interval;
        (low < share && share <= high).then(|| fewest_runs(self.runs - self.survived, share))
    }
}

/// The fewest runs of which the lower end of the 95 % interval reaches `share` (below 1) if `lost` of them fail.
pub fn fewest_runs(lost: usize, share: f64) -> usize {
    let is_enough = |runs: usize| wilson(runs.saturating_sub(lost), runs)[0] >= share;
    let (mut few, mut enough) = (lost, lost + 1);
    while !is_enough(enough) {
        (few, enough) = (enough, 2 * enough);
    }
    while enough - few > 1 {
        let middle = few + (enough - few) / 2;
        if is_enough(middle) { enough = middle } else { few = middle }
    }
    enough
}

/// The 95 % confidence interval of a share of which `successes` of `runs` were seen, after E. B. Wilson, "Probable
/// inference, the law of succession, and statistical inference", J. Am. Stat. Assoc. 22 (1927) 209-212. It does not
/// shrink to a point when every run succeeds.
pub fn wilson(successes: usize, runs: usize) -> [f64; 2] {
    if runs == 0 {
        return [0.0, 1.0];
    }
    // 95 % of the normal distribution lie within ± this many standard deviations.
    const Z: f64 = 1.959963984540054;
    let (n, share) = (runs as f64, successes as f64 / runs as f64);
    let z2 = Z * Z / n;
    let centre = (share + 0.5 * z2) / (1.0 + z2);
    let half = Z * (share * (1.0 - share) / n + 0.25 * z2 / n).sqrt() / (1.0 + z2);
    // If all or none succeed, the bound is exactly 1 or 0, which rounding would miss.
    let low = if successes == 0 { 0.0 } else { centre - half };
    let high = if successes == runs { 1.0 } else { centre + half };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilsons_interval_has_its_known_values() {
        // R: binom::binom.confint(x, n, methods = "wilson")
        let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
        assert!(close(wilson(8, 10), [0.490162, 0.943318]), "{:?}", wilson(8, 10));
        assert!(close(wilson(10, 10), [0.722467, 1.0]), "{:?}", wilson(10, 10));
        assert!(close(wilson(0, 10), [0.0, 0.277533]), "{:?}", wilson(0, 10));
    }

    #[test]
    fn the_fewest_runs_are_the_first_whose_lower_bound_reaches_the_share() {
        for (lost, share, fewest) in [(0, 0.95, 73), (0, 0.93, 52), (0, 0.99, 381)] {
            assert_eq!(fewest_runs(lost, share), fewest);
        }
        for (lost, share) in [(0, 0.5), (1, 0.95), (10, 0.95), (3, 0.7)] {
            let fewest = fewest_runs(lost, share);
            assert!(wilson(fewest - lost, fewest)[0] >= share, "{lost} {share}");
            assert!(wilson(fewest - lost - 1, fewest - 1)[0] < share, "{lost} {share}");
        }
    }

    #[test]
    fn runs_decide_if_the_share_is_outside_of_their_interval() {
        let of = |survived: usize, runs: usize| MonteCarlo {
            base_seed: 1,
            runs,
            survived,
            success_rate: survived as f64 / runs as f64,
            interval: wilson(survived, runs),
            worst: None,
        };
        assert_eq!(of(20, 20).fewest_to_decide(0.95), Some(73));
        assert_eq!((of(73, 73).fewest_to_decide(0.95), of(200, 200).fewest_to_decide(0.95)), (None, None));
        // Clearly too many falls are decided, some falls are not.
        assert_eq!((of(10, 20).fewest_to_decide(0.95), of(0, 1).fewest_to_decide(0.95)), (None, None));
        assert!(of(190, 200).fewest_to_decide(0.95).is_some_and(|fewest| fewest > 200));
    }
}
