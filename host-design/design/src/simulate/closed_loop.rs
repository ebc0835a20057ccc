//! Ticks of the firmware's controller, plant in between.

use nalgebra::SVector;
use upright::control::controller::{Controller, Rejected};
use upright::table::TableError;

use super::bench::Bench;
use super::scenario::{Scenario, Sensing};
use super::summary::{Fall, FallKind, Summary};
use super::trace::{Sample, Trace};
use crate::plant::PlantError;
use crate::rig::{PlantDescription, Rig};
use crate::table::{TableValues, WithSize, with_size};

/// Most ticks of a run: an hour at 1 ms, and a record of some 450 MB for a quadruple pendulum.
const MAX_TICKS: u32 = 4_000_000;

/// A run that cannot be started.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// No compiled plant has this many links.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The firmware refuses the table.
    #[error("the firmware refuses the table: {0}")]
    Table(#[from] TableError),
    /// The firmware refuses a command of the scenario.
    #[error("the firmware rejects the scenario: {0}")]
    Rejected(#[from] Rejected),
    /// A standard deviation that is negative or not finite.
    #[error("a noise level of {0} is not possible: give a number of at least 0")]
    Noise(f64),
    /// The supervisor never let the motor be turned on.
    #[error("the firmware does not begin to balance: {0:?}")]
    NotBalancing(Option<upright::supervision::fault::Cause>),
    /// A disturbing force that is not finite.
    #[error("a constant force of {0} N is not possible: give a finite number")]
    Offset(f64),
    /// A run whose record would not fit into memory.
    #[error("a run of {duration_s} s has more than {MAX_TICKS} ticks of {period_s} s: shorten it")]
    TooLong {
        /// Length of the run (s).
        duration_s: f64,
        /// Control period (s).
        period_s: f64,
    },
    /// Dimensions the firmware's types are not made for.
    #[error("no firmware for {states} states and {sensors} sensors")]
    Size {
        /// States of the table.
        states: usize,
        /// Sensors of the table.
        sensors: usize,
    },
}

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

/// As [`simulate`], but keeps no record: `observe` sees every tick. The plant is that of `rig`, which need not be the one
/// the table was designed for.
///
/// # Errors
/// As for [`simulate`].
pub fn run(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    observe: &mut dyn FnMut(&Sample<&[f64]>),
) -> Result<Option<Fall>, SimulationError> {
    let (states, sensors) = (table.states, table.sensors);
    let run = Run { rig, table, scenario, observe };
    with_size(states, sensors, run).ok_or(SimulationError::Size { states, sensors })?
}

/// Number of the run's last tick.
pub fn ticks(rig: &Rig, scenario: &Scenario) -> Result<usize, SimulationError> {
    let (duration_s, period_s) = (scenario.duration_s, rig.tick.period_s);
    let ticks = (duration_s / period_s).round();
    if ticks > f64::from(MAX_TICKS) {
        return Err(SimulationError::TooLong { duration_s, period_s });
    }
    Ok(ticks as usize)
}

struct Run<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    scenario: &'a Scenario,
    observe: &'a mut dyn FnMut(&Sample<&[f64]>),
}

impl WithSize for Run<'_> {
    type Output = Result<Option<Fall>, SimulationError>;

    fn run<const NX: usize, const NY: usize>(self) -> Self::Output {
        let Self { rig, table: values, scenario, observe } = self;
        let table = values.table::<NX, NY>();
        let mut controller = Controller::new(&table, &values.build(), Bench::widths())?;
        controller.select(scenario.law)?;
        let mut bench = Bench::new(rig, scenario)?;
        let full_state = |bench: &Bench| SVector::from_fn(|i, _| bench.state()[i] as f32);
        match scenario.sensing {
            Sensing::FullState => controller.start_in_state(&full_state(&bench)),
            Sensing::Encoders => {
                // Homed where the counters show `counter_start`.
                controller.encoders_mut().home(&bench.counters_at_zero(), &[0; NY]);
                controller.start(&bench.counters())?;
            }
        }
        for tick in 0..=ticks(rig, scenario)? {
            let t = tick as f64 * rig.tick.period_s;
            let target = if t >= scenario.step_at_s { scenario.step_m } else { 0.0 };
            controller.set_setpoint(target as f32)?;
            let command = match scenario.sensing {
                Sensing::FullState => controller.control_from_state(&full_state(&bench)),
                Sensing::Encoders => controller.control(&bench.counters()),
            };
            let before: [f64; NX] = core::array::from_fn(|i| bench.state()[i]);
            let estimate: [f64; NX] = core::array::from_fn(|i| f64::from(controller.estimate()[i]));
            let fall = Fall::of(rig, t, &before);
            let force = bench.tick(command.drive);
            observe(&Sample {
                t,
                target,
                setpoint: f64::from(controller.law_state().setpoint),
                requested: f64::from(command.requested_n),
                force,
                state: &before,
                estimate: &estimate,
            });
            if fall.is_some() {
                return Ok(fall);
            }
            controller.predict();
        }
        Ok(None)
    }
}

impl Fall {
    /// Whether `state` is beyond rescue: a link below the horizontal, the cart off its rail, a model's state out of
    /// all proportion, or anything that is not a number.
    pub fn of(rig: &Rig, at_s: f64, state: &[f64]) -> Option<Self> {
        let kind = match &rig.plant {
            _ if !state.iter().all(|value| value.is_finite()) => FallKind::NotFinite,
            PlantDescription::Chain(chain) => {
                let mut absolute = 0.0;
                let fallen = state[2..].chunks_exact(2).position(|joint| {
                    absolute += joint[0];
                    absolute.abs() > core::f64::consts::FRAC_PI_2
                });
                let [left, right] = chain.cart.travel_m;
                match fallen {
                    Some(index) => FallKind::Link(index + 1),
                    None if state[0] < left || state[0] > right => FallKind::EndOfRail,
                    None => return None,
                }
            }
            PlantDescription::Model(_) if state.iter().any(|value| value.abs() > 1e6) => FallKind::Diverged,
            PlantDescription::Model(_) => return None,
        };
        Some(Self { at_s, kind })
    }
}
