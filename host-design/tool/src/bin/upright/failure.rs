//! Errors of the tool and their exit status.

use std::process::ExitCode;

use upright_design::design::DesignError;
use upright_design::harness::HarnessError;
use upright_design::identify::{CoverageError, IdentifyError};
use upright_design::rig::RigError;
use upright_design::robust::RobustError;
use upright_design::simulate::SimulationError;
use upright_design::study::StudyError;
use upright_design::swing_up::SwingUpError;
use upright_design::table::{NoTable, WriteError};
use upright_design::verify::{Unverifiable, VerifyError};
use upright_tool::campaign::CampaignError;
use upright_tool::commission::Stop;
use upright_tool::figure::FigureError;
use upright_tool::image::{BuildError, ElfError, SizeError};
use upright_tool::in_the_loop::{RelayError, RunError};
use upright_tool::monitor::OpenError;
use upright_tool::report::ReportError;
use upright_tool::reproduce::ReproduceError;
use upright_tool::twin::TwinError;

/// Why a command fails; each kind has an exit status.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    #[error(transparent)]
    Rig(#[from] RigError),
    #[error("{rig}: {source}")]
    Design { rig: String, source: DesignError },
    #[error("{rig}: {source}")]
    NoTable { rig: String, source: NoTable },
    #[error("{0}")]
    NoSolution(String),
    #[error("{rig}: {source}")]
    SwingUp { rig: String, source: SwingUpError },
    #[error("{rig}: {source}")]
    Robust { rig: String, source: RobustError },
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    #[error("{0}")]
    NotIdentified(String),
    #[error("{0}")]
    MustNotRun(String),
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    #[error(transparent)]
    Verify(#[from] VerifyError),
    #[error(transparent)]
    Unverifiable(#[from] Unverifiable),
    #[error(transparent)]
    Image(#[from] BuildError),
    #[error(transparent)]
    Elf(#[from] ElfError),
    #[error(transparent)]
    Size(#[from] SizeError),
    #[error("{0}")]
    NoProgram(&'static str),
    #[error(transparent)]
    InTheLoop(#[from] RunError),
    #[error("no client can connect: {0}")]
    Relay(std::io::Error),
    #[error(transparent)]
    Monitor(#[from] OpenError),
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error(transparent)]
    Reproduce(#[from] ReproduceError),
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error(transparent)]
    Report(#[from] ReportError),
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error("the output cannot be written: {0}")]
    Output(#[from] std::io::Error),
    #[error("{0}")]
    BadArgument(String),
    #[error("{0}")]
    CheckFailed(String),
}

impl From<RelayError> for Failure {
    fn from(error: RelayError) -> Self {
        match error {
            RelayError::Run(error) => Failure::InTheLoop(error),
            RelayError::Socket(error) => Failure::Relay(error),
        }
    }
}

impl From<Stop> for Failure {
    fn from(stop: Stop) -> Self {
        match stop {
            Stop::Machine(words) => Failure::MustNotRun(words),
            Stop::Line(_) | Stop::Aborted => Failure::CheckFailed(stop.to_string()),
            Stop::Simulated(error) => Failure::InTheLoop(error),
            Stop::Record(error) => Failure::Write(error),
        }
    }
}

impl From<CoverageError> for Failure {
    fn from(error: CoverageError) -> Self {
        match error {
            CoverageError::Identify(error) => Failure::Identify(error),
            CoverageError::Study(error) => Failure::Study(error),
        }
    }
}

impl From<TwinError> for Failure {
    fn from(error: TwinError) -> Self {
        match error {
            TwinError::Run(error) => Failure::InTheLoop(error),
            TwinError::Socket(error) => Failure::Relay(error),
        }
    }
}

impl Failure {
    fn exit_status(&self) -> u8 {
        match self {
            Failure::CheckFailed(_) => 1,
            Failure::Rig(error) => error.exit_code(),
            Failure::Design { .. } | Failure::NoTable { .. } | Failure::NoSolution(_) => 3,
            Failure::Robust { source: RobustError::Unhelped(_) | RobustError::Design(_), .. } => 3,
            Failure::SwingUp { source, .. } if source.is_without_solution() => 3,
            Failure::NotIdentified(_) | Failure::MustNotRun(_) => 3,
            Failure::Identify(error) if error.is_without_solution() => 3,
            Failure::NoProgram(_) | Failure::Image(BuildError::NoCompiler) => 4,
            Failure::InTheLoop(error) if error.lacks_emulator() => 4,
            Failure::InTheLoop(RunError::Harness(error)) if is_bad_scenario(error) => 2,
            Failure::InTheLoop(_) => 1,
            Failure::Campaign(CampaignError::Trial { source, .. }) if source.lacks_emulator() => 4,
            Failure::Campaign(CampaignError::Trial { .. }) => 1,
            Failure::SwingUp { .. }
            | Failure::Campaign(CampaignError::Study(_))
            | Failure::Study(_)
            | Failure::Robust { .. }
            | Failure::Identify(_)
            | Failure::Image(_)
            | Failure::Elf(_)
            | Failure::Size(_)
            | Failure::Relay(_)
            | Failure::Monitor(_)
            | Failure::Simulation(_)
            | Failure::Verify(_)
            | Failure::Unverifiable(_)
            | Failure::Reproduce(_)
            | Failure::Figure(_)
            | Failure::Report(_)
            | Failure::Write(_)
            | Failure::Output(_)
            | Failure::BadArgument(_) => 2,
        }
    }

    /// Prints the error and returns the exit status.
    pub(crate) fn report(&self) -> ExitCode {
        match self {
            // The reader of a pipe has closed it: not an error.
            Failure::Output(error) if error.kind() == std::io::ErrorKind::BrokenPipe => {
                return ExitCode::SUCCESS;
            }
            _ => eprintln!("upright: {self}"),
        }
        ExitCode::from(self.exit_status())
    }
}

/// Whether the scenario is at fault, not the firmware.
fn is_bad_scenario(error: &HarnessError) -> bool {
    matches!(
        error,
        HarnessError::Simulation(_)
            | HarnessError::FullState
            | HarnessError::StepAt { .. }
            | HarnessError::Lost(_)
    )
}
