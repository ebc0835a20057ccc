//! Homing by the limit switches.

use std::time::Duration;

use upright::protocol::message::Request;
use upright::supervision::homing::Homing;
use upright::supervision::slow_drive::HOMING_M_PER_S;
use upright_closed_loop::client::AnyTelemetry;
use upright_closed_loop::conversation::words::OTHER_ZERO;

use super::guide::Guide;
use super::machine::Stop;
use super::plan::CommissionPlan;
use super::task::{End, PersonTask};

/// Time in which links come to rest after a slow motion of the cart.
const SWINGING: Duration = Duration::from_secs(60);
/// A sensor has moved if it counts at least this share of the expected counts.
const MOVED: f64 = 0.1;

/// Both switches are touched, and their distance is that of the file; the links hang still.
pub(super) fn home(guide: &mut Guide<'_>, plan: CommissionPlan<'_>) -> Result<(), Stop> {
    if plan.table.limits.travel_counts[0] == 0 {
        guide.ask(PersonTask::Centre)?;
        return guide.request_until(Request::Home, |now| now.homing == Homing::Homed);
    }
    guide.ask(PersonTask::Centre)?;
    let is_free = |now: &AnyTelemetry| !now.contacts.limit_low && !now.contacts.limit_high;
    guide.need(is_free, "a limit switch stays open, or the cart is still at an end")?;
    let is_begun = |now: &AnyTelemetry| matches!(now.homing, Homing::Touch { .. });
    guide.request_until(Request::HomeRail, is_begun)?;
    let mut ends = Vec::new();
    let is_driven = plan.table.drive.pulses().is_some();
    if is_driven {
        guide.ask(PersonTask::HandsOff)?;
    }
    for end in [End::Low, End::High] {
        if !is_driven {
            guide.ask(PersonTask::PushTo(end))?;
        }
        let touched = move |now: &AnyTelemetry| {
            let is_there = match (now.homing, end) {
                (Homing::Touch { low, .. }, End::Low) => low,
                (Homing::Touch { high, .. }, End::High) => high,
                (Homing::HoldStill | Homing::OtherZero | Homing::WrongTravel, _) => true,
                _ => false,
            };
            is_there.then(|| now.counts.iter().map(|&count| f64::from(count)).collect::<Vec<_>>())
        };
        let not_touched = || Stop::Machine("the cart has not touched both limit switches".to_owned());
        let reached = match is_driven {
            true => guide.wait(longest(plan), touched)?,
            false => guide.wait_for_person(touched)?,
        };
        ends.push(reached.ok_or_else(not_touched)?);
    }
    let moved: Vec<f64> = ends[1].iter().zip(&ends[0]).map(|(high, low)| high - low).collect();
    let homing = guide.conversation().telemetry.as_ref().map(|now| now.homing);
    if homing == Some(Homing::WrongTravel) {
        return Err(Stop::Machine(wrong_travel(plan, &moved)));
    }
    guide.found(format!(
        "{:.4} m between the switches, {:.4} m in the file",
        moved[0] * step(plan, 0),
        wanted_m(plan)
    ));
    rest_between(guide, plan)
}

/// Between the switches, the links come to rest, and the rig is homed.
fn rest_between(guide: &mut Guide<'_>, plan: CommissionPlan<'_>) -> Result<(), Stop> {
    let is_homed = |now: &AnyTelemetry| (now.homing == Homing::Homed).then_some(());
    let homed = if plan.table.drive.pulses().is_some() {
        // It goes to the middle by itself, and homes as soon as the links hang still.
        guide.ask(PersonTask::Rest)?;
        guide.wait(longest(plan), is_homed)?
    } else {
        guide.ask(PersonTask::Centre)?;
        guide.wait_for_person(is_homed)?
    };
    homed.ok_or_else(|| {
        let homing = guide.conversation().telemetry.as_ref().map(|now| now.homing);
        Stop::Machine(match homing {
            Some(Homing::OtherZero) => OTHER_ZERO.to_owned(),
            _ => "cart and links do not come to rest between the switches".to_owned(),
        })
    })
}

/// Longest time in which a drive with pulses goes from end to end, and the links come to rest.
fn longest(plan: CommissionPlan<'_>) -> Duration {
    Duration::from_secs_f64(2.0 * wanted_m(plan) / f64::from(HOMING_M_PER_S)) + SWINGING
}

/// What is wrong if the switches are not as far apart as the file says; `moved` are all sensors' counts from one to
/// the other.
fn wrong_travel(plan: CommissionPlan<'_>, moved: &[f64]) -> String {
    let wanted = f64::from(plan.table.limits.travel_counts[0]);
    if plan.table.drive.pulses().is_some() {
        return format!(
            "a limit switch does not open where it should: {:.4} m of pulses so far, {:.4} m between the switches in the file: \
             does the drive move the cart, and along +x for positive pulses? Else correct step_m or travel_m",
            moved[0].abs() * step(plan, 0),
            wanted_m(plan)
        );
    }
    let tolerance = f64::from(plan.table.limits.travel_counts[1]);
    let other = moved.iter().skip(1).position(|counts| counts.abs() > MOVED * wanted);
    if moved[0].abs() < MOVED * wanted {
        return match other {
            Some(link) => format!(
                "the encoder of link {} counts when the cart is pushed, that of the cart does not: exchange their plugs",
                link + 1
            ),
            None => {
                "the cart's encoder does not count when the cart is pushed: check its plug, its supply and its wheel".to_owned()
            }
        };
    }
    if (moved[0] + wanted).abs() <= tolerance {
        return "the encoder of the cart counts the wrong way: swap its channels".to_owned();
    }
    format!(
        "the cart's encoder says {:.4} m between the switches, the file says {:.4} m: correct encoder_step_m or travel_m of \
         [cart]",
        moved[0] * step(plan, 0),
        wanted_m(plan)
    )
}

/// Distance between the switches by the file (m).
fn wanted_m(plan: CommissionPlan<'_>) -> f64 {
    f64::from(plan.table.limits.travel_counts[0]) * step(plan, 0)
}

/// Travel per count (m, rad).
pub(super) fn step(plan: CommissionPlan<'_>, sensor: usize) -> f64 {
    plan.rig.sensors().get(sensor).map_or(0.0, |sensor| sensor.step())
}
