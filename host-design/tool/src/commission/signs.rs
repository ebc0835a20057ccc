//! Signs and places of the encoders, and their counts for a whole turn.

use std::time::Duration;

use upright::protocol::message::Request;
use upright::supervision::sign_check::Signs;
use upright_closed_loop::client::AnyTelemetry;

use super::guide::Guide;
use super::machine::Stop;
use super::plan::CommissionPlan;
use super::task::PersonTask;
use crate::monitor::words;

/// A turn has begun when the link has moved by this share of it.
const BEGUN: f64 = 0.1;
/// It has ended when nothing has moved for this long.
const ENDED: Duration = Duration::from_millis(1_500);
/// Accepted deviation from a whole turn, which a person judges by eye.
const TOLERANCE: f64 = 0.05;

/// The firmware's own check, from the outermost link inwards.
pub(super) fn check(guide: &mut Guide<'_>) -> Result<(), Stop> {
    guide.ask(PersonTask::Rest)?;
    guide.request_until(Request::CheckSigns, |now| now.signs != Signs::Unchecked)?;
    let mut asked = None;
    loop {
        let changed = |now: &AnyTelemetry| (Some(now.signs) != asked).then_some(now.signs);
        let Some(signs) = guide.wait_for_person(changed)? else {
            return Err(Stop::Machine(match asked {
                Some(Signs::Move(sensor)) => format!(
                    "no encoder counts while {} is moved: check the plugs and the supply of the encoders",
                    if sensor == 0 { "the cart".to_owned() } else { words::joint(sensor) }
                ),
                _ => "the links do not hang still where they were homed: home again".to_owned(),
            }));
        };
        asked = Some(signs);
        match signs {
            Signs::Rest(_) => guide.ask(PersonTask::Rest)?,
            Signs::Move(sensor) => guide.ask(PersonTask::Move(sensor))?,
            Signs::Checked => {
                guide.found("every encoder counts the right way, at its own place");
                return guide.ask(PersonTask::Centre);
            }
            Signs::Reversed(_) | Signs::Swapped { .. } | Signs::Unchecked => {
                let instruction = guide.conversation().telemetry.as_ref().and_then(words::instruction);
                return Err(Stop::Machine(
                    instruction.unwrap_or_else(|| "the sign check was cancelled: do it again".to_owned()),
                ));
            }
        }
    }
}

/// Every link is turned once around.
pub(super) fn turns(guide: &mut Guide<'_>, plan: CommissionPlan<'_>) -> Result<(), Stop> {
    for sensor in (1..plan.table.sensors()).rev() {
        guide.ask(PersonTask::Rest)?;
        guide.pause(ENDED)?;
        let wanted = f64::from(plan.table.sensors[sensor].turn_counts);
        let Some(moved) = turn(guide, sensor, BEGUN * wanted)? else {
            return Err(Stop::Machine(format!(
                "the encoder of link {sensor} does not count, or it was not turned"
            )));
        };
        let ratio = moved / wanted;
        if (ratio - 1.0).abs() > TOLERANCE {
            return Err(Stop::Machine(format!(
                "link {sensor} counts {moved:.0} for a turn, the file says {wanted:.0}: correct encoder_counts_per_rev or \
                 sensor_bits, or it was not one turn counter-clockwise"
            )));
        }
        guide.found(format!("link {sensor}: {moved:.0} counts for a turn, {wanted:.0} in the file"));
    }
    Ok(())
}

/// Counts from the beginning to the end of a turn of this link; `None` if it does not move.
fn turn(guide: &mut Guide<'_>, sensor: usize, begun: f64) -> Result<Option<f64>, Stop> {
    let count = |now: &AnyTelemetry| f64::from(now.counts.get(sensor).copied().unwrap_or_default());
    let from = guide.conversation().telemetry.as_ref().map_or(0.0, count);
    guide.ask(PersonTask::TurnAround(sensor as u8))?;
    let begins = |now: &AnyTelemetry| ((count(now) - from).abs() > begun).then(|| count(now));
    let Some(mut last) = guide.wait_for_person(begins)? else { return Ok(None) };
    // A hand that holds a link still trembles by less.
    let near = 0.02 * begun / BEGUN;
    let end = guide.machine.now() + guide.machine.patience();
    while guide.machine.now() < end {
        let on = |now: &AnyTelemetry| ((count(now) - last).abs() > near).then(|| count(now));
        match guide.wait(ENDED, on)? {
            Some(now) => last = now,
            None => break,
        }
    }
    let now = guide.conversation().telemetry.as_ref().map_or(last, count);
    Ok(Some(now - from))
}
