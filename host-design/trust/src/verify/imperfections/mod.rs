//! The sizes at which the imperfections of a machine, each one alone, make the loop fall, and those at which the
//! firmware turns the motor off, beside their typical sizes.

mod cure;
mod search;
mod survival;

use upright::table::Law;

use super::error::{VerifyError, chain, within};
use cure::Cures;
pub(super) use search::first;
use search::{LARGEST_OF_TICK, Setpoint, SizeSearch};
use upright_design::parallel;
use upright_design::rig::{Imperfection, LargestSize, Reality, RequiredSize, Rig};
use upright_design::table::TableValues;

pub use survival::{
    BristleSurvival, Cure, ImperfectionSettings, Imperfections, LeftOut, RequiredSurvival, SizeRuns, Survival,
};

/// The requirement of all imperfections of the rig file.
const OF_REALITY: &str = "runs with the motor on, with all of [reality]";
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
    let mut alone: Vec<Survival> = parallel::try_map(Imperfection::all_of(rig), one)?;
    alone.sort_by(|a, b| b.danger.total_cmp(&a.danger));
    let together = (rig.reality != Reality::default().on(rig.base()))
        .then(|| search.verdict(rig, Setpoint::RestsAndMoves))
        .transpose()?;
    Ok(Imperfections { law, settings: *settings, alone, left_out: LeftOut::of(rig), together })
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
    SizeSearch { rig, table, law, settings }.survival(imperfection, &[])
}

/// Runs `law` with one imperfection alone, of this size, at rest.
///
/// # Errors
/// As [`imperfections()`].
pub fn of_size(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &ImperfectionSettings,
    imperfection: &Imperfection,
    size: f64,
) -> Result<SizeRuns, VerifyError> {
    chain(rig, "imperfections")?;
    SizeSearch { rig, table, law, settings }.alone(imperfection, size, Setpoint::Rests)
}

/// Runs `law` with the imperfections that it has to survive according to `[verify]`, and with the whole `[reality]` of
/// the rig file, at rest and with a set-point that moves; empty if there are none.
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
    let required = |&(imperfection, size): &RequiredSize| {
        let Imperfection { key, requirement, .. } = *imperfection;
        if imperfection.largest == LargestSize::Tick {
            within(key, size, 0.0..=LARGEST_OF_TICK * rig.tick.period_s, "less than period_s")?;
        }
        let verdict = search.alone(imperfection, size, Setpoint::RestsAndMoves)?;
        Ok(RequiredSurvival { key, requirement, size: Some(size), verdict })
    };
    let of_reality = || {
        let verdict = search.verdict(rig, Setpoint::RestsAndMoves)?;
        Ok(RequiredSurvival { key: "reality", requirement: OF_REALITY, size: None, verdict })
    };
    let whole = (rig.reality != Reality::default().on(rig.base())).then(of_reality);
    rig.must_survive.iter().map(required).chain(whole).collect::<Result<_, VerifyError>>()
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
        search.alone(survival.imperfection, size, Setpoint::Rests).map(|verdict| (size, verdict))
    };
    SHARES.into_iter().map(at).collect::<Result<_, VerifyError>>()
}
