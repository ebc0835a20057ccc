//! The loop with the firmware's own controller: several runs advance together.

use super::ReproduceError;
use super::trajectory::Trajectory;
use upright_design::rig::Rig;
use upright_design::simulate::{Job, Sample, Scenario, run_all, ticks};
use upright_design::table::TableValues;

/// A run of the firmware's controller.
pub(crate) struct FirmwareRun {
    /// The rig.
    pub(crate) rig: Rig,
    /// Its table.
    pub(crate) table: TableValues,
    /// What happens in the run.
    pub(crate) scenario: Scenario,
}

/// The time histories of these runs, each recorded at its tick.
///
/// # Errors
/// [`ReproduceError::Simulation`] if a run cannot be made.
pub(crate) fn trajectories(runs: &[FirmwareRun]) -> Result<Vec<Trajectory>, ReproduceError> {
    let mut trajectories = Vec::with_capacity(runs.len());
    for FirmwareRun { rig, scenario, .. } in runs {
        trajectories.push(Trajectory::with_room(rig.tick.period_s, ticks(rig, scenario)? + 1));
    }
    let mut observers: Vec<_> = trajectories
        .iter_mut()
        .map(|trajectory| move |sample: &Sample<&[f64]>| trajectory.push(sample.state, sample.force))
        .collect();
    let mut jobs: Vec<Job<'_>> = observers
        .iter_mut()
        .zip(runs)
        .map(|(observe, FirmwareRun { rig, table, scenario })| Job { table, rig, scenario, observe })
        .collect();
    let falls = run_all(&mut jobs)?;
    for (trajectory, fall) in trajectories.iter_mut().zip(falls) {
        trajectory.fall = fall;
    }
    Ok(trajectories)
}
