//! Ripple and endurance under encoder resolution and disturbances, in long runs.

use serde::Serialize;
use upright::table::{Law, Limits};

use super::corners::MOST_LINKS;
use super::error::{VerifyError, chain, within};
use super::needed_force::NeededForce;
use super::trial::{Horizon, disturbed, leaning, trial, waking_lean};
use upright_design::parallel;
use upright_design::plant::absolute_angles;
use upright_design::reality::{corner_machine, corners_of};
use upright_design::rig::Rig;
use upright_design::simulate::{Disturbance, Scenario, SimulationError, run};
use upright_design::table::TableValues;

/// Duration of a run at a corner of `[robust]` (s).
const CORNER_S: f64 = 20.0;

/// Several runs at rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseRun {
    /// Number of runs.
    pub runs: u64,
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
    /// Largest shares of the limits at which the motor is turned off.
    pub limit_share: LimitShare,
}

/// Largest share of each limit at which the supervisor turns the motor off; none without that limit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct LimitShare {
    /// Of the way from the set-point to the limit of the rail.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rail: Option<f64>,
    /// Of the angle of any link from the vertical.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle: Option<f64>,
    /// Of the cart's speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
}

impl LimitShare {
    /// The largest of the three; none without a limit.
    pub fn largest(self) -> Option<f64> {
        most(most(self.rail, self.angle), self.speed)
    }

    fn at(limits: &Limits, state: &[f64]) -> Self {
        let &[position, speed, ..] = state else { return Self::default() };
        // In the table, a limit that is not there is the largest number.
        let share = |of: f64, limit: f32| (limit.abs() < f32::MAX).then(|| of / f64::from(limit));
        let [low, high] = limits.rail_m.map(|end| share(position, end));
        let angles = absolute_angles(state).map(f64::abs);
        Self {
            rail: most(low, high),
            angle: share(angles.fold(0.0, f64::max), limits.angle_rad),
            speed: share(speed.abs(), limits.speed_m_per_s),
        }
    }

    fn max(self, other: Self) -> Self {
        Self {
            rail: most(self.rail, other.rail),
            angle: most(self.angle, other.angle),
            speed: most(self.speed, other.speed),
        }
    }
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
    share: LimitShare,
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
    let runs: Vec<_> =
        (1..=seeds).map(|seed| (rig.clone(), disturbed(rig, law, duration_s, disturbance, seed))).collect();
    noise_of(&runs, table, duration_s)
}

/// The same with one run of 20 s at each combination of wrong masses within `[robust]`, with all of its other
/// tolerances: [`corner_machine`].
///
/// # Errors
/// [`VerifyError`] for a model, a chain of more than 9 links, or runs that cannot be started.
pub fn corner_noise(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    disturbance: &Disturbance,
) -> Result<NoiseRun, VerifyError> {
    let links = chain(rig, "masses")?.links.len();
    within("links", links as f64, 1.0..=MOST_LINKS as f64, "a chain of at most 9 links")?;
    let run_of = |number: u64| {
        let machine = corner_machine(rig, number);
        let start = leaning(&machine, &vec![waking_lean(&machine); machine.links()]);
        let scenario = disturbed(&machine, law, CORNER_S, disturbance, number + 1);
        (machine, Scenario { start, ..scenario })
    };
    let runs: Vec<_> = (0..corners_of(rig)).map(run_of).collect();
    noise_of(&runs, table, CORNER_S)
}

/// What is measured in runs of machines of one rig.
fn noise_of(runs: &[(Rig, Scenario)], table: &TableValues, duration_s: f64) -> Result<NoiseRun, VerifyError> {
    let of_first = runs.first().map(|(rig, _)| (rig.states(), rig.links(), rig.chain().is_some()));
    let (states, links, is_chain) = of_first.unwrap_or_default();
    let needed = runs.first().and_then(|(rig, _)| NeededForce::of(rig));
    let one = |(rig, scenario): &(Rig, Scenario)| -> Result<Sums, SimulationError> {
        let mut sums = Sums {
            state: vec![0.0; states],
            error: vec![0.0; states],
            angle: vec![0.0; links],
            ..Sums::default()
        };
        let fall = run(rig, table, scenario, &mut |sample| {
            sums.peak = sums.peak.max(sample.force.abs());
            if let Some(needed) = &needed {
                let (force_n, share) = needed.at(sample.force, sample.state);
                sums.needed = (sums.needed.0.max(force_n), most(share, sums.needed.1));
            }
            if sample.t < 0.1 * duration_s {
                return;
            }
            sums.ticks += 1.0;
            if is_chain {
                sums.share = sums.share.max(LimitShare::at(&table.limits, sample.state));
            }
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
    let all: Vec<Sums> = parallel::try_map::<_, _, SimulationError>(runs, one)?;
    // Sums are taken in the order of the runs, whichever thread made the runs.
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
        limit_share: survived.iter().map(|sums| sums.share).fold(LimitShare::default(), LimitShare::max),
    });
    Ok(NoiseRun { runs: runs.len() as u64, survived: survived.len() as u64, duration_s, ripple })
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
