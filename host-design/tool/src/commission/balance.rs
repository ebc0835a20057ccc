//! The first balance.

use std::time::Duration;

use upright::protocol::message::Request;
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright_closed_loop::client::AnyTelemetry;
use upright_design::plant::absolute_angles;

use super::guide::Guide;
use super::machine::Stop;
use super::plan::CommissionPlan;
use super::task::PersonTask;

/// Time for which the machine has to balance.
const BALANCED: Duration = Duration::from_secs(10);

/// Largest motion while it balances.
#[derive(Default)]
struct LargestMotion {
    messages: f64,
    force_squared: f64,
    lean_rad: f64,
    cart_m: f64,
}

impl LargestMotion {
    fn take(&mut self, now: &AnyTelemetry) {
        let estimate: Vec<f64> = now.estimate.iter().map(|&value| f64::from(value)).collect();
        self.messages += 1.0;
        self.force_squared += f64::from(now.applied_n).powi(2);
        self.lean_rad = absolute_angles(&estimate).fold(self.lean_rad, |most, lean| most.max(lean.abs()));
        self.cart_m = self.cart_m.max((estimate.first().copied().unwrap_or_default()).abs());
    }
}

/// The links are raised by hand, the motor comes on, the hand lets go, and the rig balances.
pub(super) fn balance(guide: &mut Guide<'_>, plan: CommissionPlan<'_>) -> Result<(), Stop> {
    let is_moved = plan.table.drive.pulses().is_some();
    guide.ask(PersonTask::Centre)?;
    guide.pause(Duration::from_secs(1))?;
    guide.ask(PersonTask::Raise)?;
    let is_up = |now: &AnyTelemetry| {
        let mut both = [Inhibits::TILTED, Inhibits::MOVING].into_iter();
        (!both.any(|one| now.arming_inhibits.contains(one))).then_some(())
    };
    guide.wait_for_person(is_up)?;
    guide.request_until(Request::Arm, |now| matches!(now.state, State::Armed | State::Balancing))?;
    let has_begun = |now: &AnyTelemetry| matches!(now.state, State::Balancing | State::Fault).then_some(());
    if guide.wait_for_person(has_begun)?.is_none() {
        return Err(Stop::Machine(format!("the motor does not come on: {}", guide.refusal())));
    }
    let (begin, mut motion, mut last) = (guide.machine.now(), LargestMotion::default(), 0);
    let ended = guide.wait(BALANCED, |now| {
        if now.tick != last {
            last = now.tick;
            motion.take(now);
        }
        (now.state != State::Balancing).then_some(now.fault)
    })?;
    if let Some(fault) = ended {
        let seconds = guide.machine.now().saturating_sub(begin).as_secs_f64();
        let remedy =
            Fault::ALL.iter().find(|entry| Some(entry.fault) == fault).map_or("", |entry| entry.remedy);
        let name = fault.map_or("no fault".to_owned(), |fault| fault.to_string());
        return Err(Stop::Machine(format!("the motor went off after {seconds:.1} s: {name}; {remedy}")));
    }
    let (name, unit) = if is_moved { ("acceleration", "m/s²") } else { ("force", "N") };
    guide.found(format!(
        "balanced for {:.0} s: {} {:.2} {} rms, links up to {:.1}°, cart up to {:.0} mm",
        BALANCED.as_secs_f64(),
        name,
        (motion.force_squared / motion.messages.max(1.0)).sqrt(),
        unit,
        motion.lean_rad.to_degrees(),
        1e3 * motion.cart_m
    ));
    guide.ask(PersonTask::Catch)?;
    guide.turn_off();
    guide.ask(PersonTask::Rest)
}
