//! A simulated machine in real time, for the viewers of a page.

use std::time::{Duration, Instant, SystemTime};

use upright_closed_loop::harness::{HarnessError, Target};
use upright_page::twin::{PoweredMachine, Properties, SimulatedMachine};

use super::dispatcher::{Dispatcher, PICTURE};

/// Longest real time for simulating between two pictures.
const BUDGET: Duration = Duration::from_millis(14);

/// Why a run has ended.
pub(super) enum RunEnd {
    /// The power is switched off and on.
    Restart {
        /// Whether the rig starts raised instead of hanging.
        upright: bool,
    },
    /// The program ends.
    Stopped,
}

/// Runs the firmware `target` with the rig while `goes_on` holds, or until the power is switched off.
///
/// # Errors
/// [`HarnessError`] if the firmware stops.
pub(super) fn run(
    machine: SimulatedMachine<'_>,
    target: &mut dyn Target,
    dispatcher: &mut Dispatcher,
    properties: &mut Properties,
    upright: bool,
    goes_on: &dyn Fn() -> bool,
) -> Result<RunEnd, HarnessError> {
    let epoch = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
    let mut world = PoweredMachine::new(machine, target, properties.clone(), upright, epoch)?;
    let mut last = Instant::now();
    while goes_on() {
        for request in dispatcher.requests(world.now()) {
            world.carry_out(request, &mut dispatcher.console)?;
        }
        let begin = Instant::now();
        // Time starts with the first viewer.
        if dispatcher.was_seen {
            let passed_s = (begin - last).as_secs_f64();
            world.run(passed_s, &mut dispatcher.console, &mut || begin.elapsed() <= BUDGET)?;
        } else {
            world.greet(&mut dispatcher.console)?;
        }
        last = begin;
        dispatcher.show(&world.picture());
        if let Some(upright) = world.restart() {
            *properties = world.properties().clone();
            return Ok(RunEnd::Restart { upright });
        }
        std::thread::sleep((begin + PICTURE).saturating_duration_since(Instant::now()));
    }
    Ok(RunEnd::Stopped)
}
