//! Why no gains were chosen.

use crate::verify::VerifyError;
use upright_design::design::DesignError;
use upright_design::simulate::SimulationError;
use upright_design::table::NoTable;

/// Why no gains were chosen.
#[derive(Debug, thiserror::Error)]
pub enum RobustError {
    /// No tolerance is above 0.
    #[error(
        "no tolerance is stated: give [robust] in the rig file, or an option such as --joint-friction 1e-4"
    )]
    NoTolerance,
    /// No candidate survives the tolerances.
    #[error("nothing helps: {0}")]
    Unhelped(String),
    /// The rig file's own numbers have no design.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// No gain table can be made for a design.
    #[error(transparent)]
    NoTable(#[from] NoTable),
    /// A run cannot be started.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The rig has no chain or no observer, or a figure of its loop cannot be computed.
    #[error(transparent)]
    Verify(#[from] VerifyError),
}
