//! A control law of a design, assessed.

use upright::table::Law;
use upright_design::design::Assessment;
use upright_design::simulate::Summary;

/// A control law of a design with its assessment.
pub(super) struct LawReport {
    pub(super) law: Law,
    pub(super) assessment: Assessment,
    /// The acceptance run, if there is a table.
    pub(super) run: Option<Summary>,
}
