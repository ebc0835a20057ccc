//! All comparisons, one after the other.

use serde::Serialize;
use upright_design::parallel::{Progress, ProgressStep};

use super::designs::{Designs, designs};
use super::errata::{Erratum, errata};
use super::error::ReproduceError;
use super::responses::{Loops, StepResponse, responses};
use super::rigs::{PaperDesigns, PaperRigs};
use super::robustness::{Robustness, robustness};
use super::settling::{Settling, settling};

/// Everything that is compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reproduction {
    /// Matrices, gains, poles.
    pub designs: Designs,
    /// What the paper leaves open or misprints.
    pub errata: Vec<Erratum>,
    /// Figures 5 to 8.
    pub responses: Vec<StepResponse>,
    /// Table 2.
    pub settling: Settling,
    /// The paper's claims about the two laws.
    pub robustness: Vec<Robustness>,
}

/// Computes everything.
///
/// # Errors
/// [`ReproduceError`] if a result cannot be computed.
pub fn reproduce(rigs: &PaperRigs, progress: Progress<'_>) -> Result<Reproduction, ReproduceError> {
    let stage = |name| progress(ProgressStep::Begin(name, 1));
    stage("matrices, gains and poles");
    let designed = PaperDesigns::of(rigs)?;
    let designs = designs(rigs, &designed)?;
    stage("errata");
    let errata = errata(rigs, &designed)?;
    stage("step responses");
    let loops = Loops::with(&rigs.exact, designed.exact)?;
    let responses = responses(&loops)?;
    stage("Table 2");
    let settling = settling(rigs)?;
    stage("spectra and margins");
    let robustness = robustness(&loops)?;
    Ok(Reproduction { designs, errata, responses, settling, robustness })
}
