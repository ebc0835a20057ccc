//! Why a firmware does not run, or does not do what it is told.

use upright::protocol::frame::FrameError;
use upright::protocol::message::{Answer, Request};
use upright::supervision::supervisor::State;
use upright::table::TableError;

use crate::client::Mismatch;
use upright_design::simulate::SimulationError;

/// A run with the whole firmware that could not be started or finished.
#[derive(Debug, thiserror::Error)]
pub enum HarnessError {
    /// The firmware refuses its table.
    #[error("the firmware refuses the table: {0}")]
    Table(#[from] TableError),
    /// The simulated rig cannot be run.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The virtual board stopped, saw no tick, or differs from the host; the text completes "the virtual board".
    #[error("the virtual board {0}")]
    Board(String),
    /// A frame from the firmware cannot be read.
    #[error("the firmware's answer cannot be read: {0}")]
    Frame(#[from] FrameError),
    /// The target does not support this.
    #[error("this is not possible where the firmware runs: {0}")]
    Unsupported(&'static str),
    /// No answer within the number of ticks in which the target answers every command.
    #[error("the firmware does not answer {0:?}")]
    NoAnswer(Request),
    /// The firmware refuses a command.
    #[error("the firmware refuses {request:?}: {answer:?}")]
    Refused {
        /// The request of the refused command.
        request: Request,
        /// The firmware's answer.
        answer: Answer,
    },
    /// The firmware never began to balance.
    #[error("the firmware does not begin to balance; its state is {0:?}")]
    NotBalancing(State),
    /// The firmware is not the one that the host believes to talk to.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// The scenario measures the whole state; the firmware has encoders only.
    #[error("the firmware runs from encoders: give the rig file its encoders and [kalman]")]
    FullState,
    /// The set-point steps before a command can reach the control law.
    #[error(
        "a step at {at_s} s: the command needs {least_s} s to reach the control law; give 0, or at least that"
    )]
    StepAt {
        /// Time of the step (s).
        at_s: f64,
        /// Earliest possible time other than 0 (s).
        least_s: f64,
    },
    /// Telemetry of a tick is missing.
    #[error("the telemetry of tick {0} is missing")]
    Lost(u32),
}
