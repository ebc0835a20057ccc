//! Ticks of the firmware's controller, and of the plant in between.

use super::any_controller::{AnyController, with_controller};
use super::bench::Bench;
use super::error::{MAX_TICKS, SimulationError};
use super::scenario::{Scenario, Sensing};
use super::summary::{Fall, Summary};
use super::trace::{Sample, Trace};
use crate::rig::Rig;
use crate::table::TableValues;

/// Runs `scenario`: the firmware's controller, built from `table`, against the nonlinear plant of `rig` (or the given
/// linear model). A run ends early when the pendulum has fallen.
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

/// As [`simulate`], but without a record: `observe` is called in every tick. The plant is that of `rig`, which need not be
/// the one that the table was designed for.
///
/// # Errors
/// As for [`simulate`].
pub fn run(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    observe: &mut dyn FnMut(&Sample<&[f64]>),
) -> Result<Option<Fall>, SimulationError> {
    with_controller(table, &mut |controller| closed_loop(rig, controller, table.sensors(), scenario, observe))
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

/// A run with this controller, which has `sensors` counters.
fn closed_loop(
    rig: &Rig,
    controller: &mut dyn AnyController,
    sensors: usize,
    scenario: &Scenario,
    observe: &mut dyn FnMut(&Sample<&[f64]>),
) -> Result<Option<Fall>, SimulationError> {
    controller.select(scenario.law)?;
    let mut bench = Bench::new(rig, scenario)?;
    let (mut counters, mut at_zero) = (vec![0; sensors], vec![0; sensors]);
    let mut measured = single(bench.state());
    match scenario.sensing {
        Sensing::FullState => controller.start_in_state(&measured),
        Sensing::Encoders => {
            // Homed where the counters show `counter_start`.
            bench.read_counters_at_zero(&mut at_zero);
            bench.read_counters(&mut counters);
            controller.home_and_start(&at_zero, &counters)?;
        }
    }
    let (mut state, mut estimate) = (bench.state().to_vec(), vec![0.0; measured.len()]);
    for tick in 0..=ticks(rig, scenario)? {
        let t = tick as f64 * rig.tick.period_s;
        let target = scenario.target_m(t);
        controller.set_setpoint(target as f32)?;
        state.copy_from_slice(bench.state());
        let command = match scenario.sensing {
            Sensing::FullState => {
                copy_converted(&mut measured, &state, |value| value as f32);
                controller.control_from_state(&measured)
            }
            Sensing::Encoders => {
                bench.read_counters(&mut counters);
                controller.control(&counters)
            }
        };
        copy_converted(&mut estimate, controller.estimate(), f64::from);
        let fall = Fall::of(rig, t, &state);
        let force = bench.tick(command.drive);
        observe(&Sample {
            t,
            target,
            setpoint: f64::from(controller.governed_setpoint_m()),
            requested: f64::from(command.requested_n),
            force,
            state: &state,
            estimate: &estimate,
        });
        if fall.is_some() {
            return Ok(fall);
        }
        controller.predict();
    }
    Ok(None)
}

fn single(state: &[f64]) -> Vec<f32> {
    state.iter().map(|&value| value as f32).collect()
}

#[inline]
fn copy_converted<A: Copy, B>(to: &mut [B], from: &[A], convert: impl Fn(A) -> B) {
    for (to, &from) in to.iter_mut().zip(from) {
        *to = convert(from);
    }
}
