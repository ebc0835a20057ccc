//! Many trials in parallel, and their counts by kind.

use std::collections::BTreeMap;

use serde::Serialize;
use upright::supervision::fault::Fault;

use super::attempt::{During, Setup};
use super::judge::{Class, TrialOutcome, allowed, judge, silence_ticks};
use super::push::pushed;
use crate::in_the_loop::{RunError, RunPlace};
use upright_closed_loop::defects::{Defect, Expected, Needs, Trial};
use upright_design::study::{Study, StudyError};
use upright_design::table::TableValues;
use upright_trust::verify::VerifyError;

/// A trial that could not be run.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// It failed in this process.
    #[error("trial {number} ({kind}): {source}")]
    Trial {
        /// Number of the trial.
        number: u64,
        /// Name of its kind.
        kind: &'static str,
        /// The cause.
        source: Box<RunError>,
    },
    /// The force of a push cannot be found.
    #[error("trial {number}: {source}")]
    Push {
        /// Number of the trial.
        number: u64,
        /// The cause.
        source: VerifyError,
    },
    /// The outcomes of other processes cannot be merged.
    #[error(transparent)]
    Study(#[from] StudyError),
}

/// All trials of one kind.
#[derive(Debug, Clone, Serialize)]
pub struct DefectRow {
    /// Defect of the defect.
    pub kind: Defect,
    /// See [`Defect::meaning`].
    pub meaning: &'static str,
    /// Ticks within which the motor must be off; for [`Expected::Off`], the ticks that this takes at best.
    pub allowed: Option<u32>,
    /// Number of trials.
    pub runs: usize,
    /// Trials of [`Class::Masked`].
    pub masked: usize,
    /// See [`Class::Rejected`].
    pub rejected: usize,
    /// See [`Class::Detected`].
    pub detected: usize,
    /// See [`Class::Late`].
    pub late: usize,
    /// See [`Class::Missed`].
    pub missed: usize,
    /// See [`Class::FalseAlarm`].
    pub false_alarms: usize,
    /// See [`Class::Mistaken`]: the names of the faults, and how many trials ended with each.
    pub mistaken: BTreeMap<&'static str, usize>,
    /// Largest number of ticks to motor off.
    pub worst: Option<u32>,
    /// Largest number of ticks to motor off, counted from the first tick of the defect.
    pub worst_from_onset: Option<u32>,
    /// Longest time from the edge of the emergency stop to an inactive PWM, if it opened between ticks (µs).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_to_off_us: Option<f64>,
    /// Names of the faults that were latched.
    pub faults: Vec<&'static str>,
    /// Numbers of the trials with a wrong outcome.
    pub wrong: Vec<u64>,
}

/// The result of a campaign.
#[derive(Debug, Clone, Serialize)]
pub struct Campaign {
    /// Seed of the campaign.
    pub seed: u64,
    /// Number of trials.
    pub runs: u64,
    /// One row per kind.
    pub rows: Vec<DefectRow>,
}

/// The kinds of defects that are possible with this rig and this place.
pub fn kinds(table: &TableValues, place: RunPlace<'_>) -> Vec<Defect> {
    Defect::ALL
        .iter()
        .copied()
        .filter(|kind| kind.is_possible(table))
        .filter(|kind| match place {
            RunPlace::Host => kind.needs() != Needs::Board,
            RunPlace::Board { .. } => kind.needs() != Needs::SimulatedPins,
        })
        .collect()
}

/// One trial of a campaign.
///
/// # Errors
/// [`CampaignError`] if it cannot be run.
pub fn one(
    setup: &Setup<'_>,
    kinds: &[Defect],
    seed: u64,
    number: u64,
) -> Result<TrialOutcome, CampaignError> {
    let trial = Trial::draw(setup.rig, setup.table, kinds, seed, number);
    let trial = match setup.during {
        During::Balancing => {
            pushed(trial, setup.rig, setup.table).map_err(|source| CampaignError::Push { number, source })?
        }
        During::Jog => trial.in_jog(setup.rig),
        During::Shaking(_) => trial.in_shaking(setup.rig),
    };
    judge(setup, &trial).map_err(|source| CampaignError::Trial {
        number,
        kind: trial.kind.name(),
        source: Box::new(source),
    })
}

/// Runs `runs` trials of `kinds`, in turn, which are the part `part` of `study`; `done` is called after each.
///
/// # Errors
/// The first [`CampaignError`].
pub fn campaign(
    setup: &Setup<'_>,
    kinds: &[Defect],
    seed: u64,
    runs: u64,
    (study, part): (&Study, &str),
    done: &(dyn Fn() + Sync),
) -> Result<Campaign, CampaignError> {
    let of_number = |number: u64| {
        let outcome = one(setup, kinds, seed, number);
        done();
        outcome
    };
    let outcomes: Vec<TrialOutcome> = study.outcomes(part, runs, of_number)?;
    let rows = kinds.iter().map(|&kind| DefectRow::of(kind, setup, &outcomes)).collect();
    Ok(Campaign { seed, runs, rows })
}

impl DefectRow {
    fn of(kind: Defect, setup: &Setup<'_>, outcomes: &[TrialOutcome]) -> Self {
        let of_kind = || outcomes.iter().filter(move |outcome| outcome.kind == kind);
        let count = |class: Class| of_kind().filter(|outcome| outcome.class == class).count();
        let phase = setup.during.phase();
        let is_wrong = |class: Class| matches!(class, Class::Missed | Class::FalseAlarm);
        let mut faults: Vec<u8> = of_kind().filter_map(|outcome| outcome.fault).collect();
        faults.sort_unstable();
        faults.dedup();
        let name =
            |code: u8| Fault::ALL.iter().find(|entry| entry.fault.code() == code).map(|entry| entry.name);
        let mut mistaken = BTreeMap::new();
        for outcome in of_kind().filter(|outcome| outcome.class == Class::Mistaken) {
            *mistaken.entry(outcome.fault.and_then(name).unwrap_or("none")).or_default() += 1;
        }
        Self {
            kind,
            meaning: kind.meaning(),
            allowed: match kind.expected_in(phase) {
                Expected::Fault(_, within) => Some(allowed(setup.table, within)),
                Expected::LetGo => Some(silence_ticks(setup.table, phase)),
                Expected::Off(ticks) => Some(ticks),
                Expected::Dead => Some(1),
                _ => None,
            },
            runs: of_kind().count(),
            masked: count(Class::Masked),
            rejected: count(Class::Rejected),
            detected: count(Class::Detected),
            late: count(Class::Late),
            missed: count(Class::Missed),
            false_alarms: count(Class::FalseAlarm),
            mistaken,
            worst: of_kind().filter_map(|outcome| outcome.ticks).max(),
            worst_from_onset: of_kind().filter_map(|outcome| outcome.from_onset).max(),
            stop_to_off_us: of_kind().filter_map(|outcome| outcome.stop_to_off_us).max_by(f64::total_cmp),
            faults: faults.into_iter().filter_map(name).collect(),
            wrong: of_kind()
                .filter(|outcome| is_wrong(outcome.class))
                .map(|outcome| outcome.number)
                .collect(),
        }
    }
}
