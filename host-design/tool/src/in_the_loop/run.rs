//! A scenario with the whole firmware: homed, armed, released, observed.

use std::collections::VecDeque;
use std::path::Path;

use upright::board::Output;
use upright::protocol::message::{Request, Telemetry};
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;

use super::in_process::{InProcess, Queues};
use super::qemu::{Emulator, Link};
use super::session::{Session, SessionError};
use super::stage::Stage;
use upright_design::rig::Rig;
use upright_design::simulate::{Fall, Sample, Scenario, Sensing, SimulationError, Summary, Trace, ticks};
use upright_design::table::{TableValues, WithSize, with_firmware_size};

/// Where the firmware runs.
#[derive(Debug, Clone, Copy)]
pub enum Where<'a> {
    /// In this process.
    Host,
    /// As this image in QEMU.
    Qemu {
        /// The ELF file.
        image: &'a Path,
        /// What its pins are.
        link: Link,
    },
}

/// A scenario that could not be run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The firmware.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The simulated bench.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The firmware knows encoders only.
    #[error("the firmware runs from encoders: give the rig file its encoders and [kalman]")]
    FullState,
    /// A command takes its time to the control law.
    #[error("a step at {at_s} s: the firmware has to hear of it {least_s} s ahead; give 0, or at least that")]
    StepAt {
        /// What was asked for (s).
        at_s: f64,
        /// What is possible (s).
        least_s: f64,
    },
    /// Telemetry of a tick is missing.
    #[error("the telemetry of tick {0} is missing")]
    Lost(u32),
}

impl From<super::target::TargetError> for RunError {
    fn from(error: super::target::TargetError) -> Self {
        RunError::Session(error.into())
    }
}

/// One tick of a run, with all bits: two runs are equal if these are.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// What went to the power stage.
    pub output: Output,
    /// State of the supervisor.
    pub state: State,
    /// Raw bits of estimate, innovation, governed set-point, force asked for and force applied, in this order.
    pub bits: Vec<u32>,
}

/// A run with the whole firmware.
#[derive(Debug, Clone)]
pub struct Recording {
    /// As of a simulation.
    pub trace: Trace,
    /// As of a simulation.
    pub summary: Summary,
    /// The firmware's own bits, tick by tick.
    pub ticks: Vec<Tick>,
    /// The fault that has ended the balancing, if one has.
    pub fault: Option<Fault>,
    /// Longest execution of a tick: instructions of the image in QEMU; 0 on the host.
    pub worst_cycles: u32,
}

/// Runs `scenario` with the firmware of `table` against the plant of `rig`. A hand homes the rig while it hangs, checks the
/// signs, raises the links and holds them at the scenario's start until the firmware begins to balance; it lets go in
/// that tick: time 0.
///
/// # Errors
/// [`RunError`] if the firmware does not run, or refuses to begin.
pub fn run(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    place: Where<'_>,
) -> Result<Recording, RunError> {
    if scenario.sensing != Sensing::Encoders {
        return Err(RunError::FullState);
    }
    let least_s = TICKS_TO_OBEY as f64 * rig.tick.period_s;
    if scenario.step_at_s > 0.0 && scenario.step_at_s < least_s {
        return Err(RunError::StepAt { at_s: scenario.step_at_s, least_s });
    }
    let (states, sensors) = (table.states, table.sensors);
    with_firmware_size(states, sensors, Run { rig, table, scenario, place })
        .ok_or(SimulationError::Size { states, sensors })?
}

struct Run<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    scenario: &'a Scenario,
    place: Where<'a>,
}

impl WithSize for Run<'_> {
    type Output = Result<Recording, RunError>;

    fn run<const NX: usize, const NY: usize>(self) -> Self::Output {
        match self.place {
            Where::Host => {
                let (table, mut queues) = (self.table.table::<NX, NY>(), Queues::default());
                let mut target = InProcess::new(&mut queues, &table, &self.table.build())?;
                self.with::<NX, NY>(Session::new(&mut target))
            }
            Where::Qemu { image, link } => {
                let mut target = Emulator::start(image, link)?;
                self.with::<NX, NY>(Session::new(&mut target))
            }
        }
    }
}

impl Run<'_> {
    fn with<const NX: usize, const NY: usize>(
        self,
        session: Session<'_, NX, NY>,
    ) -> Result<Recording, RunError> {
        let Self { rig, table, scenario, .. } = self;
        let mut stage = Stage::new(rig, table, scenario, session)?;
        let target_at = |tick: usize| {
            let t = tick as f64 * rig.tick.period_s;
            if t >= scenario.step_at_s { scenario.step_m } else { 0.0 }
        };
        let mut output = stage.raise(target_at(0) as f32)?;
        let mut asked = target_at(0);
        let last = ticks(rig, scenario)?;
        let mut record = Record::new(rig, last);
        let beat = (BEAT_S / rig.tick.period_s).max(1.0) as usize;
        for tick in 0..=last {
            if tick > 0 {
                output = stage.session.tick(&stage.inputs())?;
            }
            // What is sent from now on comes with the next tick and counts in the one after the next.
            let ahead = target_at(tick + TICKS_TO_OBEY);
            if asked != ahead {
                stage.session.send(Request::Setpoint(ahead as f32));
                asked = ahead;
            } else if tick.is_multiple_of(beat) {
                stage.session.send(Request::Beat);
            }
            let t = tick as f64 * rig.tick.period_s;
            let fall = Fall::of(rig, t, stage.bench.state());
            let state = stage.bench.state().to_vec();
            let force = stage.bench.tick(output.drive);
            record.waiting.push_back(Pending { t, target: target_at(tick), state, force, output });
            record.take(&mut stage.session)?;
            if fall.is_some() {
                record.fall = fall;
                break;
            }
        }
        // What the firmware said of the last tick may come with the next one.
        stage.session.tick(&stage.inputs())?;
        record.take(&mut stage.session)?;
        let summary = Summary::of(rig, scenario, &record.trace, record.fall);
        Ok(Recording {
            trace: record.trace,
            summary,
            ticks: record.ticks,
            fault: record.fault,
            worst_cycles: record.worst_cycles,
        })
    }
}

/// Between two signs of life for a firmware whose set-point the host commands (s).
const BEAT_S: f64 = 0.025;
/// A command is taken in the tick after the one it came with, and obeyed from the next on.
const TICKS_TO_OBEY: usize = 3;

/// A tick whose telemetry has not come yet.
struct Pending {
    t: f64,
    target: f64,
    state: Vec<f64>,
    force: f64,
    output: Output,
}

struct Record {
    trace: Trace,
    ticks: Vec<Tick>,
    waiting: VecDeque<Pending>,
    next_tick: Option<u32>,
    fall: Option<Fall>,
    fault: Option<Fault>,
    worst_cycles: u32,
}

impl Record {
    fn new(rig: &Rig, ticks: usize) -> Self {
        Self {
            trace: Trace::new(rig, ticks),
            ticks: Vec::with_capacity(ticks + 1),
            waiting: VecDeque::new(),
            next_tick: None,
            fall: None,
            fault: None,
            worst_cycles: 0,
        }
    }

    /// Joins what the firmware says of a tick with what the bench knows of it.
    fn take<const NX: usize, const NY: usize>(
        &mut self,
        session: &mut Session<'_, NX, NY>,
    ) -> Result<(), RunError> {
        while let Some(telemetry) = session.next_telemetry() {
            if self.next_tick.is_none() && telemetry.state != State::Balancing {
                continue;
            }
            let expected = self.next_tick.unwrap_or(telemetry.tick);
            if telemetry.tick != expected {
                return Err(RunError::Lost(expected));
            }
            let Some(Pending { t, target, state, force, output }) = self.waiting.pop_front() else {
                return Ok(());
            };
            self.next_tick = Some(expected.wrapping_add(1));
            self.worst_cycles = self.worst_cycles.max(telemetry.cycles);
            self.fault = self.fault.or(telemetry.fault);
            let estimate: Vec<f64> = telemetry.estimate.iter().map(|&value| f64::from(value)).collect();
            self.trace.push(&Sample {
                t,
                target,
                setpoint: f64::from(telemetry.setpoint_m),
                requested: f64::from(telemetry.requested_n),
                force,
                state: &state,
                estimate: &estimate,
            });
            self.ticks.push(Tick::of(&telemetry, &output));
        }
        Ok(())
    }
}

impl Tick {
    fn of<const NX: usize, const NY: usize>(telemetry: &Telemetry<NX, NY>, output: &Output) -> Self {
        let values = telemetry.estimate.iter().chain(&telemetry.innovation);
        let bits = values.chain([&telemetry.setpoint_m, &telemetry.requested_n, &telemetry.applied_n]);
        Self { output: *output, state: telemetry.state, bits: bits.map(|value| value.to_bits()).collect() }
    }
}
