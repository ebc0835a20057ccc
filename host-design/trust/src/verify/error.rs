//! What a trust report cannot say, and why.

use upright_closed_loop::harness::HarnessError;
use upright_design::design::DesignError;
use upright_design::rig::{Chain, Rig};
use upright_design::simulate::SimulationError;
use upright_design::study::StudyError;
use upright_design::table::NoTable;

/// Why a report, or a quantity of it, cannot be computed for a rig.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The eigenvalue iteration failed.
    #[error("the poles of the loop could not be computed")]
    Poles,
    /// The noise grows without bound.
    #[error("the loop is so close to instability that its noise has no computable steady state")]
    NoStationaryState,
    /// The design could not be repeated, or a changed rig, for which the gains have to be redesigned, has none.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A run cannot be started.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// No gain table can be made for a changed rig.
    #[error(transparent)]
    NoTable(#[from] NoTable),
    /// The firmware does not run.
    #[error("the firmware does not run: {0}")]
    Firmware(HarnessError),
    /// The runs of another process cannot be used.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// Masses, angles and encoders of a `[model]` are not known.
    #[error("a rig given by [model] has no {0}: describe it by [cart] and [[link]]")]
    NotAChain(&'static str),
    /// The controller does not run from encoders.
    #[error("the rig has no observer: give it its encoders and [kalman]")]
    NoObserver,
    /// An invalid setting.
    #[error("{what} = {value}: give {accepts}")]
    Setting {
        /// Name of the setting.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The accepted values.
        accepts: &'static str,
    },
}

impl From<HarnessError> for VerifyError {
    fn from(error: HarnessError) -> Self {
        match error {
            HarnessError::Simulation(error) => Self::Simulation(error),
            error => Self::Firmware(error),
        }
    }
}

/// The chain of a rig that has one.
pub(crate) fn chain<'a>(rig: &'a Rig, what: &'static str) -> Result<&'a Chain, VerifyError> {
    rig.chain().ok_or(VerifyError::NotAChain(what))
}

/// Checks that a setting is within its range.
pub(super) fn within(
    what: &'static str,
    value: f64,
    range: core::ops::RangeInclusive<f64>,
    accepts: &'static str,
) -> Result<(), VerifyError> {
    if range.contains(&value) { Ok(()) } else { Err(VerifyError::Setting { what, value, accepts }) }
}
