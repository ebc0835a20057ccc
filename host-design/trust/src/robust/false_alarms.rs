//! Rate of false alarms: hours of balancing with the whole firmware on machines without a defect.

use serde::{Deserialize, Serialize};
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::{Answer, Request};
use upright::table::Law;

use crate::verify::{VerifyError, at_rest_disturbed, chain, moved_setpoint_m};
use upright_closed_loop::harness::{Harness, HarnessError, with_firmware};
use upright_design::reality::{corner_machine, corners_of, drawn_machine};
use upright_design::rig::Rig;
use upright_design::study::Study;
use upright_design::table::TableValues;

/// Time after which the set-point changes sides (s).
const SIDE_S: f64 = 60.0;

/// Result of balancing one machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Healthy {
    /// Time for which it balanced (s).
    pub balanced_s: f64,
    /// Why it was turned off, if it was: the name of the fault.
    pub fault: Option<String>,
    /// Number of measurements that the firmware rejected.
    pub rejected: u32,
    /// Largest innovation in the telemetry, as a share of the largest one that is no fault.
    pub closest: f32,
}

/// Results of balancing machines with one law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FalseAlarms {
    /// The law in the loop.
    pub law: Law,
    /// Number of machines, each of which balanced once.
    pub runs: u64,
    /// Total time for which they balanced (h).
    pub hours: f64,
    /// Faults, with the number of each run that ended with one.
    pub alarms: Vec<(u64, String)>,
    /// Upper 95 % confidence limit of the rate of alarms (1/h).
    pub most_per_hour: f64,
    /// Number of measurements that the firmware rejected.
    pub rejected: u64,
    /// Largest innovation in the telemetry, as a share of the largest one that is no fault.
    pub closest: f32,
}

/// Which machines balance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Machines {
    /// This many, drawn within `[robust]`: [`drawn_machine`].
    Drawn(u64),
    /// One at each combination of wrong masses: [`corner_machine`].
    Corners,
}

impl Machines {
    /// Number of machines for this rig.
    pub fn count(self, rig: &Rig) -> u64 {
        match self {
            Self::Drawn(runs) => runs,
            Self::Corners => corners_of(rig),
        }
    }

    fn machine(self, rig: &Rig, number: u64) -> Rig {
        match self {
            Self::Drawn(_) => drawn_machine(rig, number),
            Self::Corners => corner_machine(rig, number),
        }
    }
}

/// Balances `machines` for `seconds` each, a part of `study`. `done` is called after each, from any thread.
///
/// # Errors
/// [`VerifyError`] if a run cannot be started.
pub fn false_alarms(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    (machines, seconds): (Machines, f64),
    study: &Study,
    done: &(dyn Fn() + Sync),
) -> Result<FalseAlarms, VerifyError> {
    chain(rig, "healthy machines")?;
    let one = |number: u64| -> Result<(u64, Healthy), VerifyError> {
        let found = balance(&machines.machine(rig, number), table, law, number, seconds);
        done();
        Ok((number, found?))
    };
    let all = study.outcomes(law.key(), machines.count(rig), one)?;
    let hours = all.iter().map(|(_, one)| one.balanced_s).sum::<f64>() / 3600.0;
    let alarms: Vec<(u64, String)> =
        all.iter().filter_map(|(number, one)| Some((*number, one.fault.clone()?))).collect();
    Ok(FalseAlarms {
        law,
        runs: all.len() as u64,
        hours,
        most_per_hour: largest_mean(alarms.len()) / hours.max(f64::MIN_POSITIVE),
        alarms,
        rejected: all.iter().map(|(_, one)| u64::from(one.rejected)).sum(),
        closest: all.iter().map(|(_, one)| one.closest).fold(0.0, f32::max),
    })
}

/// Balances one machine for `seconds` after it has been raised by hand, with the disturbances that the rig file
/// expects. The set-point changes sides every minute.
///
/// # Errors
/// [`HarnessError`] if the firmware does not run with this rig and table.
pub fn balance(
    machine: &Rig,
    table: &TableValues,
    law: Law,
    seed: u64,
    seconds: f64,
) -> Result<Healthy, HarnessError> {
    let scenario = at_rest_disturbed(machine, law, seed);
    with_firmware(table, |target| {
        let mut harness = Harness::new(machine, table, &scenario, target)?;
        match harness.raise(None) {
            Ok(output) => {
                harness.bench.tick(output.drive);
                balanced(machine, table, &mut harness, seconds)
            }
            // The motor was turned off before the machine balanced.
            Err(error) => match harness.session.fault() {
                Some(fault) => {
                    Ok(Healthy { balanced_s: 0.0, fault: Some(fault.to_string()), rejected: 0, closest: 0.0 })
                }
                None => Err(error),
            },
        }
    })?
}

fn balanced(
    rig: &Rig,
    table: &TableValues,
    harness: &mut Harness<'_>,
    seconds: f64,
) -> Result<Healthy, HarnessError> {
    let ticks = |seconds: f64| (seconds / rig.tick.period_s) as u64;
    let (side, keep_alive) = (ticks(SIDE_S).max(1), ticks(KEEP_ALIVE.as_secs_f64()).max(1));
    let setpoint_m = moved_setpoint_m(table) as f32;
    let thresholds = &table.thresholds;
    let largest = if thresholds.survives_pushes() { &thresholds.push } else { &thresholds.innovation };
    let mut found = Healthy { balanced_s: 0.0, fault: None, rejected: 0, closest: 0.0 };
    for number in 0..ticks(seconds) {
        if number % side == 0 {
            let sign = if (number / side).is_multiple_of(2) { 1.0 } else { -1.0 };
            harness.session.send(Request::Setpoint(sign * setpoint_m));
        } else if number % keep_alive == 0 {
            harness.session.send(Request::KeepAlive);
        }
        tick(harness)?;
        while harness.session.next_reply().is_some() {}
        while let Some(telemetry) = harness.session.next_telemetry() {
            for (innovation, largest) in telemetry.innovation.iter().zip(largest) {
                found.closest = found.closest.max(innovation.abs() / largest);
            }
        }
        found.fault = harness.session.fault().map(|fault| fault.to_string());
        if found.fault.is_some() {
            break;
        }
        found.balanced_s = (number + 1) as f64 * rig.tick.period_s;
    }
    found.rejected = rejected(harness)?;
    Ok(found)
}

/// One tick of firmware and rig.
fn tick(harness: &mut Harness<'_>) -> Result<(), HarnessError> {
    let inputs = harness.inputs();
    let output = harness.session.tick(&inputs)?;
    harness.bench.tick(output.drive);
    Ok(())
}

/// Number of measurements that the firmware has rejected so far; the rig goes on balancing until the answer arrives.
fn rejected(harness: &mut Harness<'_>) -> Result<u32, HarnessError> {
    let id = harness.session.send(Request::Statistics);
    for _ in 0..harness.session.pace().answer_ticks {
        tick(harness)?;
        while let Some((answered, answer)) = harness.session.next_reply() {
            if let (true, Answer::Statistics(statistics)) = (answered == id, answer) {
                return Ok(statistics.rejected_samples);
            }
        }
    }
    Err(HarnessError::NoAnswer(Request::Statistics))
}

/// The mean of the Poisson distribution for which `seen` or fewer events have a probability of 5 %: the largest
/// plausible mean (F. Garwood, "Fiducial limits for the Poisson distribution", Biometrika 28 (1936) 437-442).
fn largest_mean(seen: usize) -> f64 {
    let probability = |mean: f64| {
        let mut term = (-mean).exp();
        let mut sum = term;
        for k in 1..=seen {
            term *= mean / k as f64;
            sum += term;
        }
        sum
    };
    let (mut low, mut high) = (0.0, 10.0 + 3.0 * seen as f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if probability(middle) > 0.05 { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_plausible_mean_has_its_known_values() {
        // R: qchisq(0.95, 2 * (n + 1)) / 2
        for (seen, mean) in [(0, 2.995732), (1, 4.743865), (5, 10.513034), (100, 118.079273)] {
            assert!((largest_mean(seen) - mean).abs() < 1e-4, "{seen}: {}", largest_mean(seen));
        }
    }
}
