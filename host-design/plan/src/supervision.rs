//! The supervisor's limits while the rig moves: wider than what healthy machines reach.

use upright::table::MotionLimits;

use super::closed_loop::LOST_RAD;
use super::robustness::{MotionSpread, drawn};
use upright_design::motion::Transition;
use upright_design::parallel;
use upright_design::rig::Rig;
use upright_design::simulate::{Disturbance, Extremes, Scenario, SimulationError, follow};
use upright_design::table::TableValues;

/// Number of healthy machines that make all motions; the first one has no errors.
const MACHINES: u64 = 12;
/// Seed of the first machine; not among the seeds with which motions are chosen and judged.
const BASE_SEED: u64 = 20_000;
/// Time to balance before the lowering (s): wrong zeros of the encoders move the cart away from its set-point.
const BALANCE_S: f64 = 1.5;
/// Factor on the largest values that the machines reach.
const MARGIN: f64 = 2.0;
/// The allowed distance of the cart from its planned position is at least this (m).
const LEAST_DEVIATION_M: f64 = 0.02;
/// The same on a stepper, where no defect of the motor moves the cart in the pulses' count: with 20 mm, runs that
/// arrive from starts that just count as hanging are stopped.
const LEAST_DEVIATION_ON_STEPPER_M: f64 = 0.03;
/// Factor on the largest speed of the cart that the machines reach.
const SPEED_MARGIN: f64 = 1.2;

/// Sets the limits and thresholds with which the firmware supervises the motions of `table`. They come from runs of
/// machines with the rig's noise and with errors of masses, friction, start and encoder zeros within the spreads of
/// `[swing_up]`. Does nothing without motions.
///
/// # Errors
/// [`SimulationError`] if the runs cannot be made.
pub(crate) fn set_limits(rig: &Rig, table: &mut TableValues) -> Result<(), SimulationError> {
    let Some(chain) = rig.chain() else { return Ok(()) };
    let reached = healthy(rig, table)?;
    let (usual, balancing) = (table.limits, table.thresholds);
    let Some(swing_up) = &mut table.swing_up else { return Ok(()) };
    let least_m = if chain.input.is_force() { LEAST_DEVIATION_M } else { LEAST_DEVIATION_ON_STEPPER_M };
    swing_up.limits = MotionLimits {
        deviation_rad: (MARGIN * reached.deviation_rad).max(LOST_RAD) as f32,
        deviation_m: (MARGIN * reached.deviation_m).max(least_m) as f32,
        speed_m_per_s: usual.speed_m_per_s.max((SPEED_MARGIN * reached.speed_m_per_s) as f32),
        rail_m: chain.rail_in_motion_m(usual.rail_m),
    };
    swing_up.thresholds = balancing;
    let thresholds = &mut swing_up.thresholds;
    // Nobody pushes a rig that moves as planned.
    thresholds.push.fill(f32::MAX);
    let of_motor = rig.actuator.input().motor_sensor();
    let before = thresholds.innovation[of_motor];
    for (sensor, (innovation, moved)) in reached.innovation.iter().zip(&reached.moved).enumerate() {
        // The innovation from the rig's noise at rest adds to that from a wrong model in motion.
        let wider = 1.0 + (MARGIN * innovation) as f32 / thresholds.innovation[sensor];
        thresholds.innovation[sensor] *= wider;
        let frozen = (thresholds.frozen[sensor] * wider).max((MARGIN * moved) as f32);
        thresholds.frozen[sensor] = frozen.min(f32::MAX);
    }
    thresholds.motor.energy *= (thresholds.innovation[of_motor] / before).powi(2);
    Ok(())
}

/// The extremes that healthy machines reach; runs that are lost do not count.
fn healthy(rig: &Rig, table: &TableValues) -> Result<Extremes, SimulationError> {
    let spread = MotionSpread::asked(rig);
    let disturbance = Disturbance::of(rig);
    let balance_ticks = (BALANCE_S / rig.tick.period_s) as usize;
    let quiet = Scenario { substeps: 2, ..Scenario::swing_up(rig, 0.0, None) };
    let others: Vec<Transition> = table
        .swing_up
        .iter()
        .flat_map(|swing_up| swing_up.others.iter().map(|(transition, _)| *transition))
        .collect();
    // Each machine is raised and lowered, and then makes each of the other motions from rest.
    let one = |number: u64| {
        let (number, motion) = (number % MACHINES, (number / MACHINES) as usize);
        let other = motion.checked_sub(1);
        let transition = other.map_or(Transition::Up, |other| others[other]);
        if number == 0 {
            let [start, _] = transition.ends(rig.states(), |_| false);
            return follow(rig, table, &Scenario { start, ..quiet.clone() }, other, balance_ticks);
        }
        let seed = BASE_SEED + number;
        let (machine, start) = drawn(rig, transition, &spread, seed);
        let scenario = Scenario {
            start,
            seed,
            force_noise_n: disturbance.force_n,
            torque_noise_n_m: disturbance.torque_n_m,
            ..quiet.clone()
        };
        follow(&machine, table, &scenario, other, balance_ticks)
    };
    let all: Vec<_> = parallel::try_map(0..MACHINES * (1 + others.len() as u64), one)?;
    let mut most = Extremes::none(table.sensors());
    let arrived = all.iter().flatten().filter(|reached| has_arrived(rig, reached));
    arrived.for_each(|reached| most.include(reached));
    Ok(most)
}

/// Whether a run has kept to its plan and to the rail.
fn has_arrived(rig: &Rig, reached: &Extremes) -> bool {
    let Some(chain) = rig.chain() else { return false };
    let [low, high] = chain.cart.travel_m;
    reached.deviation_rad <= LOST_RAD && low < reached.travel_m[0] && reached.travel_m[1] < high
}
