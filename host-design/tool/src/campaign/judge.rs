//! The verdict on a trial: its outcome compared with the one that its kind must have.

use serde::{Deserialize, Serialize};
use upright::protocol::HOST_SILENCE_S;
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::jog::MotorSign;
use upright::supervision::shaking;

use super::attempt::{Setup, attempt};
use super::observed::Observed;
use crate::in_the_loop::{RunError, RunPlace};
use upright_closed_loop::defects::{Defect, Expected, Phase, Ticks, Trial};
use upright_design::table::TableValues;

/// Class of an outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// The defect had no visible effect, and the motor stayed on.
    Masked,
    /// The firmware rejected it: balancing went on as it should, or arming was refused.
    Rejected,
    /// The motor went off in time.
    Detected,
    /// The motor went off before a link was more than a quarter beyond its limit or the cart off its rail, but later
    /// than at best for its kind: the observer follows an encoder whose error grows slowly.
    Late,
    /// The required outcome did not happen.
    Missed,
    /// The motor went off although it should have stayed on.
    FalseAlarm,
    /// Fault detection took a push for a defect: without the tests of the innovation, the rig keeps balancing.
    Mistaken,
}

/// The outcome of a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialOutcome {
    /// Number of the trial.
    pub number: u64,
    /// The defect.
    pub kind: Defect,
    /// Class of the outcome.
    pub class: Class,
    /// Ticks to motor off, counted from the first visible difference to a healthy rig, that tick included.
    pub ticks: Option<u32>,
    /// Ticks to motor off, counted from the first tick of the defect.
    pub from_onset: Option<u32>,
    /// Code of the latched fault.
    pub fault: Option<u8>,
    /// Time from the edge of the emergency stop to an inactive PWM, if it opened between ticks (µs).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop_to_off_us: Option<f64>,
}

/// Runs and judges a trial.
pub(super) fn judge(setup: &Setup<'_>, trial: &Trial) -> Result<TrialOutcome, RunError> {
    let observed = attempt(setup, trial, true)?;
    let before = observed.off.is_some_and(|off| off < trial.onset);
    let from = |tick: usize| observed.off.map(|off| off.saturating_sub(tick) as u32 + 1);
    let (from_onset, ticks) = match observed.visible {
        _ if before => (None, None),
        Some(visible) => (from(trial.onset), from(visible)),
        // The motor went off before any single sensor could show the defect: this counts as one tick.
        None => (from(trial.onset), observed.off.map(|_| 1)),
    };
    let ticks = if let Expected::Fault(..) | Expected::Dead = trial.expected() { from_onset } else { ticks };
    let class = if before { Class::FalseAlarm } else { class(setup, trial, &observed, ticks, from_onset)? };
    let fault = observed.fault.map(Fault::code);
    let stop_to_off_us = observed.stop_to_off_us;
    Ok(TrialOutcome {
        number: trial.number,
        kind: trial.kind,
        class,
        ticks,
        from_onset,
        fault,
        stop_to_off_us,
    })
}

/// The class of a run that did not turn its motor off before the defect; `ticks` and `from_onset` count the ticks to
/// motor off from the first visible difference and from the first tick of the defect.
fn class(
    setup: &Setup<'_>,
    trial: &Trial,
    observed: &Observed,
    ticks: Option<u32>,
    from_onset: Option<u32>,
) -> Result<Class, RunError> {
    let on_board = matches!(setup.place, RunPlace::Board { .. });
    Ok(match trial.expected() {
        _ if observed.astray || (observed.on_again && !observed.stills) => Class::Missed,
        Expected::Fault(fault, within) => {
            of_fault(setup.table, (observed, trial.phase), fault, within, ticks, on_board)
        }
        Expected::Off(within) => match ticks {
            _ if observed.outside => Class::Missed,
            Some(ticks) if ticks <= within => Class::Detected,
            Some(_) => Class::Late,
            None if observed.visible.is_none() => Class::Masked,
            None => Class::Missed,
        },
        Expected::Counted if observed.off.is_some() => Class::FalseAlarm,
        Expected::Counted if observed.rejected > 0 => Class::Rejected,
        Expected::Counted => Class::Missed,
        Expected::Ignored if observed.off.is_some() => Class::FalseAlarm,
        // The timing of the pulses at the pins depends on the code, so that no two runs stay equal for long.
        Expected::Ignored if on_board && observed.outside => Class::Missed,
        Expected::Ignored if on_board => Class::Rejected,
        Expected::Ignored => {
            let without = attempt(setup, trial, false)?;
            if without.outputs == observed.outputs { Class::Rejected } else { Class::Missed }
        }
        Expected::Bounded | Expected::Changed if observed.outside => Class::Missed,
        Expected::Survived if observed.outside => Class::Missed,
        Expected::Survived if observed.off.is_none() => Class::Rejected,
        Expected::Survived if stays_on_untested(setup, trial)? => Class::Mistaken,
        Expected::Survived => Class::Detected,
        Expected::Changed if observed.off.is_none() => Class::Missed,
        Expected::Bounded | Expected::Changed if observed.off.is_some() => Class::Detected,
        Expected::Bounded | Expected::Changed => Class::Masked,
        Expected::Refused(reasons) => match observed.refused {
            Some(refused) if refused.contains(reasons) => Class::Rejected,
            _ => Class::Missed,
        },
        Expected::LetGo if observed.fault.is_some() => Class::FalseAlarm,
        Expected::LetGo => match from_onset {
            Some(ticks) if ticks <= silence_ticks(setup.table, trial.phase) => Class::Detected,
            _ => Class::Missed,
        },
        Expected::Found(_) if observed.outside || observed.off.is_none() => Class::Missed,
        Expected::Found(sign) => match observed.refused {
            Some(refused) if refused.contains(Inhibits::MOTOR) && has_found(observed, sign) => {
                Class::Detected
            }
            _ => Class::Missed,
        },
        Expected::Dead if observed.dead && ticks == Some(1) => Class::Detected,
        Expected::Dead => Class::Missed,
    })
}

/// Whether the motor stays on, on the host, with the limits but without the tests of the innovation.
fn stays_on_untested(setup: &Setup<'_>, trial: &Trial) -> Result<bool, RunError> {
    let table = setup.table.clone().without_tests();
    let setup = Setup { table: &table, place: RunPlace::Host, ..*setup };
    Ok(attempt(&setup, trial, true)?.off.is_none())
}

fn of_fault(
    table: &TableValues,
    (observed, phase): (&Observed, Phase),
    fault: Fault,
    within: Ticks,
    ticks: Option<u32>,
    on_board: bool,
) -> Class {
    // On a board, inputs take effect a tick later: an overrun is counted in the next tick, volts and bytes take time.
    // Telemetry, which tells that a drive with pulses only holds the cart, may wait a tick for the log.
    let waits = phase == Phase::Shaken && table.drive.pulses().is_some();
    let limit = allowed(table, within) + u32::from(on_board) + u32::from(waits);
    match (ticks, observed.fault) {
        _ if observed.outside => Class::Missed,
        (Some(ticks), Some(found)) if found == fault && ticks <= limit => Class::Detected,
        // Ticks that end late do not feed the watchdog, which may expire first if its oscillator is fast.
        (Some(ticks), Some(Fault::Watchdog)) if on_board && fault == Fault::Overrun && ticks <= limit => {
            Class::Detected
        }
        // A lock-up that comes from a changed vector: after the watchdog's reset, the image is not as it was linked.
        (Some(ticks), Some(Fault::Image)) if on_board && fault == Fault::Watchdog && ticks <= limit => {
            Class::Detected
        }
        _ => Class::Missed,
    }
}

/// Whether a jog has shown this of the motor, or was ended by a limit switch before it could show that nothing
/// moves.
fn has_found(observed: &Observed, sign: MotorSign) -> bool {
    let is_at_the_end = sign == MotorSign::Still && observed.fault == Some(Fault::LimitSwitch);
    observed.motor == Some(sign) || is_at_the_end
}

/// Ticks from a host's last command to the motor off: bytes take a tick to the link and one to the control task, and on
/// a board some more. A rig that was shaken first brings its cart back.
pub(super) fn silence_ticks(table: &TableValues, phase: Phase) -> u32 {
    let longest_s = match phase {
        Phase::Shaken => HOST_SILENCE_S + shaking::RETURN_S,
        _ => HOST_SILENCE_S,
    };
    (longest_s / table.tick_s) as u32 + 5
}

/// The number of ticks for this table.
pub(super) fn allowed(table: &TableValues, within: Ticks) -> u32 {
    match within {
        Ticks::Exactly(ticks) => ticks,
        Ticks::Supply => table.limits.supply_ticks + 1,
        // Bytes take a tick to the link and one to the control task.
        Ticks::Link => table.limits.link_ticks + 3,
    }
}
