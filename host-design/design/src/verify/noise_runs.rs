//! Ripple and endurance under encoder resolution and disturbances, in long runs.

use serde::Serialize;
use upright::table::Law;

use super::error::VerifyError;
use super::needed_force::NeededForce;
use super::trial::{Disturbance, Horizon, disturbed, trial};
use crate::parallel;
use crate::plant::absolute_angles;
use crate::rig::Rig;
use crate::simulate::{SimulationError, run};
use crate::table::TableValues;

/// Several runs at rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseRun {
    /// Number of runs, with the seeds from 1.
    pub seeds: u64,
    /// How many of them survived to the end, with the motor on.
    pub survived: u64,
    /// Duration of each run (s).
    pub duration_s: f64,
    /// What was measured in the runs that survived; none if all fell.
    #[serde(flatten)]
    pub ripple: Option<MeasuredRipple>,
}

/// Root mean squares over the runs that survived, after the first tenth of each.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasuredRipple {
    /// Force on the cart (N rms).
    pub force_rms_n: f64,
    /// Largest force on the cart (N).
    pub force_peak_n: f64,
    /// Largest force that a drive needed which imposes the acceleration of a cart of given mass (N).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needed_force_n: Option<f64>,
    /// Largest share of the force that the step motor of `[reality]` has at the speed of that moment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needed_share: Option<f64>,
    /// Each state: position (m) and speed (m/s) of the cart, angle of each joint (rad) and its rate (rad/s).
    pub state_rms: Vec<f64>,
    /// Each link's angle from the vertical (rad); empty for a model.
    pub angle_rms_rad: Vec<f64>,
    /// Estimate minus true state, each state.
    pub estimate_error_rms: Vec<f64>,
}

fn most(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    one.into_iter().chain(other).reduce(f64::max)
}

#[derive(Default)]
struct Sums {
    ticks: f64,
    force: f64,
    peak: f64,
    needed: (f64, Option<f64>),
    state: Vec<f64>,
    angle: Vec<f64>,
    error: Vec<f64>,
    survives: bool,
}

/// Measures the root mean squares over runs of `duration_s` with the seeds 1 to `seeds`: nominal plant, set-point 0.
///
/// # Errors
/// [`VerifyError`] if the runs cannot be started.
pub fn noise_run(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    disturbance: &Disturbance,
    seeds: u64,
    duration_s: f64,
) -> Result<NoiseRun, VerifyError> {
    let states = rig.states();
    let links = rig.links();
    let needed = NeededForce::of(rig);
    let one = |seed: u64| -> Result<Sums, SimulationError> {
        let mut sums = Sums {
            state: vec![0.0; states],
            error: vec![0.0; states],
            angle: vec![0.0; links],
            ..Sums::default()
        };
        let fall = run(rig, table, &disturbed(rig, law, duration_s, disturbance, seed), &mut |sample| {
            sums.peak = sums.peak.max(sample.force.abs());
            if let Some(needed) = &needed {
                let (force_n, share) = needed.at(sample.force, sample.state);
                sums.needed = (sums.needed.0.max(force_n), most(share, sums.needed.1));
            }
            if sample.t < 0.1 * duration_s {
                return;
            }
            sums.ticks += 1.0;
            sums.force += sample.force * sample.force;
            for (sum, x) in sums.state.iter_mut().zip(sample.state) {
                *sum += x * x;
            }
            for (sum, (x, estimate)) in sums.error.iter_mut().zip(sample.state.iter().zip(sample.estimate)) {
                *sum += (estimate - x) * (estimate - x);
            }
            for (sum, angle) in sums.angle.iter_mut().zip(absolute_angles(sample.state)) {
                *sum += angle * angle;
            }
        })?;
        Ok(Sums { survives: fall.is_none(), ..sums })
    };
    let all: Vec<Sums> = parallel::try_map::<_, _, SimulationError>(1..=seeds, one)?;
    // Sums are taken in the order of the seeds, whichever thread made the runs.
    let survived: Vec<Sums> = all.into_iter().filter(|sums| sums.survives).collect();
    let ticks: f64 = survived.iter().map(|sums| sums.ticks).sum();
    let rms = |part: &dyn Fn(&Sums) -> f64| (survived.iter().map(part).sum::<f64>() / ticks.max(1.0)).sqrt();
    let ripple = (!survived.is_empty()).then(|| MeasuredRipple {
        force_rms_n: rms(&|sums| sums.force),
        force_peak_n: survived.iter().map(|sums| sums.peak).fold(0.0, f64::max),
        needed_force_n: needed
            .is_some()
            .then(|| survived.iter().map(|sums| sums.needed.0).fold(0.0, f64::max)),
        needed_share: survived.iter().filter_map(|sums| sums.needed.1).reduce(f64::max),
        state_rms: (0..states).map(|i| rms(&|sums| sums.state[i])).collect(),
        angle_rms_rad: (0..links).map(|i| rms(&|sums| sums.angle[i])).collect(),
        estimate_error_rms: (0..states).map(|i| rms(&|sums| sums.error[i])).collect(),
    });
    Ok(NoiseRun { seeds, survived: survived.len() as u64, duration_s, ripple })
}

/// Results of long runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Endurance {
    /// Number of runs, with the seeds from 1.
    pub seeds: u64,
    /// How many survived to the end.
    pub survived: u64,
    /// Duration of each run (s).
    pub duration_s: f64,
    /// Seeds of the runs that fell.
    pub fallen: Vec<u64>,
    /// Largest angle of any link in any run (rad).
    pub peak_angle_rad: f64,
    /// Largest force in any run (N).
    pub peak_force_n: f64,
}

/// Runs the nominal plant from rest for `duration_s` with each of the seeds 1 to `seeds`.
///
/// # Errors
/// [`VerifyError`] if the runs cannot be started.
pub fn endurance(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    disturbance: &Disturbance,
    seeds: u64,
    duration_s: f64,
) -> Result<Endurance, VerifyError> {
    let one = |seed: u64| {
        let scenario = disturbed(rig, law, duration_s, disturbance, seed);
        Ok((seed, trial(rig, table, &scenario, &Horizon::default())?))
    };
    let all: Vec<_> = parallel::try_map::<_, _, SimulationError>(1..=seeds, one)?;
    let fallen: Vec<u64> =
        all.iter().filter(|(_, outcome)| outcome.fall.is_some()).map(|&(seed, _)| seed).collect();
    Ok(Endurance {
        seeds,
        survived: seeds - fallen.len() as u64,
        duration_s,
        fallen,
        peak_angle_rad: all.iter().map(|(_, outcome)| outcome.peak_angle_rad).fold(0.0, f64::max),
        peak_force_n: all.iter().map(|(_, outcome)| outcome.peak_force_n).fold(0.0, f64::max),
    })
}
