//! The loop with the firmware's own controller: several runs advance together.

use super::ReproduceError;
use super::course::Course;
use upright_design::rig::Rig;
use upright_design::simulate::{Job, Sample, Scenario, run_all, ticks};
use upright_design::table::TableValues;

/// A run of the firmware's controller.
pub(super) struct FirmwareRun {
    /// The rig.
    pub(super) rig: Rig,
    /// Its table.
    pub(super) table: TableValues,
    /// What happens in the run.
    pub(super) scenario: Scenario,
}

/// The time histories of these runs, each recorded at its tick.
///
/// # Errors
/// [`ReproduceError::Simulation`] if a run cannot be made.
pub(super) fn courses(runs: &[FirmwareRun]) -> Result<Vec<Course>, ReproduceError> {
    let mut courses = Vec::with_capacity(runs.len());
    for FirmwareRun { rig, scenario, .. } in runs {
        courses.push(Course::with_room(rig.tick.period_s, ticks(rig, scenario)? + 1));
    }
    let mut observers: Vec<_> = courses
        .iter_mut()
        .map(|course| move |sample: &Sample<&[f64]>| course.push(sample.state, sample.force))
        .collect();
    let mut jobs: Vec<Job<'_>> = observers
        .iter_mut()
        .zip(runs)
        .map(|(observe, FirmwareRun { rig, table, scenario })| Job { table, rig, scenario, observe })
        .collect();
    let falls = run_all(&mut jobs)?;
    for (course, fall) in courses.iter_mut().zip(falls) {
        course.fall = fall;
    }
    Ok(courses)
}
