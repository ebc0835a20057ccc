//! Reports that cannot be made.

use crate::figure::FigureError;
use upright_design::simulate::SimulationError;
use upright_design::verify::{Unverifiable, VerifyError};

/// A report that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A figure.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// A run.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The trust report.
    #[error(transparent)]
    Verify(#[from] VerifyError),
    /// The region of attraction.
    #[error(transparent)]
    Runs(#[from] Unverifiable),
    /// The page.
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
