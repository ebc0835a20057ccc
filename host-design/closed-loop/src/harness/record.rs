//! A scenario with the whole firmware: homed, raised, armed, released, recorded.

use std::collections::VecDeque;

use upright::board::Output;
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;

use super::error::HarnessError;
use super::goals::Goals;
use super::host::Host;
use super::session::Session;
use super::target::{Pace, Target};
use super::world::{Flow, Participant, World, until};
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
    let pace = target.pace();
    check(scenario, rig.tick.period_s, pace)?;
    let mut world = World::new(rig, table, scenario, target)?;
    world.raise(Some(scenario.target_m(0.0) as f32))?;
    world.goals = Goals::of(rig, scenario);
    let last = ticks(rig, scenario)?;
    let mut host = Host::new(scenario, rig.tick.period_s, pace.command_ticks);
    let mut record = RunRecord::new(rig, scenario, last, pace.telemetry_ticks.into());
    for _ in 0..=last {
        if world.tick(&mut [&mut host, &mut record])?.is_break() {
            break;
        }
    }
    if scenario.begin != Begin::ByHand && scenario.goals.is_empty() {
        record.fall = Fall::of(rig, last as f64 * rig.tick.period_s, world.bench.state());
    }
    Ok(record.finish())
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

struct RunRecord<'a> {
    rig: &'a Rig,
    scenario: &'a Scenario,
    trace: Trace,
    ticks: Vec<FirmwareTick>,
    pending: VecDeque<Pending>,
    early: Option<AnyTelemetry>,
    next_tick: Option<u32>,
    telemetry_ticks: u32,
    /// Whether the drive takes pulses: what it applies is an acceleration that only the firmware knows.
    takes_pulses: bool,
    fall: Option<Fall>,
    fault: Option<Fault>,
    worst_cycles: u32,
}

impl<'a> RunRecord<'a> {
    fn new(rig: &'a Rig, scenario: &'a Scenario, ticks: usize, telemetry_ticks: u32) -> Self {
        Self {
            rig,
            scenario,
            trace: Trace::new(rig, ticks),
            ticks: Vec::with_capacity(ticks + 1),
            pending: VecDeque::new(),
            early: None,
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
        while let Some(telemetry) = self.early.take().or_else(|| session.next_telemetry()) {
            let is_before = |tick: &Pending| (telemetry.tick.wrapping_sub(tick.number) as i32) < 0;
            let is_after = |tick: &Pending| (tick.number.wrapping_sub(telemetry.tick) as i32) < 0;
            // A board sends it within the tick: the rig's state in that tick is recorded with the next one.
            if self.pending.back().is_none_or(is_after) {
                self.early = Some(telemetry);
                return Ok(());
            }
            // Of a tick before the run.
            if self.next_tick.is_none() && self.pending.front().is_none_or(is_before) {
                continue;
            }
            let expected = self.next_tick.unwrap_or(telemetry.tick);
            if telemetry.tick != expected {
                return Err(HarnessError::Lost(expected));
            }
            // The ticks in between have no telemetry of their own.
            while self.pending.front().is_some_and(is_after) {
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

    fn finish(self) -> Recording {
        Recording {
            summary: Summary::of(self.rig, self.scenario, &self.trace, self.fall),
            trace: self.trace,
            ticks: self.ticks,
            fault: self.fault,
            worst_cycles: self.worst_cycles,
        }
    }
}

impl Participant for RunRecord<'_> {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        let t = world.ticks() as f64 * self.rig.tick.period_s;
        let state = world.bench.state().to_vec();
        // In a run that begins hanging, a link below the horizontal has fallen only while the firmware balances.
        if self.scenario.begin == Begin::ByHand || world.session.status().state == State::Balancing {
            self.fall = Fall::of(self.rig, t, &without_turns(&state));
        }
        let (number, target) = (world.session.tick_number(), self.scenario.target_m(t));
        self.pending.push_back(Pending { number, t, target, state, force: 0.0, output: *output });
        until(false)
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        self.pending.back_mut().into_iter().for_each(|tick| tick.force = world.force_n());
        self.take(&mut world.session)?;
        until(self.fall.is_some())
    }
}

impl FirmwareTick {
    fn of(telemetry: &AnyTelemetry, output: &Output) -> Self {
        let values = telemetry.estimate.iter().chain(&telemetry.innovation);
        let bits = values.chain([&telemetry.setpoint_m, &telemetry.requested_n, &telemetry.applied_n]);
        Self { output: *output, state: telemetry.state, bits: bits.map(|value| value.to_bits()).collect() }
    }
}
