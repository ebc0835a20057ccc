//! The results of the paper compared with ours: F. J. Ticona Coaquira, "Design and comparison of two linear
//! controllers with precompensation gain for the Quadruple inverted pendulum".
//!
//! [`published`] holds what is printed, [`designs`] compares matrices, gains and poles digit by digit, [`errata`] says
//! what the paper leaves open or misprints, [`responses`] are its figures 5 to 8, [`settling`] its Table 2,
//! [`robustness`] what it says about the two laws without numbers. [`ContinuousRun`] is the loop that the paper
//! simulates; where a tick is involved, the firmware's own controller runs.

mod claims;
mod comparison;
mod continuous_loop;
mod designs;
mod errata;
mod figures;
mod firmware_loop;
mod markdown;
pub mod published;
mod responses;
mod robustness;
mod settling;
mod summary;
mod trajectory;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use comparison::{Digits, Row, Verdict};
pub use continuous_loop::ContinuousRun;
pub use designs::{Designs, PoleSet, designs};
pub use errata::{Erratum, Evidence, errata};
pub use markdown::markdown_table;
pub use responses::{Loop, Loops, Response, responses};
pub use robustness::{Ripple, Robustness, SEED, robustness};
pub use settling::{HORIZON_S, LONGEST_S, Sensitivity, Settling, SettlingRow, printed, settling};
pub use trajectory::{BAND, StepFigures, Trajectory};

use upright_design::design::{Certified, DesignError, design};
use upright_design::plant::PlantError;
use upright_design::plant::reference::ReferenceError;
use upright_design::rig::{Chain, Rig, RigError};
use upright_design::simulate::SimulationError;
use upright_design::table::NoTable;
use upright_design::verify::VerifyError;

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

/// Everything that is compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reproduction {
    /// Matrices, gains, poles.
    pub designs: Designs,
    /// What the paper leaves open or misprints.
    pub errata: Vec<Erratum>,
    /// Figures 5 to 8.
    pub responses: Vec<Response>,
    /// Table 2.
    pub settling: Settling,
    /// The paper's claims about the two laws.
    pub robustness: Vec<Robustness>,
}

/// The stages of [`reproduce`], in their order.
pub const STAGES: [&str; 5] =
    ["matrices, gains and poles", "errata", "step responses", "Table 2", "spectra and margins"];

/// Computes everything; `stage` is called with the name of each of the [`STAGES`] before it starts.
///
/// # Errors
/// [`ReproduceError`] if a result cannot be computed.
pub fn reproduce(rigs: &PaperRigs, stage: &dyn Fn(&'static str)) -> Result<Reproduction, ReproduceError> {
    // Each name is used once, or the compiler complains.
    let [of_designs, of_errata, of_responses, of_settling, of_robustness] = STAGES;
    stage(of_designs);
    let designed = PaperDesigns::of(rigs)?;
    let designs = designs(rigs, &designed)?;
    stage(of_errata);
    let errata = errata(rigs, &designed)?;
    stage(of_responses);
    let loops = Loops::with(&rigs.exact, designed.exact)?;
    let responses = responses(&loops)?;
    stage(of_settling);
    let settling = settling(rigs)?;
    stage(of_robustness);
    let robustness = robustness(&loops)?;
    Ok(Reproduction { designs, errata, responses, settling, robustness })
}

/// The two rig files of the paper's machine.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperRigs {
    /// The machine itself, with our tick, limit, encoders and noise: `quadruple-paper.toml`.
    pub exact: Rig,
    /// A and B as printed in the paper: `quadruple-paper-printed.toml`.
    pub printed: Rig,
}

impl PaperRigs {
    /// Reads both files from `folder`.
    ///
    /// # Errors
    /// [`ReproduceError::NoRigs`] if they are not there, [`ReproduceError::Rig`] if one cannot be used.
    pub fn from_folder(folder: &Path) -> Result<Self, ReproduceError> {
        let read = |name: &str| {
            let file = folder.join(name);
            if file.is_file() { Ok(Rig::from_path(&file)?) } else { Err(ReproduceError::NoRigs(file)) }
        };
        Ok(Self { exact: read("quadruple-paper.toml")?, printed: read("quadruple-paper-printed.toml")? })
    }
}

/// The designs of both rig files.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperDesigns {
    /// Design of [`PaperRigs::exact`].
    pub exact: Certified,
    /// Design of [`PaperRigs::printed`].
    pub printed: Certified,
}

impl PaperDesigns {
    /// Designs both rigs.
    ///
    /// # Errors
    /// [`ReproduceError::Design`] if one has no solution.
    pub fn of(rigs: &PaperRigs) -> Result<Self, ReproduceError> {
        Ok(Self { exact: design(&rigs.exact)?, printed: design(&rigs.printed)? })
    }
}

fn chain(rig: &Rig) -> Result<&Chain, ReproduceError> {
    rig.chain().ok_or_else(|| ReproduceError::NotAChain(rig.name.clone()))
}
