//! Runs the firmware's controller tick by tick, and the plant between the ticks.

use core::ops::ControlFlow;

use upright::control::actuator::Drive;
use upright::control::controller::MotorCommand;

use super::any_controller::{AnyController, with_controllers};
use super::bench::Bench;
use super::error::{MAX_TICKS, SimulationError};
use super::scenario::{Scenario, Sensing};
use super::summary::{Fall, FallKind, Summary};
use super::trace::{Sample, Trace};
use crate::rig::Rig;
use crate::table::TableValues;

/// Runs `scenario`: the firmware's controller, built from `table`, against the nonlinear plant of `rig` (or the given
/// linear model). A run ends early when the pendulum has fallen, or when the firmware's supervision turns the motor
/// off, if the scenario asks for that.
///
/// # Errors
/// [`SimulationError`] if the firmware refuses the table or the scenario, or the plant cannot be built.
pub fn simulate(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
) -> Result<(Trace, Summary), SimulationError> {
    let mut trace = Trace::new(rig, ticks(rig, scenario)?);
    let fall = run(rig, table, scenario, &mut |sample| trace.push(sample))?;
    let summary = Summary::of(rig, scenario, &trace, fall);
    Ok((trace, summary))
}

/// As [`simulate`], but without a record: `observe` is called in every tick. The plant is that of `rig`, which need not
/// be the one that the table was designed for.
///
/// # Errors
/// As for [`simulate`].
pub fn run(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    observe: &mut dyn FnMut(&Sample<&[f64]>),
) -> Result<Option<Fall>, SimulationError> {
    let falls = with_controllers(table, 1, &mut |controllers| {
        let mut falls = Vec::new();
        for mut controller in controllers {
            falls.push(alone(
                ClosedLoopRun::start(rig, controller.as_mut(), table.sensors(), scenario)?,
                observe,
            )?);
        }
        Ok(falls)
    })?;
    Ok(falls.into_iter().next().flatten())
}

/// Runs `run` to its end by itself, not in lockstep.
pub(super) fn alone(
    mut run: ClosedLoopRun<'_>,
    observe: &mut dyn FnMut(&Sample<&[f64]>),
) -> Result<Option<Fall>, SimulationError> {
    loop {
        let command = run.control()?;
        let mut force = run.bench.tick(command.drive);
        if let Drive::Steps(_) = command.drive {
            force = f64::from(command.applied_n);
        }
        if let ControlFlow::Break(fall) = run.finish(&command, force, observe) {
            return Ok(fall);
        }
    }
}

/// Number of the run's last tick.
///
/// # Errors
/// [`SimulationError::TooLong`] if the record would not fit into memory.
pub fn ticks(rig: &Rig, scenario: &Scenario) -> Result<usize, SimulationError> {
    let (duration_s, period_s) = (scenario.duration_s, rig.tick.period_s);
    let ticks = (duration_s / period_s).round();
    if ticks > f64::from(MAX_TICKS) {
        return Err(SimulationError::TooLong { duration_s, period_s });
    }
    Ok(ticks as usize)
}

/// A run with its controller, tick by tick.
pub(super) struct ClosedLoopRun<'a> {
    rig: &'a Rig,
    scenario: &'a Scenario,
    controller: &'a mut dyn AnyController,
    pub(super) bench: Bench,
    counters: Vec<u32>,
    measured: Vec<f32>,
    state: Vec<f64>,
    estimate: Vec<f64>,
    tick: usize,
    last_tick: usize,
}

impl<'a> ClosedLoopRun<'a> {
    /// A run through `scenario` with this controller, which reads `sensors` counters.
    pub(super) fn start(
        rig: &'a Rig,
        controller: &'a mut dyn AnyController,
        sensors: usize,
        scenario: &'a Scenario,
    ) -> Result<Self, SimulationError> {
        if rig.actuator.held().is_motion() && scenario.sensing == Sensing::FullState {
            return Err(match rig.kalman {
                Some(_) => SimulationError::FullState,
                None => SimulationError::NoObserver,
            });
        }
        controller.select(scenario.law)?;
        let mut bench = Bench::new(rig, scenario)?;
        let (mut counters, mut at_zero) = (vec![0; sensors], vec![0; sensors]);
        let measured = single(bench.state());
        match scenario.sensing {
            Sensing::FullState => controller.start_in_state(&measured),
            Sensing::Encoders => {
                // Homed where the counters show `counter_start`.
                bench.read_counters_at_zero(&mut at_zero);
                bench.read_counters(&mut counters);
                controller.home_and_start(&at_zero, &counters)?;
            }
        }
        if scenario.is_supervised {
            controller.supervise();
        }
        let (state, estimate) = (bench.state().to_vec(), vec![0.0; measured.len()]);
        let last_tick = ticks(rig, scenario)?;
        Ok(Self { rig, scenario, controller, bench, counters, measured, state, estimate, tick: 0, last_tick })
    }

    fn time_s(&self) -> f64 {
        self.tick as f64 * self.rig.tick.period_s
    }

    /// Runs the controller for this tick and returns its command.
    pub(super) fn control(&mut self) -> Result<MotorCommand, SimulationError> {
        self.controller.set_setpoint(self.scenario.target_m(self.time_s()) as f32)?;
        self.state.copy_from_slice(self.bench.state());
        let mut command = match self.scenario.sensing {
            Sensing::FullState => {
                copy_converted(&mut self.measured, &self.state, |value| value as f32);
                self.controller.control_from_state(&self.measured)
            }
            Sensing::Encoders => {
                self.bench.read_counters(&mut self.counters);
                self.controller.control(&self.counters)
            }
        };
        if let Some(push) = &self.scenario.push
            && let Some(chain) = self.rig.chain()
            && let Some((force_n, torques_n_m)) = push.in_tick(self.time_s(), chain, &self.state)
        {
            self.bench.pull(force_n, &torques_n_m);
        }
        copy_converted(&mut self.estimate, self.controller.estimate(), f64::from);
        if self.controller.fault().is_some() {
            command.drive = Drive::OFF;
        }
        Ok(command)
    }

    /// Ends this tick, in which the bench was simulated with `force` (N) at its start. When the run ends, breaks with
    /// the fall, if there was one.
    pub(super) fn finish(
        &mut self,
        command: &MotorCommand,
        force: f64,
        observe: &mut dyn FnMut(&Sample<&[f64]>),
    ) -> ControlFlow<Option<Fall>> {
        let t = self.time_s();
        observe(&Sample {
            t,
            target: self.scenario.target_m(t),
            setpoint: f64::from(self.controller.governed_setpoint_m()),
            requested: f64::from(command.requested_n),
            force,
            state: &self.state,
            estimate: &self.estimate,
        });
        let off = self.controller.fault().map(|fault| Fall { at_s: t, kind: FallKind::MotorOff(fault) });
        let fall = Fall::of(self.rig, t, &self.state).or(off);
        if fall.is_some() || self.tick == self.last_tick {
            return ControlFlow::Break(fall);
        }
        self.controller.predict();
        self.tick += 1;
        ControlFlow::Continue(())
    }
}

fn single(state: &[f64]) -> Vec<f32> {
    state.iter().map(|&value| value as f32).collect()
}

#[inline]
fn copy_converted<A: Copy, B>(to: &mut [B], from: &[A], convert: impl Fn(A) -> B) {
    for index in 0..to.len().min(from.len()) {
        to[index] = convert(from[index]);
    }
}
