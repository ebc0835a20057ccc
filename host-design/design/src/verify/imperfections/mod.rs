//! The sizes at which the imperfections of a machine, each one alone, make the loop fall, and those at which the
//! firmware turns the motor off, beside their typical sizes.

mod catalogue;

use serde::Serialize;
use upright::table::Law;

use super::error::{VerifyError, chain, within};
use super::trial::{Disturbance, Horizon, Outcome, disturbed, trial};
use crate::number::significant;
use crate::parallel;
use crate::rig::{Reality, Rig};
use crate::simulate::{FallKind, Scenario, SimulationError};
use crate::table::TableValues;

pub use catalogue::{IMPERFECTIONS, Imperfection};

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
    /// Largest size tried.
    pub largest_tried: f64,
    /// Typical size in a poor machine over the smaller of both sizes: above 1 the imperfection is dangerous.
    pub danger: f64,
}

impl Survival {
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

/// Sizes are tried from this share of a good machine's to this multiple of a poor one's.
const RANGE: [f64; 2] = [1.0 / 64.0, 64.0];
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
    let one = |imperfection: &'static Imperfection| {
        let survival = search.survival(imperfection);
        done();
        survival
    };
    let mut alone: Vec<Survival> = parallel::try_map(&IMPERFECTIONS, one)?;
    alone.sort_by(|a, b| b.danger.total_cmp(&a.danger));
    let together = (rig.reality != Reality::default()).then(|| search.verdict(rig)).transpose()?;
    Ok(Imperfections { law, settings: *settings, alone, together })
}

/// Searches for one imperfection alone.
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
    Ok(SizeSearch { rig, table, law, settings }.survival(imperfection)?)
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

struct SizeSearch<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    law: Law,
    settings: &'a ImperfectionSettings,
}

impl SizeSearch<'_> {
    fn survival(&self, imperfection: &'static Imperfection) -> Result<Survival, SimulationError> {
        let [good, poor] = imperfection.typical;
        // Masses and lengths cannot be wrong by more than nine tenths.
        let most = if imperfection.key == "parameter_spread_percent" { 80.0 } else { f64::INFINITY };
        let sizes = [RANGE[0] * good, (RANGE[1] * poor).min(most)];
        let at = |size: f64, is_supervised: bool| -> Result<Option<FallKind>, SimulationError> {
            let real = imperfection.on(self.rig, size);
            for seed in 1..=self.settings.seeds {
                if let Some(fall) = self.run(&real, seed, is_supervised)?.fall {
                    return Ok(Some(fall.kind));
                }
            }
            Ok(None)
        };
        let relative = self.settings.relative;
        let falls_at = first(sizes, poor, relative, |size| at(size, false).map(|end| end.is_none()))?;
        let turned_off_at = first(sizes, poor, relative, |size| at(size, true).map(|end| end.is_none()))?;
        let ended_by = turned_off_at.map_or(Ok(None), |size| at(size, true))?;
        let least = falls_at.unwrap_or(sizes[1]).min(turned_off_at.unwrap_or(sizes[1]));
        Ok(Survival {
            imperfection,
            falls_at,
            turned_off_at,
            ended_by,
            largest_tried: sizes[1],
            danger: poor / least,
        })
    }

    fn run(&self, real: &Rig, seed: u64, is_supervised: bool) -> Result<Outcome, SimulationError> {
        let ImperfectionSettings { duration_s, disturbance, .. } = self.settings;
        let scenario =
            Scenario { is_supervised, ..disturbed(real, self.law, *duration_s, disturbance, seed) };
        trial(real, self.table, &scenario, &Horizon::default())
    }

    /// Runs of all seeds on a machine with this imperfection alone.
    fn alone(&self, imperfection: &Imperfection, size: f64) -> Result<SizeRuns, SimulationError> {
        self.verdict(&imperfection.on(self.rig, size))
    }

    /// Runs of all seeds on this machine, by the whole firmware and, where it turns the motor off, by the controller
    /// alone.
    fn verdict(&self, real: &Rig) -> Result<SizeRuns, SimulationError> {
        let one = |seed: u64| {
            let by_firmware = self.run(real, seed, true)?;
            let alone = match by_firmware.fall {
                Some(_) => self.run(real, seed, false)?,
                None => by_firmware.clone(),
            };
            Ok::<_, SimulationError>((by_firmware, alone))
        };
        let all: Vec<_> = parallel::try_map(1..=self.settings.seeds, one)?;
        let ended: Vec<FallKind> =
            all.iter().filter_map(|(by_firmware, _)| Some(by_firmware.fall.as_ref()?.kind)).collect();
        let largest = |of: fn(&Outcome) -> f64| all.iter().map(|(_, alone)| of(alone)).fold(0.0, f64::max);
        Ok(SizeRuns {
            survived: all.iter().filter(|(_, alone)| alone.survives()).count() as u64,
            stayed_on: self.settings.seeds - ended.len() as u64,
            ended_by: ended.first().copied(),
            peak_angle_rad: largest(|outcome| outcome.peak_angle_rad),
            peak_position_m: largest(|outcome| outcome.peak_error_m),
        })
    }
}

/// The first size that does not hold: searched from `start` by factors of 4, up if it holds and down if not, then by
/// bisection of the logarithm to within `relative`. None if even the largest holds; the smallest if that does not.
///
/// Small backlash and stiff belts take long to simulate, so the search does not begin with them.
fn first<E>(
    [smallest, largest]: [f64; 2],
    start: f64,
    relative: f64,
    mut holds: impl FnMut(f64) -> Result<bool, E>,
) -> Result<Option<f64>, E> {
    let (mut held, mut lost) = (None, None);
    let mut size = start.clamp(smallest, largest);
    while held.is_none() || lost.is_none() {
        if holds(size)? {
            held = Some(size);
            if size >= largest {
                return Ok(None);
            }
            size = (4.0 * size).min(largest);
        } else {
            lost = Some(size);
            if size <= smallest {
                return Ok(lost);
            }
            size = (0.25 * size).max(smallest);
        }
    }
    let (mut held, mut lost) = (held.unwrap_or(smallest), lost.unwrap_or(largest));
    while lost - held > relative * held {
        let middle = (held * lost).sqrt();
        if holds(middle)? { held = middle } else { lost = middle }
    }
    Ok(Some(lost))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_size_that_is_not_held_is_found() {
        for start in [0.01, 0.3, 2.0, 10.0] {
            let find = |edge: f64| first::<()>([0.01, 10.0], start, 0.01, |size| Ok(size < edge)).unwrap();
            assert!(find(0.5).is_some_and(|found| (0.5..0.505).contains(&found)));
            assert_eq!((find(20.0), find(0.001)), (None, Some(0.01)));
        }
    }
}
