//! The sizes at which the imperfections of a machine, each one alone, make the loop fall, and those at which the
//! firmware turns the motor off, beside their typical sizes.

mod catalogue;
mod cure;
mod search;

use serde::Serialize;
use upright::table::Law;

use super::error::{VerifyError, chain, within};
use super::trial::Disturbance;
use crate::number::significant;
use crate::parallel;
use crate::rig::{Reality, Rig};
use crate::simulate::{FallKind, SimulationError};
use crate::table::TableValues;

pub use catalogue::{IMPERFECTIONS, Imperfection};
use cure::Cures;
use search::SizeSearch;

/// Settings of the search for the sizes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImperfectionSettings {
    /// Duration of each run (s).
    pub duration_s: f64,
    /// Number of runs of each size, with the seeds from 1; all of them have to survive.
    pub seeds: u64,
    /// Disturbances of the runs.
    pub disturbance: Disturbance,
    /// Relative precision of a size.
    pub relative: f64,
}

impl ImperfectionSettings {
    /// 4 runs of 10 s with the disturbances the rig file expects, to a tenth.
    pub fn of(rig: &Rig) -> Self {
        Self { duration_s: 10.0, seeds: 4, disturbance: Disturbance::of(rig), relative: 0.1 }
    }
}

/// Results of the runs with one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizeRuns {
    /// Number of runs that the controller alone survives.
    pub survived: u64,
    /// Number of runs in which the whole firmware survives: neither its limits nor its fault detection turns the motor
    /// off.
    pub stayed_on: u64,
    /// How the first of the others ended.
    pub ended_by: Option<FallKind>,
    /// Largest angle of any link from the vertical in any run (rad).
    pub peak_angle_rad: f64,
    /// Largest distance of the cart from its set-point in any run (m).
    pub peak_position_m: f64,
}

/// How much of one imperfection alone a law survives.
#[derive(Debug, Clone, Serialize)]
pub struct Survival {
    /// The imperfection.
    pub imperfection: &'static Imperfection,
    /// Size from which a run of the controller alone falls; none: it survives the largest one tried.
    pub falls_at: Option<f64>,
    /// Size from which the whole firmware turns the motor off in a run; none: it stays on with the largest one tried.
    pub turned_off_at: Option<f64>,
    /// What ends the run of the whole firmware at that size.
    pub ended_by: Option<FallKind>,
    /// The best change of the rig file that was tried; none if none of them helps.
    pub cure: Option<Cure>,
    /// For joint friction, the sizes for each of the bristle lengths; the sizes above are the smaller ones.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bristles: Vec<OfBristle>,
    /// Largest size tried.
    pub largest_tried: f64,
    /// Typical size in a poor machine over the smaller of both sizes: above 1 the imperfection is dangerous.
    pub danger: f64,
}

/// A change of the rig file with which the motor stays on up to a larger size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cure {
    /// Key and value.
    pub change: String,
    /// Size from which the whole firmware then turns the motor off, or the largest one tried.
    pub turned_off_at: f64,
}

/// Sizes of joint friction that builds up over this angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OfBristle {
    /// The angle (rad): `presliding_rad` of `[reality]`.
    pub bristle_rad: f64,
    /// As in [`Survival`].
    pub falls_at: Option<f64>,
    /// As in [`Survival`].
    pub turned_off_at: Option<f64>,
}

impl Survival {
    /// What was found beside the sizes: the sizes for each bristle length, and the cure.
    pub fn remarks(&self) -> Vec<String> {
        let of_bristle = |of: &OfBristle| {
            let [falls, off] = [of.falls_at, of.turned_off_at].map(|size| self.size_text(size));
            let bristle = significant(of.bristle_rad, 2);
            format!("friction that builds up over {bristle} rad: falls at {falls}, motor off {off}")
        };
        let cure = match (&self.cure, self.turned_off_at) {
            (Some(Cure { change, turned_off_at }), _) => {
                Some(format!("with {change}: motor off {}", significant(*turned_off_at, 2)))
            }
            (None, Some(_)) => Some(format!("no cure found; tried: {}", cure::TRIED)),
            (None, None) => None,
        };
        self.bristles.iter().map(of_bristle).chain(cure).collect()
    }

    /// [`Self::falls_at`] as text.
    pub fn falls_text(&self) -> String {
        self.size_text(self.falls_at)
    }

    /// [`Self::turned_off_at`] as text.
    pub fn turned_off_text(&self) -> String {
        self.size_text(self.turned_off_at)
    }

    /// What ends the run of the whole firmware at that size, as text; empty if it stays on.
    pub fn ended_by_text(&self) -> String {
        self.ended_by.map_or(String::new(), |kind| kind.to_string())
    }

    fn size_text(&self, size: Option<f64>) -> String {
        size.map_or_else(|| format!("> {}", significant(self.largest_tried, 2)), |size| significant(size, 2))
    }
}

/// What a law survives: each imperfection alone, the most dangerous one first, and those of the rig file together.
#[derive(Debug, Clone, Serialize)]
pub struct Imperfections {
    /// The law in the loop.
    pub law: Law,
    /// Settings of the search.
    pub settings: ImperfectionSettings,
    /// Each imperfection alone.
    pub alone: Vec<Survival>,
    /// All imperfections of the rig file's `[reality]` together; none if it has none.
    pub together: Option<SizeRuns>,
}

impl SizeRuns {
    /// How many of `runs` survive, as text: the controller alone, too, if the firmware turns the motor off in some.
    pub fn text(&self, runs: u64) -> String {
        let Self { survived, stayed_on, peak_angle_rad, peak_position_m, .. } = self;
        let off = self.ended_by.map_or(String::new(), |kind| format!(" ({kind})"));
        let alone =
            if survived == stayed_on { String::new() } else { format!("; the controller alone {survived}") };
        format!(
            "{stayed_on} of {runs} survive{off}{alone}, up to {peak_angle_rad:.3} rad and {peak_position_m:.3} m"
        )
    }
}

/// A size that the loop has to survive according to `[verify]`, and the results of its runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RequiredSurvival {
    /// The key of the imperfection.
    pub key: &'static str,
    /// The requirement, with this key.
    pub requirement: &'static str,
    /// The required size.
    pub size: f64,
    /// Number of runs with this size.
    pub runs: u64,
    /// Results of these runs.
    pub verdict: SizeRuns,
}

/// Sizes at which a limit cycle is shown, as shares of the one at which the loop falls.
const SHARES: [f64; 7] = [1.0 / 32.0, 1.0 / 16.0, 0.125, 0.25, 0.5, 0.7, 0.9];

/// Searches for every imperfection alone the sizes at which `law` falls and at which the motor is turned off. `done` is
/// called after each imperfection, from any thread.
///
/// # Errors
/// [`VerifyError`] for a model, and if a run cannot be started.
pub fn imperfections(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &ImperfectionSettings,
    done: &(dyn Fn() + Sync),
) -> Result<Imperfections, VerifyError> {
    chain(rig, "imperfections")?;
    within("relative", settings.relative, 1e-3..=1.0, "a width from 0.001 to 1")?;
    let search = SizeSearch { rig, table, law, settings };
    let cures = Cures::of(rig, table, law)?;
    let one = |imperfection: &'static Imperfection| {
        let survival = search.survival(imperfection, &cures.of_imperfection(imperfection));
        done();
        survival
    };
    let mut alone: Vec<Survival> = parallel::try_map(&IMPERFECTIONS, one)?;
    alone.sort_by(|a, b| b.danger.total_cmp(&a.danger));
    let together = (rig.reality != Reality::default()).then(|| search.verdict(rig)).transpose()?;
    Ok(Imperfections { law, settings: *settings, alone, together })
}

/// Searches for the sizes of one imperfection alone, and for no cure.
///
/// # Errors
/// As [`imperfections()`].
pub fn survival(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &ImperfectionSettings,
    imperfection: &'static Imperfection,
) -> Result<Survival, VerifyError> {
    chain(rig, "imperfections")?;
    Ok(SizeSearch { rig, table, law, settings }.survival(imperfection, &[])?)
}

/// Runs `law` with the imperfections that it has to survive according to `[verify]`; empty if there are none.
///
/// # Errors
/// As [`imperfections()`].
pub fn required_imperfections(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &ImperfectionSettings,
) -> Result<Vec<RequiredSurvival>, VerifyError> {
    chain(rig, "imperfections")?;
    let latency_s = rig.verify.latency_s.unwrap_or_default();
    within("latency_s", latency_s, 0.0..=0.999 * rig.tick.period_s, "less than period_s")?;
    let search = SizeSearch { rig, table, law, settings };
    let required = |imperfection: &'static Imperfection| {
        let size = (imperfection.required)(&rig.verify)?;
        let Imperfection { key, requirement, .. } = *imperfection;
        let survival = |verdict| RequiredSurvival { key, requirement, size, runs: settings.seeds, verdict };
        Some(search.alone(imperfection, size).map(survival))
    };
    Ok(IMPERFECTIONS.iter().filter_map(required).collect::<Result<_, SimulationError>>()?)
}

/// The limit cycle as a function of the size of an imperfection: sizes below the one at which the loop falls, or below
/// the largest one tried, each with the results of its runs.
///
/// # Errors
/// As [`imperfections()`].
pub fn limit_cycle(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &ImperfectionSettings,
    survival: &Survival,
) -> Result<Vec<(f64, SizeRuns)>, VerifyError> {
    chain(rig, "imperfections")?;
    let search = SizeSearch { rig, table, law, settings };
    let end = survival.falls_at.unwrap_or(survival.largest_tried);
    let at = |share: f64| {
        let size = share * end;
        search.alone(survival.imperfection, size).map(|verdict| (size, verdict))
    };
    Ok(SHARES.into_iter().map(at).collect::<Result<_, SimulationError>>()?)
}
