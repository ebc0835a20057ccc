//! The firmware's controller behind an interface without its numbers of states and sensors.
//!
//! These are parameters of the controller's type, so each pair is compiled separately. This applies only to the code
//! in this file; the loop around it is compiled once.

use nalgebra::SVector;
use upright::control::controller::{Controller, MotorCommand, Rejected};
use upright::table::Law;

use super::bench::Bench;
use super::error::SimulationError;
use super::summary::Fall;
use crate::table::{TableValues, WithSize, with_size};

/// [`Controller`] with slices instead of arrays. A slice holds as many numbers as the table has states or sensors;
/// anything else panics.
pub(super) trait AnyController {
    /// See [`Controller::select`].
    fn select(&mut self, law: Law) -> Result<(), Rejected>;
    /// Takes `at_zero` as the counters' readings at position 0, then starts at rest at the readings `counters`.
    fn home_and_start(&mut self, at_zero: &[u32], counters: &[u32]) -> Result<(), Rejected>;
    /// See [`Controller::start_in_state`].
    fn start_in_state(&mut self, state: &[f32]);
    /// See [`Controller::set_setpoint`].
    fn set_setpoint(&mut self, position_m: f32) -> Result<(), Rejected>;
    /// See [`Controller::control`].
    fn control(&mut self, counters: &[u32]) -> MotorCommand;
    /// See [`Controller::control_from_state`].
    fn control_from_state(&mut self, state: &[f32]) -> MotorCommand;
    /// See [`Controller::predict`].
    fn predict(&mut self);
    /// See [`Controller::estimate`].
    fn estimate(&self) -> &[f32];
    /// Governed set-point (m).
    fn governed_setpoint_m(&self) -> f32;
}

impl<const NX: usize, const NY: usize> AnyController for Controller<'_, NX, NY> {
    fn select(&mut self, law: Law) -> Result<(), Rejected> {
        Controller::select(self, law)
    }

    fn home_and_start(&mut self, at_zero: &[u32], counters: &[u32]) -> Result<(), Rejected> {
        self.encoders_mut().home(array(at_zero), &[0; NY]);
        self.start(array(counters))
    }

    fn start_in_state(&mut self, state: &[f32]) {
        Controller::start_in_state(self, &SVector::from_column_slice(state));
    }

    fn set_setpoint(&mut self, position_m: f32) -> Result<(), Rejected> {
        Controller::set_setpoint(self, position_m)
    }

    fn control(&mut self, counters: &[u32]) -> MotorCommand {
        Controller::control(self, array(counters))
    }

    fn control_from_state(&mut self, state: &[f32]) -> MotorCommand {
        Controller::control_from_state(self, &SVector::from_column_slice(state))
    }

    fn predict(&mut self) {
        Controller::predict(self);
    }

    fn estimate(&self) -> &[f32] {
        Controller::estimate(self).as_slice()
    }

    fn governed_setpoint_m(&self) -> f32 {
        self.law_state().setpoint
    }
}

fn array<const N: usize>(counters: &[u32]) -> &[u32; N] {
    counters.try_into().expect("one counter per sensor of the table")
}

/// An action on controllers that returns how each run ended.
pub(super) type ControllerAction<'a> =
    &'a mut dyn FnMut(Vec<Box<dyn AnyController + '_>>) -> Result<Vec<Option<Fall>>, SimulationError>;

/// Makes `count` controllers of `table` and runs `action` with them.
///
/// # Errors
/// [`SimulationError`] if the firmware refuses the table or is not compiled for its size; those of `action`.
pub(super) fn with_controllers(
    table: &TableValues,
    count: usize,
    action: ControllerAction<'_>,
) -> Result<Vec<Option<Fall>>, SimulationError> {
    let (states, sensors) = (table.states(), table.sensors());
    with_size(states, sensors, WithControllers { table, count, action })
        .ok_or(SimulationError::Size { states, sensors })?
}

/// As [`with_controllers`], for several tables, with so many controllers of each. `made` are those made already.
///
/// # Errors
/// As for [`with_controllers`].
pub(super) fn with_controllers_of(
    tables: &[(&TableValues, usize)],
    made: Vec<Box<dyn AnyController + '_>>,
    action: ControllerAction<'_>,
) -> Result<Vec<Option<Fall>>, SimulationError> {
    let Some((&(table, count), others)) = tables.split_first() else { return action(made) };
    let mut made = Some(made);
    with_controllers(table, count, &mut |more| {
        let mut all = made.take().unwrap_or_default();
        all.extend(more);
        with_controllers_of(others, all, action)
    })
}

struct WithControllers<'a> {
    table: &'a TableValues,
    count: usize,
    action: ControllerAction<'a>,
}

impl WithSize for WithControllers<'_> {
    type Output = Result<Vec<Option<Fall>>, SimulationError>;

    fn run<const NX: usize, const NY: usize, const N: usize>(self) -> Self::Output {
        let table = self.table.table::<NX, NY>();
        let controller = Controller::new(&table, Bench::widths())?;
        let mut controllers: Vec<Box<dyn AnyController>> = Vec::with_capacity(self.count);
        for _ in 0..self.count {
            controllers.push(Box::new(controller.clone()));
        }
        (self.action)(controllers)
    }
}
