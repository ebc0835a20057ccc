//! Connection and contacts.

use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright_closed_loop::client::AnyTelemetry;

use super::guide::Guide;
use super::machine::Stop;
use super::plan::CommissionPlan;
use super::task::{End, PersonTask};
use crate::monitor::words;

/// The firmware answers, and is that of the rig file.
pub(super) fn connect(guide: &mut Guide<'_>, plan: CommissionPlan<'_>) -> Result<(), Stop> {
    while guide.conversation().telemetry.is_none() {
        guide.turn()?;
    }
    guide.expect_rig(plan.table.into())?;
    if let Some(info) = guide.conversation().info {
        let [major, minor, patch] = info.version;
        guide.found(format!(
            "firmware {major}.{minor}.{patch}, protocol {}, rig {:016x}, tick {} s, image {:08x}",
            info.protocol, info.rig_hash, info.tick_s, info.image
        ));
    }
    let fault = guide.conversation().telemetry.as_ref().and_then(|telemetry| telemetry.fault);
    match fault {
        // Contacts come next; many power stages report a fault while their supply is off.
        None | Some(Fault::EmergencyStop | Fault::Driver) => Ok(()),
        Some(fault) => {
            let remedy =
                Fault::ALL.iter().find(|entry| entry.fault == fault).map_or("", |entry| entry.remedy);
            Err(Stop::Machine(format!("the firmware has the fault {fault}: {remedy}")))
        }
    }
}

/// Emergency stop and limit switches open when they are pressed, and no other; then the supply.
pub(super) fn check(guide: &mut Guide<'_>, plan: CommissionPlan<'_>) -> Result<(), Stop> {
    guide.ask(PersonTask::PressStop)?;
    guide.need(
        |now| now.contacts.emergency_stop,
        "the emergency stop is not seen when it is pressed: it has to be a normally closed contact to ground; do not \
         switch the motor's supply on",
    )?;
    guide.ask(PersonTask::ReleaseStop)?;
    let is_released = |now: &AnyTelemetry| !now.contacts.emergency_stop;
    guide.need(is_released, "the emergency stop stays pressed, or its wire is open")?;
    guide.found("the emergency stop opens and closes");
    if plan.table.limits.travel_counts[0] != 0 {
        for end in [End::Low, End::High] {
            switch(guide, end)?;
        }
        guide.found("each limit switch opens at its own end, and closes again");
    }
    supply(guide)
}

/// The switch at this end opens, and not the other one; away from the ends both are closed.
fn switch(guide: &mut Guide<'_>, end: End) -> Result<(), Stop> {
    let both = |now: &AnyTelemetry| [now.contacts.limit_low, now.contacts.limit_high];
    guide.ask(PersonTask::Centre)?;
    guide.need(
        |now| both(now) == [false; 2],
        "a limit switch is open in the middle of the rail: it is a normally closed contact to ground; check its wire",
    )?;
    guide.ask(PersonTask::PushTo(end))?;
    let (own, name) = match end {
        End::Low => ([true, false], "low"),
        End::High => ([false, true], "high"),
    };
    match guide.wait_for_person(|now| Some(both(now)).filter(|&both| both != [false; 2]))? {
        Some(open) if open == own => Ok(()),
        Some(_) => Err(Stop::Machine(format!(
            "at the {name} end the other limit switch opens: exchange the wires of the two"
        ))),
        None => Err(Stop::Machine(format!(
            "the limit switch at the {name} end does not open when the cart presses it: it has to be a normally closed contact \
             to ground"
        ))),
    }
}

/// The supply is within its limits, and the power stage reports no fault.
fn supply(guide: &mut Guide<'_>) -> Result<(), Stop> {
    guide.ask(PersonTask::SwitchOn)?;
    let is_good = |now: &AnyTelemetry| wrong_inputs(now).is_empty().then_some(());
    if guide.wait_for_person(is_good)?.is_none() {
        let now = guide.conversation().telemetry.as_ref();
        let words = now.map(|now| format!("{}; {}", wrong_inputs(now).join("; "), words::inputs(now)));
        return Err(Stop::Machine(words.unwrap_or_default()));
    }
    // The emergency stop has latched a fault.
    guide.clear()?;
    let inputs = guide.conversation().telemetry.as_ref().map(words::inputs).unwrap_or_default();
    guide.found(inputs);
    Ok(())
}

/// What is wrong with supply and power stage.
fn wrong_inputs(now: &AnyTelemetry) -> Vec<&'static str> {
    let both = [Inhibits::SUPPLY, Inhibits::DRIVER].into_iter();
    both.filter(|&one| now.arming_inhibits.contains(one)).flat_map(Inhibits::texts).collect()
}
