//! Ticks of the firmware's controller, plant in between.

use nalgebra::SVector;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use upright::controller::{Controller, Rejected};
use upright::table::TableError;

use super::scenario::Scenario;
use super::summary::{Fall, FallKind, Summary};
use super::trace::{Sample, Trace};
use crate::plant::{LinearSimulation, Plant, PlantError, chain_plant};
use crate::rig::{PlantDescription, Rig};
use crate::table::{MAX_STATES, TableValues, WithStates, with_states};

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
    /// A run whose record would not fit into memory.
    #[error("a run of {duration_s} s has more than {MAX_TICKS} ticks of {period_s} s: shorten it")]
    TooLong {
        /// Length of the run (s).
        duration_s: f64,
        /// Control period (s).
        period_s: f64,
    },
    /// More states than the firmware's types are made for.
    #[error("{0} states are more than the {MAX_STATES} a gain table can hold")]
    TooManyStates(usize),
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
    let states = rig.states();
    let run = Run { rig, table, scenario };
    let (trace, fall) = with_states(states, run).ok_or(SimulationError::TooManyStates(states))??;
    let summary = Summary::of(rig, scenario, &trace, fall);
    Ok((trace, summary))
}

struct Run<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    scenario: &'a Scenario,
}

impl WithStates for Run<'_> {
    type Output = Result<(Trace, Option<Fall>), SimulationError>;

    fn run<const NX: usize>(self) -> Self::Output {
        let Self { rig, table: values, scenario } = self;
        let table = values.table::<NX>();
        let mut controller = Controller::new(&table, &values.build())?;
        controller.select(scenario.law)?;
        let mut plant: Box<dyn Plant> = match &rig.plant {
            PlantDescription::Chain(chain) => chain_plant(chain)?,
            PlantDescription::Model(model) => Box::new(LinearSimulation::of(model)),
        };
        plant.set_state(&scenario.start);

        let mut random = Pcg64::seed_from_u64(scenario.seed);
        let noise = |level: f64| Normal::new(0.0, level).map_err(|_| SimulationError::Noise(level));
        let (force_noise, torque_noise) = (noise(scenario.force_noise_n)?, noise(scenario.torque_noise_n_m)?);
        let mut torques = vec![0.0; plant.disturbances()];

        let period = rig.tick.period_s;
        let ticks = (scenario.duration_s / period).round();
        if ticks > f64::from(MAX_TICKS) {
            return Err(SimulationError::TooLong { duration_s: scenario.duration_s, period_s: period });
        }
        let ticks = ticks as usize;
        let mut trace = Trace::new(rig);
        let mut state = [0.0; NX];
        let mut on_its_way = 0.0;
        for tick in 0..=ticks {
            let t = tick as f64 * period;
            plant.write_state(&mut state);
            let fall = Fall::of(rig, t, &state);
            let setpoint = if t >= scenario.step_at_s { scenario.step_m } else { 0.0 };
            controller.set_setpoint(setpoint as f32)?;
            let force = controller.tick(&SVector::from_fn(|i, _| state[i] as f32));
            let computed = f64::from(force.limited);
            let applied = if values.delay_ticks == 1 { on_its_way } else { computed };
            on_its_way = computed;
            trace.push(Sample { t, setpoint, state: &state, requested: f64::from(force.requested), applied });
            if fall.is_some() {
                return Ok((trace, fall));
            }
            let disturbance = force_noise.sample(&mut random);
            torques.fill_with(|| torque_noise.sample(&mut random));
            plant.advance(applied + disturbance, &torques, period, scenario.substeps);
        }
        Ok((trace, None))
    }
}

impl Fall {
    /// Whether `state` is beyond rescue: a link below the horizontal, the cart off its rail, a model's state out of
    /// all proportion, or anything that is not a number.
    fn of(rig: &Rig, at_s: f64, state: &[f64]) -> Option<Self> {
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
