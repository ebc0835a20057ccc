//! Why a question has no answer.

use serde_json::{Value, json};
use upright_closed_loop::harness::HarnessError;
use upright_design::design::DesignError;
use upright_design::export::NoHeader;
use upright_design::rig::RigError;
use upright_design::simulate::SimulationError;
use upright_design::table::NoTable;
use upright_plan::SwingUpError;
use upright_trust::verify::VerifyError;

use crate::fingerprint::FingerprintError;

/// Name under which errors speak of the rig file; a page shows them without it.
pub(crate) const FILE: &str = "rig.toml";

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
    Verify(#[from] VerifyError),
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    #[error(transparent)]
    Fingerprint(#[from] FingerprintError),
    #[error(transparent)]
    Firmware(#[from] HarnessError),
    #[error("the design has no such law: choose one of the page")]
    Law,
    #[error(transparent)]
    Csv(#[from] std::io::Error),
    #[error("no rig is under power: start one")]
    NoTwin,
    #[error("no board is connected: connect one")]
    NoBoard,
    #[error("{0}")]
    Twin(String),
    #[error("{0}")]
    Lab(String),
    #[error("the poles of this rig without a controller cannot be computed: change its numbers")]
    Poles,
    #[error("give {0} numbers, with blanks between them")]
    Answer(usize),
}

/// A refusal as an answer: what to do, and for an error in the rig file its line and column.
pub(crate) fn failed(refusal: &PageRefusal) -> Value {
    let place = match refusal {
        PageRefusal::Rig(error) => error.place,
        _ => None,
    };
    let (line, column) = (place.map(|place| place.line), place.map(|place| place.column));
    json!({ "failed": { "why": refusal.to_string(), "line": line, "column": column } })
}

/// The error without the name of the file and without the place, which the page shows where it is.
fn said(error: &RigError) -> String {
    match &error.key {
        Some(key) => format!("{key}: {}", error.kind),
        None => error.kind.to_string(),
    }
}
