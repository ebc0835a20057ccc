//! What is commissioned.

use std::path::Path;

use upright_design::rig::Rig;
use upright_design::table::TableValues;

/// What is commissioned, and how.
#[derive(Debug, Clone, Copy)]
pub struct CommissionPlan<'a> {
    /// The rig, as in its file.
    pub rig: &'a Rig,
    /// Its gain table, which the firmware has.
    pub table: &'a TableValues,
    /// Path of the rig file.
    pub file: &'a Path,
    /// The text of the file.
    pub text: &'a str,
    /// Duration of the shaking (s).
    pub seconds: f64,
    /// Seed of the excitation's phases.
    pub seed: u64,
}
