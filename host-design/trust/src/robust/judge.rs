//! Judges by simulation whether a loop survives the tolerances.

use serde::{Deserialize, Serialize};
use upright::table::Law;

use crate::verify::{VerifyError, corner_noise, disturbed, leaning, waking_lean};
use upright_design::plant::absolute_angles;
use upright_design::reality::tolerated_machine;
use upright_design::rig::{Rig, Tolerances};
use upright_design::simulate::{Disturbance, FallKind, Scenario, SimulationError, run};
use upright_design::study::{Study, infinite_if_null};
use upright_design::table::TableValues;

/// Shares of the tolerances that are tried. A loop may survive with much friction and fall with little.
pub(super) const SHARES: [f64; 4] = [0.0, 0.5, 1.0, 1.25];
/// Angle by which every link leans at the start (rad).
const LEAN_RAD: f64 = 5e-4;

/// The runs in which a loop has to survive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JudgeSettings {
    /// Number of runs with each share of the tolerances, with the seeds from 1.
    pub runs: u64,
    /// Duration of each run (s).
    pub duration_s: f64,
    /// Disturbances of the runs.
    pub disturbance: Disturbance,
}

impl JudgeSettings {
    /// 4 runs of 60 s with the disturbances that the rig file expects.
    pub fn of(rig: &Rig) -> Self {
        Self { runs: 4, duration_s: 60.0, disturbance: Disturbance::of(rig) }
    }
}

/// Results of the runs on one machine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Runs {
    /// Share of the tolerances that the machine has.
    pub share: f64,
    /// Number of runs.
    pub runs: u64,
    /// In how many the firmware kept the motor on to the end.
    pub survived: u64,
    /// How the first of the others ended.
    pub ended_by: Option<FallKind>,
    /// Force on the cart (N rms), or its acceleration (m/s² rms) where the drive imposes that, over the runs that
    /// survived, after the first tenth.
    pub force_rms_n: f64,
    /// Largest angle of a link from the vertical in the runs that survived (rad).
    pub peak_angle_rad: f64,
    /// Largest distance of the cart from its set-point in the runs that survived (m).
    pub peak_position_m: f64,
}

/// What a loop survives.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// The law in the loop.
    pub law: Law,
    /// Runs with friction, zero errors and latency together, beginning with none of them.
    pub machines: Vec<Runs>,
    /// Combinations of mass errors, with all other tolerances: how many there are and how many survive.
    pub corners: Option<[u64; 2]>,
}

impl Judgement {
    /// Whether all runs survived.
    pub fn survives(&self) -> bool {
        self.machines.iter().all(|machine| machine.survived == machine.runs)
            && self.corners.is_none_or(|[all, survived]| survived == all)
    }
}

/// Runs the loop of `table`, with the firmware's limits and fault detection, on machines with shares of the tolerances,
/// and at every combination of mass errors. The machines with each share are a part of `study`; a shard leaves the
/// combinations of mass errors to the merge.
///
/// # Errors
/// [`VerifyError`] if the runs cannot be started.
pub fn judge(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    tolerances: &Tolerances,
    settings: &JudgeSettings,
    study: &Study,
) -> Result<Judgement, VerifyError> {
    if let Some((what, value, accepts)) = tolerances.too_large(rig.tick.period_s) {
        return Err(VerifyError::Setting { what, value, accepts });
    }
    let machines = SHARES.into_iter().map(|share| {
        let machine = tolerated_machine(rig, tolerances, share);
        let of_number = |number: u64| -> Result<JudgedRun, VerifyError> {
            Ok(one(&machine, table, law, settings, number + 1)?)
        };
        let part = format!("{}, share {share}", law.key());
        Ok(summary(share, &study.outcomes(&part, settings.runs, of_number)?))
    });
    let machines = machines.collect::<Result<_, VerifyError>>()?;
    let corners = if tolerances.mass_percent > 0.0 && !study.is_shard() {
        let tolerating = Rig { robust: Some(tolerances.clone()), ..rig.clone() };
        let found = corner_noise(&tolerating, table, law, &settings.disturbance)?;
        Some([found.runs, found.survived])
    } else {
        None
    };
    Ok(Judgement { law, machines, corners })
}

/// Result of one run.
#[derive(Serialize, Deserialize)]
pub(super) struct JudgedRun {
    pub(super) ended_by: Option<FallKind>,
    /// Time of the last tick (s): that of a fall.
    #[serde(skip)]
    pub(super) survived_s: f64,
    ticks: f64,
    #[serde(deserialize_with = "infinite_if_null")]
    force: f64,
    #[serde(deserialize_with = "infinite_if_null")]
    angle_rad: f64,
    #[serde(deserialize_with = "infinite_if_null")]
    position_m: f64,
}

/// One run on `machine`.
pub(super) fn one(
    machine: &Rig,
    table: &TableValues,
    law: Law,
    settings: &JudgeSettings,
    seed: u64,
) -> Result<JudgedRun, SimulationError> {
    let scenario = Scenario {
        start: leaning(machine, &vec![LEAN_RAD.max(waking_lean(machine)); machine.links()]),
        ..disturbed(machine, law, settings.duration_s, &settings.disturbance, seed)
    };
    let mut outcome = JudgedRun {
        ended_by: None,
        survived_s: 0.0,
        ticks: 0.0,
        force: 0.0,
        angle_rad: 0.0,
        position_m: 0.0,
    };
    let fall = run(machine, table, &scenario, &mut |sample| {
        outcome.survived_s = sample.t;
        let angles = absolute_angles(sample.state);
        outcome.angle_rad = angles.fold(outcome.angle_rad, |largest, angle| largest.max(angle.abs()));
        outcome.position_m = outcome.position_m.max(sample.state[0].abs());
        if sample.t >= 0.1 * settings.duration_s {
            outcome.ticks += 1.0;
            outcome.force += sample.force * sample.force;
        }
    })?;
    outcome.ended_by = fall.map(|fall| fall.kind);
    Ok(outcome)
}

fn summary(share: f64, all: &[JudgedRun]) -> Runs {
    let survived = || all.iter().filter(|outcome| outcome.ended_by.is_none());
    let ticks: f64 = survived().map(|outcome| outcome.ticks).sum();
    Runs {
        share,
        runs: all.len() as u64,
        survived: survived().count() as u64,
        ended_by: all.iter().find_map(|outcome| outcome.ended_by),
        force_rms_n: (survived().map(|outcome| outcome.force).sum::<f64>() / ticks.max(1.0)).sqrt(),
        peak_angle_rad: survived().map(|outcome| outcome.angle_rad).fold(0.0, f64::max),
        peak_position_m: survived().map(|outcome| outcome.position_m).fold(0.0, f64::max),
    }
}
