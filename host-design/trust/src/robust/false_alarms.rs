//! Rate of false alarms: hours of balancing with the whole firmware on machines without a defect.

use serde::{Deserialize, Serialize};
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::{Answer, Request};
use upright::table::Law;

use crate::verify::{VerifyError, at_rest_disturbed, chain, moved_setpoint_m};
use upright_closed_loop::harness::{Flow, HarnessError, Participant, World, until, with_firmware};
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
        let mut world = World::new(machine, table, &scenario, target)?;
        let mut watched = HealthyRun::new(machine, table);
        if let Err(error) = world.raise(None) {
            // The motor may have been turned off before the machine balanced.
            watched.found.fault = Some(world.session.fault().ok_or(error)?.to_string());
            return Ok(watched.found);
        }
        world.run(watched.ticks(seconds), &mut [&mut watched])?;
        // It goes on balancing until the answer arrives.
        if let Answer::Statistics(statistics) = world.ask(Request::Statistics)? {
            watched.found.rejected = statistics.rejected_samples;
        }
        Ok(watched.found)
    })?
}

/// A host that moves the set-point, and watches the firmware's telemetry.
struct HealthyRun<'a> {
    /// Largest innovation of each sensor that is no fault.
    largest: &'a [f32],
    setpoint_m: f32,
    period_s: f64,
    found: Healthy,
}

impl<'a> HealthyRun<'a> {
    fn new(rig: &Rig, table: &'a TableValues) -> Self {
        let thresholds = &table.thresholds;
        let largest = if thresholds.survives_pushes() { &thresholds.push } else { &thresholds.innovation };
        let found = Healthy { balanced_s: 0.0, fault: None, rejected: 0, closest: 0.0 };
        Self { largest, setpoint_m: moved_setpoint_m(table) as f32, period_s: rig.tick.period_s, found }
    }

    fn ticks(&self, seconds: f64) -> usize {
        (seconds / self.period_s) as usize
    }
}

impl Participant for HealthyRun<'_> {
    fn say(&mut self, world: &World<'_>) -> Option<Request> {
        let (side, keep_alive) = (self.ticks(SIDE_S).max(1), self.ticks(KEEP_ALIVE.as_secs_f64()).max(1));
        let tick = world.ticks();
        if tick.is_multiple_of(side) {
            let sign = if (tick / side).is_multiple_of(2) { 1.0 } else { -1.0 };
            return Some(Request::Setpoint(sign * self.setpoint_m));
        }
        tick.is_multiple_of(keep_alive).then_some(Request::KeepAlive)
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        while let Some(telemetry) = world.session.next_telemetry() {
            for (innovation, largest) in telemetry.innovation.iter().zip(self.largest) {
                self.found.closest = self.found.closest.max(innovation.abs() / largest);
            }
        }
        self.found.fault = world.session.fault().map(|fault| fault.to_string());
        if self.found.fault.is_some() {
            return until(true);
        }
        self.found.balanced_s = world.ticks() as f64 * self.period_s;
        until(false)
    }
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
