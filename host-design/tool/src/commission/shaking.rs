//! The machine is shaken, and logged.

use std::time::Duration;

use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright_closed_loop::client::AnyTelemetry;
use upright_identify::{LineError, Log, OverLine};

use super::guide::Guide;
use super::machine::Stop;
use super::plan::CommissionPlan;
use super::task::PersonTask;
use crate::monitor::words;
use upright_command::progress::with_spinner;

/// Time within which the firmware reports the cause of a fault.
const CAUSE: Duration = Duration::from_millis(300);

/// The log of the machine, which its firmware shakes.
pub(super) fn shake(guide: &mut Guide<'_>, plan: CommissionPlan<'_>) -> Result<Log, Stop> {
    guide.ask(PersonTask::Centre)?;
    let is_still = |now: &AnyTelemetry| !now.arming_inhibits.contains(Inhibits::MOVING);
    guide.wait_for_person(|now| is_still(now).then_some(()))?;
    guide.ask(PersonTask::HandsOff)?;
    guide.need(is_still, "the links do not come to rest")?;
    let begin = guide.machine.now();
    let mut line = OverLine::new(plan.rig, plan.table, plan.seconds, plan.seed, begin)
        .map_err(|error| Stop::Machine(error.to_string()))?;
    let shaken = with_spinner("shaking", || until_over(guide, &mut line));
    // Whatever has ended it: the motor is turned off, and the log too.
    line.stop(guide.machine.now());
    let ended = guide.machine.exchange(&line.take_outgoing());
    guide.listen();
    if let Err(stop) = shaken {
        return Err(with_cause(guide, stop));
    }
    ended?;
    guide.ask(PersonTask::Centre)?;
    let log = line.finish().map_err(|error| Stop::Machine(error.to_string()))?;
    guide.found(format!("{} ticks, {} of them lost", log.ticks().len() as u64 + log.lost(), log.lost()));
    Ok(log)
}

fn until_over(guide: &mut Guide<'_>, line: &mut OverLine) -> Result<(), Stop> {
    let failed = |error: LineError| match error {
        LineError::Silent => Stop::Line(error.to_string()),
        LineError::Fault(Fault::Frozen) => Stop::Machine(format!(
            "{error}: it has counted by hand, so it sticks; look for friction, or give the rig file a larger jog_force_n; of a stepper, check the drive"
        )),
        error => Stop::Machine(error.to_string()),
    };
    while !line.is_over() {
        line.poll(guide.machine.now()).map_err(failed)?;
        let bytes = guide.machine.exchange(&line.take_outgoing())?;
        line.receive(&bytes, guide.machine.now()).map_err(failed)?;
    }
    Ok(())
}

/// Adds the sensor of a fault, if the firmware reports one.
fn with_cause(guide: &mut Guide<'_>, stop: Stop) -> Stop {
    let told = guide.pause(CAUSE);
    let cause = guide.conversation().cause.and_then(|cause| cause.sensor);
    match (stop, told, cause) {
        (Stop::Machine(words), Ok(()), Some(sensor)) => {
            Stop::Machine(format!("{words} ({})", words::joint(sensor)))
        }
        (stop, ..) => stop,
    }
}
