//! The firmware's controller behind an interface without its numbers of states and sensors.
//!
//! These are parameters of the controller's type, so each pair is compiled separately. This applies only to the code
//! in this file; the loop around it is compiled once. A table may be smaller than its controller, see [`with_size`].

use nalgebra::SVector;
use upright::control::controller::{Controller, MotorCommand, Rejected};
use upright::supervision::debounce::Debounce;
use upright::supervision::detection::Detection;
use upright::supervision::envelope;
use upright::supervision::fault::Fault;
use upright::table::{GainTable, Law, without_errors};

use super::bench::Bench;
use super::error::SimulationError;
use super::summary::Fall;
use crate::table::{TableValues, WithSize, with_size};

/// A [`Controller`], and its supervision, with slices instead of arrays. A slice holds as many numbers as the table has
/// states or sensors; anything else panics.
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
    /// Supervises the run from here on, as the firmware does while it balances.
    fn supervise(&mut self);
    /// The fault with which the firmware turns the motor off in this tick.
    fn fault(&self) -> Option<Fault>;
}

/// The firmware's controller, and its supervision, if a run has one.
#[derive(Clone)]
struct SupervisedController<'t, const NX: usize, const NY: usize> {
    table: &'t GainTable<NX, NY>,
    controller: Controller<'t, NX, NY>,
    supervision: Option<BalancingSupervision<NY>>,
    /// Number of states in use; those beyond are 0.
    states: usize,
}

/// Fault detection, and the limits on state and force.
#[derive(Clone, Default)]
struct BalancingSupervision<const NY: usize> {
    detection: Detection<NY>,
    debounce: Debounce,
    fault: Option<Fault>,
}

impl<const NX: usize, const NY: usize> AnyController for SupervisedController<'_, NX, NY> {
    fn select(&mut self, law: Law) -> Result<(), Rejected> {
        self.controller.select(law)
    }

    fn home_and_start(&mut self, at_zero: &[u32], counters: &[u32]) -> Result<(), Rejected> {
        self.controller.encoders_mut().home(array(at_zero), &[0; NY]);
        self.controller.start(&read(self.table, counters))
    }

    fn start_in_state(&mut self, state: &[f32]) {
        self.controller.start_in_state(&padded(state));
    }

    fn set_setpoint(&mut self, position_m: f32) -> Result<(), Rejected> {
        self.controller.set_setpoint(position_m)
    }

    fn control(&mut self, counters: &[u32]) -> MotorCommand {
        let Some(BalancingSupervision { detection, .. }) = &mut self.supervision else {
            return self.controller.control(&read(self.table, counters));
        };
        let mut found = None;
        let command = self.controller.control_with(&read(self.table, counters), |counts, y, e| {
            found = detection.test(&self.table.thresholds, counts, y, e);
        });
        self.judge(&command, found.map(|finding| finding.fault));
        command
    }

    fn control_from_state(&mut self, state: &[f32]) -> MotorCommand {
        let command = self.controller.control_from_state(&padded(state));
        self.judge(&command, None);
        command
    }

    fn predict(&mut self) {
        match &mut self.supervision {
            None => self.controller.predict(),
            Some(BalancingSupervision { detection, .. }) => {
                self.controller.predict_with(|counts, corrected, force| {
                    detection.finish_tick(&self.table.thresholds.motor, counts, corrected, force);
                })
            }
        }
    }

    fn estimate(&self) -> &[f32] {
        let (in_use, _) = self.controller.estimate().as_slice().split_at(self.states);
        in_use
    }

    fn governed_setpoint_m(&self) -> f32 {
        self.controller.law_state().setpoint
    }

    fn supervise(&mut self) {
        let detection = Detection::of_motor(self.table.drive.witness());
        let mut supervision = BalancingSupervision { detection, ..BalancingSupervision::default() };
        let positions = self.controller.positions();
        supervision.detection.start(self.controller.encoders().counts(), &positions.data.0[0]);
        self.supervision = Some(supervision);
    }

    fn fault(&self) -> Option<Fault> {
        self.supervision.as_ref()?.fault
    }
}

impl<const NX: usize, const NY: usize> SupervisedController<'_, NX, NY> {
    /// The fault of this tick, in the firmware's order: limits on the state, what detection has `found`, force.
    fn judge(&mut self, command: &MotorCommand, found: Option<Fault>) {
        let Some(supervision) = &mut self.supervision else { return };
        let limits = &self.table.limits;
        let is_limited = command.requested_n != command.applied_n;
        let of_force = supervision.debounce.check_force(limits, is_limited);
        let exceeded = envelope::exceeded(limits, self.controller.estimate().as_slice(), command.requested_n);
        supervision.fault = exceeded.or(found).or(of_force);
    }
}

/// `state`, and 0 for states beyond it.
fn padded<const NX: usize>(state: &[f32]) -> SVector<f32, NX> {
    SVector::from_fn(|row, _| state.get(row).copied().unwrap_or_default())
}

/// What the firmware makes of the readings of the counters.
fn read<const NX: usize, const NY: usize>(table: &GainTable<NX, NY>, counters: &[u32]) -> [u32; NY] {
    let mut read = *array(counters);
    without_errors(&table.sensors, &mut read);
    read
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
        let table = self.table.padded::<NX, NY>();
        let controller = Controller::new(&table, Bench::widths())?;
        let states = self.table.states();
        let one = SupervisedController { table: &table, controller, supervision: None, states };
        let mut controllers: Vec<Box<dyn AnyController>> = Vec::with_capacity(self.count);
        for _ in 0..self.count {
            controllers.push(Box::new(one.clone()));
        }
        (self.action)(controllers)
    }
}
