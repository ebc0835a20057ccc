//! What a trial came to, by what had to come of it.

use serde::Serialize;
use upright::supervision::fault::Fault;

use super::attempt::{Place, Seen, attempt};
use super::defect::{Expected, Kind, Ticks};
use super::trial::Trial;
use crate::in_the_loop::RunError;
use upright_design::rig::Rig;
use upright_design::table::TableValues;

/// Class of an outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// The defect had no effect that could be seen, and nothing happened.
    Masked,
    /// The firmware did not take it: balancing went on as it should, or arming was refused.
    Rejected,
    /// The motor went off in time.
    Detected,
    /// The motor went off before a link was more than a quarter beyond its limit or the cart off its rail, but later than a
    /// defect of its kind is found at its best: the observer follows an encoder whose error grows slowly.
    Late,
    /// What had to come did not come.
    Missed,
    /// The motor went off although it should not.
    FalseAlarm,
}

/// What a trial came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Number of the trial.
    pub number: u64,
    /// The defect.
    pub kind: Kind,
    /// Class.
    pub class: Class,
    /// Ticks to motor off, the one with the defect counted; from the tick on in which it could be told from a healthy rig.
    pub ticks: Option<u32>,
    /// The same from its first tick on.
    pub from_onset: Option<u32>,
    /// Code of the latched fault.
    pub fault: Option<u8>,
}

/// Runs and judges a trial.
pub(super) fn judge(
    rig: &Rig,
    table: &TableValues,
    trial: &Trial,
    place: Place<'_>,
) -> Result<Outcome, RunError> {
    let seen = attempt(rig, table, trial, true, place)?;
    let before = seen.off.is_some_and(|off| off < trial.onset);
    let from = |tick: usize| seen.off.map(|off| off.saturating_sub(tick) as u32 + 1);
    let (from_onset, ticks) = match seen.visible {
        _ if before => (None, None),
        Some(visible) => (from(trial.onset), from(visible)),
        // Off before it could be seen by one sensor alone: at once.
        None => (from(trial.onset), seen.off.map(|_| 1)),
    };
    let expected = trial.kind.expected();
    let ticks = if let Expected::Fault(..) | Expected::Dead = expected { from_onset } else { ticks };
    let class = match expected {
        _ if before => Class::FalseAlarm,
        _ if seen.on_again => Class::Missed,
        Expected::Fault(fault, within) => of_fault(table, &seen, fault, within, ticks),
        Expected::Off(within) => match ticks {
            _ if seen.outside => Class::Missed,
            Some(ticks) if ticks <= within => Class::Detected,
            Some(_) => Class::Late,
            None if seen.visible.is_none() => Class::Masked,
            None => Class::Missed,
        },
        Expected::Counted if seen.off.is_some() => Class::FalseAlarm,
        Expected::Counted if seen.rejected > 0 => Class::Rejected,
        Expected::Counted => Class::Missed,
        Expected::Ignored if seen.off.is_some() => Class::FalseAlarm,
        Expected::Ignored => {
            let without = attempt(rig, table, trial, false, place)?;
            if without.outputs == seen.outputs { Class::Rejected } else { Class::Missed }
        }
        Expected::Bounded if seen.outside => Class::Missed,
        Expected::Bounded if seen.off.is_some() => Class::Detected,
        Expected::Bounded => Class::Masked,
        Expected::Refused(reasons) => match seen.refused {
            Some(refused) if refused.contains(reasons) => Class::Rejected,
            _ => Class::Missed,
        },
        Expected::Dead if seen.dead && ticks == Some(1) => Class::Detected,
        Expected::Dead => Class::Missed,
    };
    let fault = seen.fault.map(Fault::code);
    Ok(Outcome { number: trial.number, kind: trial.kind, class, ticks, from_onset, fault })
}

fn of_fault(table: &TableValues, seen: &Seen, fault: Fault, within: Ticks, ticks: Option<u32>) -> Class {
    let limit = allowed(table, within);
    match (ticks, seen.fault) {
        _ if seen.outside => Class::Missed,
        (Some(ticks), Some(found)) if found == fault && ticks <= limit => Class::Detected,
        _ => Class::Missed,
    }
}

/// The number of ticks on this rig.
pub(super) fn allowed(table: &TableValues, within: Ticks) -> u32 {
    match within {
        Ticks::Exactly(ticks) => ticks,
        Ticks::Supply => table.limits.supply_ticks + 1,
        // Bytes take a tick to the link and one to the control task.
        Ticks::Link => table.limits.link_ticks + 3,
    }
}
