//! All comparisons, one after the other.

use serde::Serialize;

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
