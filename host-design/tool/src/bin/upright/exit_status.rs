//! The exit status of each error.

use std::error::Error;

use upright_closed_loop::harness::HarnessError;
use upright_identify::{CoverageError, IdentifyError};
use upright_plan::SwingUpError;
use upright_tool::campaign::CampaignError;
use upright_tool::commission::Stop;
use upright_tool::image::BuildError;
use upright_tool::in_the_loop::RunError;
use upright_tool::site::SiteError;
use upright_trust::robust::RobustError;

/// The exit status of an error: 2, bad input, for all that are named neither here nor by `upright_command`.
pub(crate) fn exit_status(error: &(dyn Error + 'static)) -> u8 {
    if matches!(error.downcast_ref(), Some(RobustError::Unhelped(_) | RobustError::Design(_)))
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
    } else {
        upright_command::exit_status(error)
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
