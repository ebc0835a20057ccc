//! The jog: the sign of the motor.

use std::time::Duration;

use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::Request;
use upright::supervision::jog::MotorSign;
use upright::supervision::supervisor::State;

use super::guide::Guide;
use super::machine::Stop;
use super::plan::CommissionPlan;
use super::task::PersonTask;
use crate::monitor::words;

/// Time for which the rig stands still before a jog, and the key is released between two tries.
const STILL: Duration = Duration::from_secs(1);
/// A jog begins within this time, or is refused.
const BEGINS: Duration = Duration::from_millis(300);
/// Longest jog, and some time for the telemetry.
const LONGEST: Duration = Duration::from_millis(1_500);

/// The motor pushes the cart along +x until it has moved a little.
pub(super) fn check(guide: &mut Guide<'_>, plan: CommissionPlan<'_>) -> Result<(), Stop> {
    if plan.table.drive.pulses().is_some() {
        // The links show the direction: they must not swing.
        guide.ask(PersonTask::Rest)?;
        guide.pause(STILL)?;
    }
    guide.ask(PersonTask::HandsOff)?;
    let end = guide.machine.now() + guide.machine.patience();
    while !push(guide)? {
        if guide.machine.now() > end {
            return Err(Stop::Machine(format!("the cart is not jogged: {}", guide.refusal())));
        }
    }
    let now = guide.conversation().telemetry.as_ref();
    let (motor, fault) = now.map_or((MotorSign::Unchecked, None), |now| (now.motor, now.fault));
    let words = now.and_then(words::instruction);
    guide.ask(PersonTask::Centre)?;
    match (motor, fault) {
        (MotorSign::Checked, None) => guide.found("the motor moves the cart along +x"),
        (_, Some(fault)) => {
            return Err(Stop::Machine(format!("fault {fault} while the motor pushed the cart")));
        }
        _ => {
            let words = words.unwrap_or_else(|| "the jog has ended too early: do it again".to_owned());
            return Err(Stop::Machine(words));
        }
    }
    Ok(())
}

/// Holds the key until the jog has ended; returns whether it has begun.
fn push(guide: &mut Guide<'_>) -> Result<bool, Stop> {
    guide.pause(STILL)?;
    let begin = guide.machine.now();
    let mut has_begun = false;
    loop {
        guide.send(Request::Jog { along: true });
        guide.pause(KEEP_ALIVE)?;
        let is_jogging =
            guide.conversation().telemetry.as_ref().is_some_and(|now| now.state == State::Jogging);
        let since = guide.machine.now().saturating_sub(begin);
        if (has_begun && !is_jogging) || since > LONGEST {
            return Ok(has_begun);
        }
        has_begun |= is_jogging;
        if !has_begun && since > BEGINS {
            return Ok(false);
        }
    }
}
