//! Mass errors: every combination of too light and too heavy, and each mass alone.

use serde::Serialize;
use upright::table::Law;

use super::error::{VerifyError, chain, within};
use super::trial::{Horizon, Outcome, disturbed, edge, leaning, trial, trials};
use upright_design::parallel;
use upright_design::plant::LANES;
use upright_design::reality::first_mass;
use upright_design::rig::Rig;
use upright_design::simulate::{Disturbance, Scenario, SimulationError};
use upright_design::table::TableValues;

/// Conditions of the run in which every plant with mass errors has to survive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CornerSettings {
    /// Duration of the run (s).
    pub duration_s: f64,
    /// Its disturbances.
    pub disturbance: Disturbance,
    /// Initial angle of every link from the vertical (rad): the whole chain leans.
    pub tilt_rad: f64,
    /// Seed of the disturbances, the same in every run.
    pub seed: u64,
}

impl CornerSettings {
    /// 10 s from a lean of 0.5 mrad with the disturbances the rig file expects.
    pub fn of(rig: &Rig) -> Self {
        Self { duration_s: 10.0, disturbance: Disturbance::of(rig), tilt_rad: 5e-4, seed: 1 }
    }
}

/// A mass of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mass {
    /// The cart.
    Cart,
    /// This link, counted from 1.
    Link(usize),
}

impl core::fmt::Display for Mass {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Mass::Cart => f.write_str("cart"),
            Mass::Link(link) => write!(f, "link {link}"),
        }
    }
}

/// One combination of mass errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Corner {
    /// For the cart, unless its acceleration is imposed, and each link: +1 if the real mass is larger than in the rig
    /// file, -1 if smaller.
    pub signs: Vec<i8>,
    /// The outcome of the run.
    pub outcome: Outcome,
}

/// All combinations of masses that are wrong by the same percentage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Corners {
    /// Error of each mass (%).
    pub percent: f64,
    /// Number of corners: 2^(n+1) for n links, 2^n without the cart.
    pub corners: usize,
    /// Number of corners that survive.
    pub survived: usize,
    /// The corner that falls first; if none falls, that with the largest angle.
    pub weakest: Corner,
    /// The corners that do not survive.
    pub lost: Vec<Corner>,
}

/// With more links than this there are too many corners to try.
pub(super) const MOST_LINKS: usize = 9;

/// The rig with its masses, cart first, changed by `percent` times `factors`. An inertia given in the rig file stays;
/// a default one follows the mass.
pub fn wrong_masses(rig: &Rig, percent: f64, factors: &[f64]) -> Rig {
    let mut wrong = rig.clone();
    let change = |mass: &mut f64, factor: &f64| *mass *= 1.0 + 0.01 * percent * factor;
    if let (Some(chain), Some((cart, links))) = (wrong.chain_mut(), factors.split_first()) {
        chain.cart.mass_kg.iter_mut().for_each(|mass| change(mass, cart));
        chain.links.iter_mut().zip(links).for_each(|(link, factor)| change(&mut link.mass_kg, factor));
    }
    wrong
}

fn run_of(rig: &Rig, law: Law, settings: &CornerSettings) -> Scenario {
    Scenario {
        start: leaning(rig, &vec![settings.tilt_rad; rig.links()]),
        ..disturbed(rig, law, settings.duration_s, &settings.disturbance, settings.seed)
    }
}

/// Runs every combination of cart and link masses wrong by ±`percent`; the controller stays that of `table`.
///
/// # Errors
/// [`VerifyError`] for a model, a chain of more than 9 links, or runs that cannot be started.
pub fn corners(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    percent: f64,
    settings: &CornerSettings,
) -> Result<Corners, VerifyError> {
    let links = chain(rig, "masses")?.links.len();
    within("percent", percent, 0.0..=90.0, "0 to 90 %")?;
    within("links", links as f64, 1.0..=MOST_LINKS as f64, "a chain of at most 9 links")?;
    let (scenario, first) = (run_of(rig, law, settings), first_mass(rig));
    let signs = |mask: u32| -> Vec<i8> {
        (first..=links).map(|part| if mask >> (part - first) & 1 == 1 { 1 } else { -1 }).collect()
    };
    let batch = |masks: &[u32]| -> Result<Vec<Corner>, SimulationError> {
        let case = |&mask: &u32| {
            let factors: Vec<f64> =
                std::iter::repeat_n(0.0, first).chain(signs(mask).into_iter().map(f64::from)).collect();
            (wrong_masses(rig, percent, &factors), scenario.clone())
        };
        let outcomes = trials(table, &masks.iter().map(case).collect::<Vec<_>>(), &Horizon::default())?;
        let corner = |(&mask, outcome)| Corner { signs: signs(mask), outcome };
        Ok(masks.iter().zip(outcomes).map(corner).collect())
    };
    let masks: Vec<u32> = (0..2u32 << (links - first)).collect();
    let all = parallel::try_map_in_batches(&masks, LANES, batch)?;
    let mut weakest = &all[0];
    for corner in &all {
        if corner.outcome.is_worse_than(&weakest.outcome) {
            weakest = corner;
        }
    }
    let lost: Vec<Corner> = all.iter().filter(|corner| !corner.outcome.survives()).cloned().collect();
    Ok(Corners {
        percent,
        corners: all.len(),
        survived: all.len() - lost.len(),
        weakest: weakest.clone(),
        lost,
    })
}

/// The largest percentage, a multiple of `step` up to `largest` (%), at which all corners survive, by bisection over
/// those multiples; 0 if not even the first does.
///
/// # Errors
/// As [`corners`].
pub fn largest_percent(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &CornerSettings,
    step: f64,
    largest: f64,
) -> Result<f64, VerifyError> {
    within("largest", largest, 0.0..=90.0, "0 to 90 %")?;
    within("step", step, 0.01..=90.0, "0.01 to 90 %")?;
    let (mut held, mut lost) = (0, (largest / step).floor() as usize + 1);
    while lost - held > 1 {
        let middle = (held + lost) / 2;
        let found = corners(rig, table, law, step * middle as f64, settings)?;
        if found.lost.is_empty() { held = middle } else { lost = middle }
    }
    Ok(step * held as f64)
}

/// Tolerance of one mass when it alone is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MassTolerance {
    /// Which mass.
    pub mass: Mass,
    /// How much lighter than in the rig file it may be (%, at most 90).
    pub lighter_percent: f64,
    /// How much heavier than in the rig file it may be (%, at most 900).
    pub heavier_percent: f64,
}

impl MassTolerance {
    /// The smaller of both tolerances (%).
    pub fn percent(&self) -> f64 {
        self.lighter_percent.min(self.heavier_percent)
    }
}

/// The tolerance of each mass when it alone is wrong, by doubling from 0.1 % and bisection to a twentieth; the most
/// critical mass comes first.
///
/// # Errors
/// [`VerifyError`] for a model, or runs that cannot be started.
pub fn mass_tolerances(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &CornerSettings,
) -> Result<Vec<MassTolerance>, VerifyError> {
    let parts = chain(rig, "masses")?.links.len() + 1;
    let scenario = run_of(rig, law, settings);
    let tolerated = |(part, side, largest): (usize, f64, f64)| {
        let found = edge([0.1, largest], 0.05, |percent| {
            let factors: Vec<f64> = (0..parts).map(|other| if other == part { side } else { 0.0 }).collect();
            let outcome =
                trial(&wrong_masses(rig, percent, &factors), table, &scenario, &Horizon::default())?;
            Ok::<_, SimulationError>(outcome.survives().then_some(()))
        })?;
        Ok(found.map_or(0.0, |(percent, ())| percent))
    };
    let cases: Vec<(usize, f64, f64)> =
        (first_mass(rig)..parts).flat_map(|part| [(part, -1.0, 90.0), (part, 1.0, 900.0)]).collect();
    let found: Vec<f64> = parallel::try_map::<_, _, SimulationError>(cases, tolerated)?;
    let mass = |part: usize| if part == 0 { Mass::Cart } else { Mass::Link(part) };
    let mut tolerances: Vec<MassTolerance> = found
        .chunks_exact(2)
        .enumerate()
        .map(|(part, sides)| MassTolerance {
            mass: mass(first_mass(rig) + part),
            lighter_percent: sides[0],
            heavier_percent: sides[1],
        })
        .collect();
    tolerances.sort_by(|a, b| a.percent().total_cmp(&b.percent()));
    Ok(tolerances)
}
