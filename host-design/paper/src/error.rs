//! Why the paper's results cannot be compared.

use std::path::PathBuf;

use upright_design::design::DesignError;
use upright_design::plant::PlantError;
use upright_design::plant::reference::ReferenceError;
use upright_design::rig::RigError;
use upright_design::simulate::SimulationError;
use upright_design::table::NoTable;
use upright_trust::verify::VerifyError;

/// Why a result cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    /// A rig file of the paper is not there.
    #[error(
        "{}: there is no such file: name the folder of the rig files of a checkout of Upright with --rigs",
        .0.display()
    )]
    NoRigs(PathBuf),
    /// A rig file of the paper cannot be used.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The rig is not a chain of links.
    #[error(
        "the paper's plant is a chain of links, but {0} is given by [model]: use a rig with [cart] and [[link]]"
    )]
    NotAChain(String),
    /// The rig asks for one control law only.
    #[error("{0} asks for one control law, and two are compared: add [lqr] or [pole_placement]")]
    OneLaw(String),
    /// A design has no solution.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A design makes no table.
    #[error(transparent)]
    NoTable(#[from] NoTable),
    /// The plant cannot be simulated.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The continuous loop could not be integrated.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The firmware's loop could not be run.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The margins could not be computed.
    #[error(transparent)]
    Verify(#[from] VerifyError),
    /// A negative variance.
    #[error("a variance of {0} is not possible: it has to be at least 0")]
    Variance(f64),
}
