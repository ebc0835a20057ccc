//! A rig with its firmware, and the person beside it.

use std::time::Duration;

use upright_closed_loop::harness::HarnessError;
use upright_design::simulate::SimulationError;
use upright_design::table::WriteError;

use super::step::CommissionStep;
use super::task::PersonTask;
use crate::in_the_loop::RunError;

/// A rig with its firmware at the other end of a line, and the person beside it.
pub trait MachineAtHand {
    /// Sends bytes to the firmware, and returns what it sends within the next milliseconds.
    ///
    /// # Errors
    /// [`Stop`] if the line is closed, or the person wants to stop.
    fn exchange(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Stop>;

    /// Time since 1970.
    fn now(&self) -> Duration;

    /// Tells the person what to do. It does not wait until it is done, except for consent.
    ///
    /// # Errors
    /// [`Stop::Aborted`] if the person does not want to.
    fn ask(&mut self, task: PersonTask) -> Result<(), Stop>;

    /// How long the person may take for a task.
    fn patience(&self) -> Duration;

    /// Whether the person wants to go back from a step that was not passed to [`back`](CommissionStep::back).
    fn again(&mut self, failed: CommissionStep, back: CommissionStep) -> bool;
}

/// Why a rig is not commissioned.
#[derive(Debug, thiserror::Error)]
pub enum Stop {
    /// The machine is not as it has to be: it must not be run.
    #[error("{0}")]
    Machine(String),
    /// The line is closed, or the firmware is silent.
    #[error("{0}")]
    Line(String),
    /// The simulated machine does not run.
    #[error(transparent)]
    Simulated(#[from] RunError),
    /// The person wants to stop.
    #[error("stopped; the motor is off")]
    Aborted,
    /// The record cannot be written.
    #[error(transparent)]
    Record(#[from] WriteError),
}

impl From<HarnessError> for Stop {
    fn from(error: HarnessError) -> Self {
        RunError::from(error).into()
    }
}

impl From<SimulationError> for Stop {
    fn from(error: SimulationError) -> Self {
        HarnessError::from(error).into()
    }
}
