//! Errors of a report.

use crate::figure::FigureError;
use upright_design::design::DesignError;
use upright_design::simulate::SimulationError;
use upright_trust::verify::VerifyError;

/// Why a report cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// A run cannot be started.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The poles of the design cannot be computed.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// The trust report or the region of attraction cannot be computed.
    #[error(transparent)]
    Verify(#[from] VerifyError),
    /// The page cannot be rendered.
    #[error("the page cannot be made: {0}")]
    Page(String),
}

impl From<askama::Error> for ReportError {
    fn from(error: askama::Error) -> Self {
        Self::Page(error.to_string())
    }
}

impl From<serde_json::Error> for ReportError {
    fn from(error: serde_json::Error) -> Self {
        Self::Page(error.to_string())
    }
}
