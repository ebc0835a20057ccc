//! Why a question has no answer.

use upright_design::design::DesignError;
use upright_design::export::NoHeader;
use upright_design::rig::RigError;
use upright_design::simulate::SimulationError;
use upright_design::swing_up::SwingUpError;
use upright_design::table::NoTable;

use crate::fingerprint::FingerprintError;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PageRefusal {
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    #[error("{}", said(.0))]
    Rig(#[from] RigError),
    #[error(transparent)]
    Design(#[from] DesignError),
    #[error(transparent)]
    Table(#[from] NoTable),
    #[error(transparent)]
    Header(#[from] NoHeader),
    #[error(transparent)]
    Motions(#[from] SwingUpError),
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    #[error(transparent)]
    Fingerprint(#[from] FingerprintError),
}

/// The error without the name of the file and without the place, which the page shows where it is.
fn said(error: &RigError) -> String {
    match &error.key {
        Some(key) => format!("{key}: {}", error.kind),
        None => error.kind.to_string(),
    }
}
