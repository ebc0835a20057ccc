//! Designs and simulates a rig for one row of the comparison.

use serde::Serialize;
use upright::table::Law;

use super::row::{ComparedRow, Fate, LawFigures};
use upright_design::design::{Certified, DesignPoles, Poles, design};
use upright_design::parallel;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, SimulationError, Summary, simulate};
use upright_design::table::{Gains, TableValues};
use upright_trust::verify::{AttractionSettings, Margins, largest_tilts, margins_of};

/// A rig to compare, and the value of the swept key in it.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedRig {
    /// Name in the table; different for each rig file.
    pub label: String,
    /// The rig, with the value of the swept key.
    pub rig: Rig,
    /// Value of the swept key; `None` without a sweep.
    pub value: Option<f64>,
}

/// Conditions under which every candidate is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ComparedConditions {
    /// Step of the set-point (m, or the unit of a model's output).
    pub step_m: f64,
    /// Duration of the run (s).
    pub duration_s: f64,
    /// Give the controller the whole state, whether or not the rig asks for an observer.
    pub full_state: bool,
    /// Apply the set-point as a step, without the governor.
    pub raw_step: bool,
    /// Use the gains designed in continuous time instead of those designed for the tick.
    pub continuous_gains: bool,
    /// Only this law.
    #[serde(skip)]
    pub law: Option<Law>,
}

impl Default for ComparedConditions {
    /// A step of 0.1 m in a run of 10 s; everything else is as in the rig file.
    fn default() -> Self {
        Self {
            step_m: 0.1,
            duration_s: 10.0,
            full_state: false,
            raw_step: false,
            continuous_gains: false,
            law: None,
        }
    }
}

/// Relative precision of the largest tilt: enough for a table.
const TILT_PRECISION: f64 = 0.02;

/// Each law that a candidate asks for, in the order of the rows of [`compare`].
pub fn jobs<'a>(
    candidates: &'a [ComparedRig],
    conditions: &ComparedConditions,
) -> Vec<(&'a ComparedRig, Law)> {
    let asked = |candidate: &ComparedRig, law: Law| match law {
        Law::Lqr => candidate.rig.lqr.is_some(),
        Law::PolePlacement => candidate.rig.pole_placement.is_some(),
    };
    let wanted = |law: &Law| conditions.law.is_none_or(|only| only == *law);
    Law::ALL
        .into_iter()
        .filter(wanted)
        .flat_map(|law| candidates.iter().filter(move |one| asked(one, law)).map(move |one| (one, law)))
        .collect()
}

/// Computes all rows, in parallel, ordered by law; `done` is called after each.
///
/// # Errors
/// [`SimulationError`] if a run cannot be simulated, for example because it is too long.
pub fn compare(
    candidates: &[ComparedRig],
    conditions: &ComparedConditions,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<ComparedRow>, SimulationError> {
    parallel::try_map(jobs(candidates, conditions), |(candidate, law)| {
        let row = row(candidate, law, conditions);
        done();
        row
    })
}

fn row(
    candidate: &ComparedRig,
    law: Law,
    conditions: &ComparedConditions,
) -> Result<ComparedRow, SimulationError> {
    let mut rig = candidate.rig.with_law_alone(law);
    if conditions.full_state {
        rig.kalman = None;
    }
    let row = ComparedRow {
        rig: candidate.label.clone(),
        input: rig.actuator.input(),
        base: rig.base(),
        value: candidate.value,
        law,
        fate: Fate::Survived,
        figures: None,
        trace: None,
    };
    let (certified, poles, table) = match designed(&rig, conditions) {
        Ok(designed) => designed,
        Err(reason) => return Ok(ComparedRow { fate: Fate::NoDesign(reason), ..row }),
    };
    let scenario = Scenario {
        step_m: conditions.step_m,
        duration_s: conditions.duration_s,
        ..Scenario::at_rest(&rig, law)
    };
    let (trace, summary) = simulate(&rig, &table, &scenario)?;
    let figures = figures(&rig, law, &certified, &table, &summary, poles.in_table(law)[0]);
    let fate = match summary.fall {
        Some(fall) => Fate::Fallen(fall),
        None if summary.settled => Fate::Settled,
        None => Fate::Survived,
    };
    Ok(ComparedRow { fate, figures: Some(figures), trace: Some(trace), ..row })
}

/// Design, its poles, and table, or the reason why there is none.
fn designed(
    rig: &Rig,
    conditions: &ComparedConditions,
) -> Result<(Certified, DesignPoles, TableValues), String> {
    let gains = if conditions.continuous_gains { Gains::Continuous } else { Gains::Sampled };
    let certified = design(rig).map_err(|reason| reason.to_string())?;
    let table = TableValues::of(rig, &certified, gains).map_err(|reason| reason.to_string())?;
    let poles = certified.poles(rig).map_err(|reason| reason.to_string())?;
    Ok((certified, poles, if conditions.raw_step { table.without_governor() } else { table }))
}

fn figures(
    rig: &Rig,
    law: Law,
    certified: &Certified,
    table: &TableValues,
    summary: &Summary,
    poles: Option<&Poles>,
) -> LawFigures {
    // An unstable loop and one whose margins cannot be computed both have none.
    let margins = margins_of(rig, certified, table, law).ok().flatten();
    let settings = AttractionSettings { relative: TILT_PRECISION, ..AttractionSettings::default() };
    let tilts = margins.as_ref().and_then(|_| largest_tilts(rig, table, law, &settings).ok());
    let tilts = tilts.into_iter().flatten().map(|tilt| tilt.edge.size);
    let margin = |of: fn(&Margins) -> Option<f64>| margins.as_ref().and_then(of);
    LawFigures {
        settling_time_s: summary.settling_time_s,
        overshoot_percent: summary.overshoot_percent,
        peak_angle_rad: summary.peak_angles_rad.iter().copied().max_by(f64::total_cmp),
        peak_force_n: summary.peak_force_n,
        lowest_gain: margin(|margins| Some(margins.lowest_gain)),
        highest_gain: margin(|margins| margins.highest_gain),
        phase_margin_rad: margin(|margins| margins.phase_margin_rad),
        delay_margin_s: margin(|margins| margins.delay_margin_s),
        tilt_rad: tilts.min_by(f64::total_cmp),
        fastest_pole_per_s: poles.into_iter().flatten().map(|pole| pole[0]).fold(0.0, f64::min),
    }
}
