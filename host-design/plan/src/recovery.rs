//! Random runs of the whole firmware in which a pull fells the rig: the motor stills the links and raises them again.

use core::fmt;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use upright::board::Output;
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::Request;
use upright::supervision::jog::MotorSign;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::SwingUpError;
use super::robustness::{MotionSpread, drawn};
use upright_closed_loop::harness::{
    Flow, HarnessError, Participant, RailEnds, Target, World, until, with_firmware,
};
use upright_design::motion::Transition;
use upright_design::plant::ChainParameters;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::study::Study;
use upright_design::table::TableValues;

/// Time for which the raised rig balances before the pull, and after it stands again (s).
const BALANCE_S: f64 = 1.0;
/// Longest time of a run (s).
const LONGEST_S: f64 = 90.0;
/// Time between two commands that may be refused (s), longer than that after which a key counts as released.
const RETRY_S: f64 = 0.3;
/// A rig that cannot be raised for so long is stilled again (s): links without friction swing on.
const PATIENCE_S: f64 = 1.0;
/// Time in which a slow pull grows to its torque (s).
const SLOW_S: f64 = 20.0;
/// Share of a pull that is left of it then.
const WEAK: f64 = 0.1;

/// How a run has ended.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Recovered {
    /// The fault with which the rig fell.
    pub fall: Option<String>,
    /// Time from the fall until the links hung still (s), if they did.
    pub still_s: Option<f64>,
    /// Time from the fall until the rig balanced again (s), if it did so to the end.
    pub upright_s: Option<f64>,
    /// The fault that ended the run, if one did.
    pub ended: Option<String>,
}

/// Runs of the whole firmware with `table`, which has motions, on machines like `rig` with the errors of `[swing_up]`,
/// with the seeds from `seed` on. A pull at the first joint fells each, at once or slowly.
///
/// # Errors
/// [`SwingUpError`] if the firmware does not run.
pub fn recovered(
    rig: &Rig,
    table: &TableValues,
    (seed, runs): (u64, u64),
    study: &Study,
) -> Result<Vec<Recovered>, SwingUpError> {
    study.outcomes("recovery", runs, |number| {
        with_firmware(table, |target| recover(rig, table, seed + number, target))
            .flatten()
            .map_err(|error| SwingUpError::Firmware(error.to_string()))
    })
}

fn recover(
    rig: &Rig,
    table: &TableValues,
    seed: u64,
    target: &mut dyn Target,
) -> Result<Recovered, HarnessError> {
    let (machine, start) = drawn(rig, Transition::Up, &MotionSpread::asked(rig), seed);
    let scenario = Scenario { seed, start, substeps: 2, ..Scenario::swing_up(&machine, 0.0, None) };
    let mut world = World::new(&machine, table, &scenario, target)?;
    world.raise(None)?;
    let mut person = Person::of(rig, seed);
    world.run(person.ticks(LONGEST_S), &mut [&mut RailEnds::of(rig), &mut person])?;
    Ok(person.seen)
}

/// A person who pulls until the rig falls, and then gives the commands that raise it again.
struct Person {
    period_s: f64,
    torques_n_m: Vec<f64>,
    /// Time in which the pull grows to these torques (s).
    grows_s: f64,
    /// Ticks in which the rig has balanced in a row, and those for which it waits to be raised.
    balanced: usize,
    waits: usize,
    fell_at: Option<usize>,
    seen: Recovered,
}

impl Person {
    fn of(rig: &Rig, seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let links = rig.chain().map(ChainParameters::<f64>::of);
        let side = if random.random() { 1.0 } else { -1.0 };
        // More than the weight of the links turns the first one over.
        let weight_n_m = links.as_ref().map_or(0.0, |links| links.weight[0]);
        let mut torques_n_m = vec![0.0; links.map_or(0, |links| links.weight.len())];
        torques_n_m[0] = side * weight_n_m * random.random_range(0.5..1.5);
        // On a stepper, a jerk at a link is taken for an encoder that jumps: there the pull is weak, and grows slowly.
        let is_slow = rig.actuator.pulses().is_some();
        torques_n_m[0] *= if is_slow { WEAK } else { 1.0 };
        Self {
            period_s: rig.tick.period_s,
            torques_n_m,
            grows_s: if is_slow { SLOW_S } else { 0.0 },
            balanced: 0,
            waits: 0,
            fell_at: None,
            seen: Recovered::default(),
        }
    }

    fn ticks(&self, seconds: f64) -> usize {
        (seconds / self.period_s).ceil() as usize
    }
}

impl Participant for Person {
    fn say(&mut self, world: &World<'_>) -> Option<Request> {
        let (tick, status) = (world.ticks(), world.session.status());
        let is_due = |seconds: f64| tick.is_multiple_of(self.ticks(seconds));
        self.fell_at?;
        match status.state {
            State::Jogging => is_due(KEEP_ALIVE.as_secs_f64()).then_some(Request::Jog { along: true }),
            State::Calibrated if !is_due(RETRY_S) => None,
            State::Calibrated
                if self.waits > self.ticks(PATIENCE_S) && status.motor == MotorSign::Checked =>
            {
                Some(Request::Still)
            }
            State::Calibrated if status.motor != MotorSign::Checked => Some(Request::Jog { along: true }),
            State::Calibrated => Some(Request::Goto(Equilibrium::UPRIGHT)),
            _ => None,
        }
    }

    fn act(&mut self, world: &mut World<'_>, _: &mut Output) -> Flow {
        if self.fell_at.is_none()
            && let Some(since) = self.balanced.checked_sub(self.ticks(BALANCE_S))
        {
            let share =
                if self.grows_s > 0.0 { (since as f64 * self.period_s / self.grows_s).min(1.0) } else { 1.0 };
            let torques: Vec<f64> = self.torques_n_m.iter().map(|torque| share * torque).collect();
            world.bench.pull(0.0, &torques);
        }
        until(false)
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        let (tick, state) = (world.ticks(), world.session.status().state);
        let fault = world.session.fault().map(|fault| fault.to_string());
        self.balanced = if state == State::Balancing { self.balanced + 1 } else { 0 };
        let Some(fell_at) = self.fell_at else {
            if fault.is_some() {
                self.fell_at = Some(tick);
                self.seen.fall = fault;
            }
            return until(state == State::Fault);
        };
        let since_s = (tick - fell_at) as f64 * self.period_s;
        if state == State::Calibrated {
            self.seen.still_s.get_or_insert(since_s);
        }
        self.waits = if state == State::Calibrated { self.waits + 1 } else { 0 };
        let stands = self.balanced > self.ticks(BALANCE_S);
        if stands {
            self.seen.upright_s = Some(since_s - BALANCE_S);
        }
        // A second fall ends the run, too.
        let is_lost = self.seen.still_s.is_some() && fault.is_some();
        if is_lost || state == State::Fault {
            self.seen.ended = fault;
        }
        until(stands || is_lost || state == State::Fault)
    }
}

/// What the runs say about a rig.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RecoveryRuns {
    /// Runs in which the rig fell.
    pub falls: usize,
    /// Of these, runs in which it balanced again in the end, without a person who touched it.
    pub recovered: usize,
    /// Longest time from a fall until the links hung still (s); 0 without one.
    pub longest_still_s: f64,
    /// Median of the times from a fall until the rig balanced again (s); infinite if most did not.
    pub median_upright_s: f64,
}

impl RecoveryRuns {
    /// Sums up `all`.
    pub fn of(all: &[Recovered]) -> Self {
        let fallen: Vec<&Recovered> = all.iter().filter(|run| run.fall.is_some()).collect();
        let mut times: Vec<f64> = fallen.iter().map(|run| run.upright_s.unwrap_or(f64::INFINITY)).collect();
        times.sort_by(f64::total_cmp);
        Self {
            falls: fallen.len(),
            recovered: times.iter().filter(|time| time.is_finite()).count(),
            longest_still_s: fallen.iter().filter_map(|run| run.still_s).fold(0.0, f64::max),
            median_upright_s: times.get(times.len() / 2).copied().unwrap_or(f64::INFINITY),
        }
    }
}

impl fmt::Display for RecoveryRuns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { falls, recovered, longest_still_s, median_upright_s } = self;
        write!(
            f,
            "{recovered} of {falls} stilled and raised again, still after {longest_still_s:.1} s at most"
        )?;
        if median_upright_s.is_finite() {
            write!(f, ", half upright after {median_upright_s:.1} s")
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_does_not_stand_again_is_not_recovered_and_one_that_never_fell_does_not_count() {
        let fell = |still_s, upright_s| Recovered {
            fall: Some("angle".to_owned()),
            still_s,
            upright_s,
            ended: None,
        };
        let runs =
            [fell(Some(3.0), Some(8.0)), fell(Some(5.0), None), Recovered::default(), fell(None, None)];
        let found = RecoveryRuns::of(&runs);
        assert_eq!((found.falls, found.recovered, found.longest_still_s), (3, 1, 5.0));
        assert_eq!(found.median_upright_s, f64::INFINITY, "most do not stand again");
        assert!(found.to_string().starts_with("1 of 3 "), "{found}");
        assert_eq!(RecoveryRuns::of(&runs[..1]).median_upright_s, 8.0);
    }
}
