//! A scenario with the whole firmware: homed, raised, armed, released, recorded.

use std::collections::VecDeque;

use upright::board::Output;
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::error::HarnessError;
use super::host::Host;
use super::session::Session;
use super::start_up::Harness;
use super::target::{Pace, Target};
use crate::client::AnyTelemetry;
use upright_design::plant::without_turns;
use upright_design::rig::Rig;
use upright_design::simulate::{Begin, Fall, Sample, Scenario, Sensing, Summary, Trace, ticks};
use upright_design::table::TableValues;

/// One tick of a run, bit by bit: two runs are equal if all of their ticks are.
#[derive(Debug, Clone, PartialEq)]
pub struct FirmwareTick {
    /// Output to the power stage.
    pub output: Output,
    /// State of the supervisor.
    pub state: State,
    /// Raw bits of estimate, innovation, governed set-point, requested force and applied force, in this order.
    pub bits: Vec<u32>,
}

/// A run with the whole firmware.
#[derive(Debug, Clone)]
pub struct Recording {
    /// The record, in the form of a simulation's.
    pub trace: Trace,
    /// Figures of the run, in the form of a simulation's.
    pub summary: Summary,
    /// The firmware's own bits, tick by tick.
    pub ticks: Vec<FirmwareTick>,
    /// The fault that turned the motor off, if there was one.
    pub fault: Option<Fault>,
    /// Longest execution of a tick: cycles of the image; 0 on the host.
    pub worst_cycles: u32,
}

/// Runs `scenario` with the firmware `target`, which has the table `table`, against the plant of `rig`. A hand homes
/// the rig while it hangs, checks the signs, raises the links and holds them at the scenario's start until the
/// firmware begins to balance. It lets go in that tick, which is time 0. For a swing-up it lets the links hang, and
/// time 0 is the first tick in which they are raised.
///
/// # Errors
/// [`HarnessError`] if the firmware cannot run this scenario, or does not begin to balance.
pub fn record(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    target: &mut dyn Target,
) -> Result<Recording, HarnessError> {
    let period_s = rig.tick.period_s;
    let pace = target.pace();
    check(scenario, period_s, pace)?;
    let mut harness = Harness::new(rig, table, scenario, target)?;
    let target_at = |tick: usize| scenario.target_m(tick as f64 * period_s);
    let mut output = harness.raise(Some(target_at(0) as f32))?;
    let last = ticks(rig, scenario)?;
    let mut record = RunRecord::new(rig, last, pace.telemetry_ticks.into());
    let goals = goals(scenario, period_s);
    let mut host = Host::new(scenario, period_s, pace.command_ticks);
    for tick in 0..=last {
        if tick > 0 {
            let inputs = harness.inputs();
            output = harness.session.tick(&inputs)?;
        }
        // At most one command per tick.
        if !harness.ask_for(tick, &goals)
            && let Some(request) = host.request(tick)
        {
            harness.session.send(request);
        }
        let t = tick as f64 * period_s;
        // In a run that begins hanging, a link below the horizontal has fallen only while the firmware balances.
        let balances = scenario.begin == Begin::ByHand || harness.session.status().state == State::Balancing;
        let fall = if balances { Fall::of(rig, t, &without_turns(harness.bench.state())) } else { None };
        let state = harness.bench.state().to_vec();
        let force = harness.bench.tick(output.drive);
        let number = harness.session.tick_number();
        record.pending.push_back(Pending { number, t, target: target_at(tick), state, force, output });
        record.take(&mut harness.session)?;
        if fall.is_some() {
            record.fall = fall;
            break;
        }
    }
    if scenario.begin != Begin::ByHand && goals.is_empty() {
        record.fall = Fall::of(rig, last as f64 * period_s, harness.bench.state());
    }
    // The last tick's telemetry may come with the next one.
    let inputs = harness.inputs();
    harness.session.tick(&inputs)?;
    record.take(&mut harness.session)?;
    Ok(record.finish(rig, scenario))
}

/// The goals of a scenario, each with the tick from which it is requested.
pub fn goals(scenario: &Scenario, period_s: f64) -> Vec<(usize, Equilibrium)> {
    scenario.goals.iter().map(|goal| ((goal.at_s / period_s).round() as usize, goal.to)).collect()
}

/// Whether the firmware can run this scenario.
fn check(scenario: &Scenario, period_s: f64, pace: Pace) -> Result<(), HarnessError> {
    if scenario.sensing != Sensing::Encoders {
        return Err(HarnessError::FullState);
    }
    let least_s = pace.command_ticks as f64 * period_s;
    if scenario.step_at_s > 0.0 && scenario.step_at_s < least_s {
        return Err(HarnessError::StepAt { at_s: scenario.step_at_s, least_s });
    }
    Ok(())
}

/// A tick whose telemetry has not arrived yet.
struct Pending {
    number: u32,
    t: f64,
    target: f64,
    state: Vec<f64>,
    force: f64,
    output: Output,
}

struct RunRecord {
    trace: Trace,
    ticks: Vec<FirmwareTick>,
    pending: VecDeque<Pending>,
    next_tick: Option<u32>,
    telemetry_ticks: u32,
    /// Whether the drive takes pulses: what it applies is an acceleration that only the firmware knows.
    takes_pulses: bool,
    fall: Option<Fall>,
    fault: Option<Fault>,
    worst_cycles: u32,
}

impl RunRecord {
    fn new(rig: &Rig, ticks: usize, telemetry_ticks: u32) -> Self {
        Self {
            trace: Trace::new(rig, ticks),
            ticks: Vec::with_capacity(ticks + 1),
            pending: VecDeque::new(),
            next_tick: None,
            telemetry_ticks,
            takes_pulses: rig.actuator.held().is_motion(),
            fall: None,
            fault: None,
            worst_cycles: 0,
        }
    }

    /// Joins the telemetry of each tick with the true state of the bench in that tick.
    fn take(&mut self, session: &mut Session<'_>) -> Result<(), HarnessError> {
        while let Some(telemetry) = session.next_telemetry() {
            if self.next_tick.is_none() && !telemetry.state.controls() {
                continue;
            }
            let expected = self.next_tick.unwrap_or(telemetry.tick);
            if telemetry.tick != expected {
                return Err(HarnessError::Lost(expected));
            }
            // The ticks in between have no telemetry of their own.
            let older = |first: &Pending| (first.number.wrapping_sub(telemetry.tick) as i32) < 0;
            while self.pending.front().is_some_and(older) {
                self.pending.pop_front();
            }
            let Some(Pending { t, target, state, force, output, .. }) = self.pending.pop_front() else {
                return Ok(());
            };
            self.next_tick = Some(expected.wrapping_add(self.telemetry_ticks));
            self.worst_cycles = self.worst_cycles.max(telemetry.cycles);
            self.fault = self.fault.or(telemetry.fault);
            let estimate: Vec<f64> = telemetry.estimate.iter().map(|&value| f64::from(value)).collect();
            self.trace.push(&Sample {
                t,
                target,
                setpoint: f64::from(telemetry.setpoint_m),
                requested: f64::from(telemetry.requested_n),
                force: if self.takes_pulses { f64::from(telemetry.applied_n) } else { force },
                state: &state,
                estimate: &estimate,
            });
            self.ticks.push(FirmwareTick::of(&telemetry, &output));
        }
        Ok(())
    }

    fn finish(self, rig: &Rig, scenario: &Scenario) -> Recording {
        Recording {
            summary: Summary::of(rig, scenario, &self.trace, self.fall),
            trace: self.trace,
            ticks: self.ticks,
            fault: self.fault,
            worst_cycles: self.worst_cycles,
        }
    }
}

impl FirmwareTick {
    fn of(telemetry: &AnyTelemetry, output: &Output) -> Self {
        let values = telemetry.estimate.iter().chain(&telemetry.innovation);
        let bits = values.chain([&telemetry.setpoint_m, &telemetry.requested_n, &telemetry.applied_n]);
        Self { output: *output, state: telemetry.state, bits: bits.map(|value| value.to_bits()).collect() }
    }
}
