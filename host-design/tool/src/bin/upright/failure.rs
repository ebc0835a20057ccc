//! Errors of the tool and their exit status.

use std::error::Error;
use std::fmt::{self, Display};
use std::io::ErrorKind;
use std::process::ExitCode;

use upright_closed_loop::harness::HarnessError;
use upright_design::design::DesignError;
use upright_design::rig::RigError;
use upright_design::table::NoTable;
use upright_identify::{CoverageError, IdentifyError};
use upright_plan::SwingUpError;
use upright_tool::campaign::CampaignError;
use upright_tool::commission::Stop;
use upright_tool::image::BuildError;
use upright_tool::in_the_loop::RunError;
use upright_tool::site::SiteError;
use upright_trust::robust::RobustError;

/// Why a command ends without its result, and with which exit status.
pub(crate) struct Failure {
    words: String,
    exit_status: u8,
}

impl<E: Error + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        let exit_status = exit_status(&error);
        match (&error as &dyn Error).is::<std::io::Error>() {
            true => Self { words: format!("the output cannot be written: {error}"), exit_status },
            false => Self { words: error.to_string(), exit_status },
        }
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)
    }
}

impl Failure {
    /// An error of the rig with this name, or in this file.
    pub(crate) fn of_rig(rig: impl Display, error: impl Error + 'static) -> Self {
        Self { words: format!("{rig}: {error}"), exit_status: exit_status(&error) }
    }

    /// A check has failed.
    pub(crate) fn check(words: impl Into<String>) -> Self {
        Self { words: words.into(), exit_status: 1 }
    }

    /// An argument cannot be used.
    pub(crate) fn argument(words: impl Into<String>) -> Self {
        Self { words: words.into(), exit_status: 2 }
    }

    /// The problem has no solution.
    pub(crate) fn no_solution(words: impl Into<String>) -> Self {
        Self { words: words.into(), exit_status: 3 }
    }

    /// A program is missing.
    pub(crate) fn no_program(words: impl Into<String>) -> Self {
        Self { words: words.into(), exit_status: 4 }
    }

    /// Prints the error and returns the exit status.
    pub(crate) fn report(&self) -> ExitCode {
        if self.exit_status != 0 {
            eprintln!("upright: {self}");
        }
        ExitCode::from(self.exit_status)
    }
}

/// The exit status of an error: 2, bad input, for all that are not named here.
fn exit_status(error: &(dyn Error + 'static)) -> u8 {
    if let Some(error) = error.downcast_ref::<RigError>() {
        error.exit_code()
    } else if error.is::<DesignError>()
        || error.is::<NoTable>()
        || matches!(error.downcast_ref(), Some(RobustError::Unhelped(_) | RobustError::Design(_)))
        || error.downcast_ref().is_some_and(SwingUpError::is_without_solution)
        || error.downcast_ref().is_some_and(IdentifyError::is_without_solution)
    {
        3
    } else if let Some(CoverageError::Identify(error)) = error.downcast_ref() {
        exit_status(error)
    } else if let Some(error) = error.downcast_ref::<RunError>() {
        exit_status_of_a_run(error)
    } else if let Some(CampaignError::Trial { .. }) = error.downcast_ref() {
        1
    } else if matches!(error.downcast_ref(), Some(BuildError::NoCompiler(_)))
        || matches!(error.downcast_ref(), Some(SiteError::NoCompiler(_)))
    {
        4
    } else if let Some(stop) = error.downcast_ref() {
        match stop {
            Stop::Machine(_) => 3,
            Stop::Line(_) | Stop::Aborted => 1,
            Stop::Simulated(error) => exit_status(error),
            Stop::Record(error) => exit_status(error),
        }
    } else if error.downcast_ref().is_some_and(|error: &std::io::Error| error.kind() == ErrorKind::BrokenPipe)
    {
        // The reader of a pipe has closed it: not an error.
        0
    } else {
        2
    }
}

fn exit_status_of_a_run(error: &RunError) -> u8 {
    match error {
        // The scenario is at fault, not the firmware.
        RunError::Harness(
            HarnessError::Simulation(_)
            | HarnessError::FullState
            | HarnessError::StepAt { .. }
            | HarnessError::Lost(_),
        )
        | RunError::Socket(_) => 2,
        _ => 1,
    }
}
