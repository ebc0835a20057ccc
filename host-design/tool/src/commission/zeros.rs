//! The zeros of absolute sensors, measured while the links hang, before anything is homed.

use std::f64::consts::TAU;
use std::time::Duration;

use upright_closed_loop::client::AnyTelemetry;
use upright_design::rig::{LinkEncoder, Rig, RigText};

use super::contacts;
use super::guide::Guide;
use super::homing::step;
use super::machine::{MachineAtHand, Stop};
use super::plan::CommissionPlan;
use super::record::Journal;
use super::task::PersonTask;
use crate::monitor::words::joint;

/// Longest time since power-up in which nobody has homed the rig (s): counts are then still readings.
const FRESH_S: f64 = 60.0;
/// Time for which all links have to hang still.
const STILL: Duration = Duration::from_secs(2);
/// A link that hangs moves by less than this, besides the noise of its sensor (rad).
const STILL_RAD: f64 = 0.005;
/// A link that was moved hangs again where it hung before, up to this (rad).
const AGREES_RAD: f64 = 0.02;

/// An absolute sensor of a link.
struct AbsoluteLink {
    /// Number of the link, which is that of its sensor.
    link: usize,
    /// Counts per turn, and those of the file per count.
    turn: f64,
    finer: u32,
}

/// What a sensor has shown while its link hung.
struct Hanging {
    /// Mean reading (counts), and deviation from it (counts, root mean square).
    mean: f64,
    deviation: f64,
    /// Distance of the lowest and the highest reading (counts).
    range: f64,
}

/// The text of the rig file with the zeros of its absolute sensors as this machine shows them. Each link is measured,
/// moved by hand and measured again.
///
/// # Errors
/// [`Stop`] if a link does not hang still, a reading is not plausible, or the firmware is another one.
pub fn measured_zeros(
    plan: CommissionPlan<'_>,
    machine: &mut dyn MachineAtHand,
    journal: &mut Journal,
) -> Result<String, Stop> {
    let guide = &mut Guide::new(machine, journal);
    contacts::connect(guide, plan)?;
    let is_fresh = |now: &AnyTelemetry| f64::from(now.tick) * plan.rig.tick.period_s < FRESH_S;
    if guide.conversation().telemetry.as_ref().is_some_and(|now| !is_fresh(now)) {
        guide.journal.asked("press the reset of the board: its counts must not be homed");
        guide.need(is_fresh, "the board was not reset")?;
    }
    let sensors = sensors(plan);
    let first = hanging(guide, plan, &sensors)?;
    for sensor in sensors.iter().rev() {
        moves(guide, plan, sensor)?;
    }
    let second = hanging(guide, plan, &sensors)?;
    let bad = |error: upright_design::rig::RigError| Stop::Machine(error.to_string());
    let mut text = RigText::parse(plan.text, plan.file).map_err(bad)?;
    for ((sensor, first), second) in sensors.iter().zip(first).zip(second) {
        let AbsoluteLink { link, turn, finer } = *sensor;
        let apart = near(second.mean - first.mean, turn);
        let rad = step(plan, link);
        if (apart * rad).abs() > AGREES_RAD {
            return Err(Stop::Machine(format!(
                "{} hangs {:.3} rad from where it hung before it was moved: let it hang freely, look for friction",
                joint(link as u8),
                apart * rad
            )));
        }
        // The middle of a count that holds several of the file's.
        let zero = ((first.mean + 0.5 * apart).round().rem_euclid(turn) as u32) * finer + finer / 2;
        text.set(&format!("link[{link}].sensor_zero_counts"), &zero.to_string()).map_err(bad)?;
        guide.found(format!(
            "{}: zero {zero} counts; noise {:.1e} rad rms, rounding included; {:.4} rad between both measurements",
            joint(link as u8),
            first.deviation.hypot(second.deviation) / 2f64.sqrt() * rad,
            (apart * rad).abs()
        ));
    }
    let text = text.to_string();
    // A potentiometer may hang where it does not read upright.
    Rig::from_toml(&text, plan.file).map_err(bad)?;
    Ok(text)
}

fn sensors(plan: CommissionPlan<'_>) -> Vec<AbsoluteLink> {
    let links = plan.rig.chain().map(|chain| chain.links.as_slice()).unwrap_or_default();
    let absolute = links.iter().enumerate().filter_map(|(index, link)| match link.encoder {
        Some(LinkEncoder::Absolute { bits, .. }) => {
            let turn = (TAU / step(plan, index + 1)).round();
            Some(AbsoluteLink {
                link: index + 1,
                turn,
                finer: (f64::from(bits).exp2() / turn).max(1.0) as u32,
            })
        }
        _ => None,
    });
    absolute.collect()
}

/// The difference of two readings, at most half a turn.
fn near(difference: f64, turn: f64) -> f64 {
    (difference + 0.5 * turn).rem_euclid(turn) - 0.5 * turn
}

fn count(now: &AnyTelemetry, link: usize) -> f64 {
    f64::from(now.counts.get(link).copied().unwrap_or_default())
}

/// Waits until all links hang still, and returns what each sensor has shown.
fn hanging(
    guide: &mut Guide<'_>,
    plan: CommissionPlan<'_>,
    sensors: &[AbsoluteLink],
) -> Result<Vec<Hanging>, Stop> {
    guide.ask(PersonTask::Rest)?;
    let end = guide.machine.now() + guide.machine.patience();
    loop {
        let mut shown: Vec<(u32, Vec<f64>)> = Vec::new();
        guide.wait(STILL, |now| {
            if shown.last().is_none_or(|last| last.0 != now.tick) {
                shown.push((now.tick, sensors.iter().map(|sensor| count(now, sensor.link)).collect()));
            }
            None::<()>
        })?;
        let all: Vec<Hanging> = (0..sensors.len())
            .map(|index| {
                Hanging::from_counts(shown.iter().map(|(_, counts)| counts[index]), sensors[index].turn)
            })
            .collect();
        let moving = sensors.iter().zip(&all).find(|(sensor, hanging)| {
            let noise = plan.table.sensors[sensor.link].still_counts;
            hanging.range > 2.0 * f64::from(noise) + STILL_RAD / step(plan, sensor.link)
        });
        let Some((sensor, hanging)) = moving else {
            return all.into_iter().zip(sensors).map(|(one, sensor)| one.plausible(sensor)).collect();
        };
        if guide.machine.now() >= end {
            let rad = hanging.range * step(plan, sensor.link);
            let link = joint(sensor.link as u8);
            return Err(Stop::Machine(format!("{link} moves by {rad:.3} rad: let it hang still")));
        }
    }
}

impl Hanging {
    fn from_counts(counts: impl Iterator<Item = f64> + Clone, turn: f64) -> Self {
        let first = counts.clone().next().unwrap_or_default();
        let away: Vec<f64> = counts.map(|count| near(count - first, turn)).collect();
        let share = 1.0 / away.len().max(1) as f64;
        let mean = share * away.iter().sum::<f64>();
        let square = share * away.iter().map(|away| (away - mean).powi(2)).sum::<f64>();
        let [low, high] =
            away.iter().fold([0.0; 2], |[low, high]: [f64; 2], &away| [low.min(away), high.max(away)]);
        Self { mean: (first + mean).rem_euclid(turn), deviation: square.sqrt(), range: high - low }
    }

    /// A line that is always low or always high is no reading.
    fn plausible(self, sensor: &AbsoluteLink) -> Result<Self, Stop> {
        if self.range == 0.0 && (self.mean == 0.0 || self.mean == sensor.turn - 1.0) {
            return Err(Stop::Machine(format!(
                "the sensor of {} reads {:.0} all the time, as with an open wire or without a magnet: check both, or turn \
                 the magnet a little",
                joint(sensor.link as u8),
                self.mean
            )));
        }
        Ok(self)
    }
}

/// The sensor counts up when its link is turned counter-clockwise.
fn moves(guide: &mut Guide<'_>, plan: CommissionPlan<'_>, sensor: &AbsoluteLink) -> Result<(), Stop> {
    let link = sensor.link;
    let from = guide.conversation().telemetry.as_ref().map_or(0.0, |now| count(now, link));
    guide.ask(PersonTask::Move(link as u8))?;
    let enough = f64::from(plan.table.sensors[link].sign_counts);
    let moved = guide.wait_for_person(|now| {
        Some(near(count(now, link) - from, sensor.turn)).filter(|moved| moved.abs() >= enough)
    })?;
    match moved {
        Some(moved) if moved > 0.0 => Ok(()),
        Some(_) => Err(Stop::Machine(format!(
            "the sensor of {} counts the wrong way: reverse its direction, or turn its magnet around",
            joint(link as u8)
        ))),
        None => {
            Err(Stop::Machine(format!("the sensor of {} does not count: check its wires", joint(link as u8))))
        }
    }
}
