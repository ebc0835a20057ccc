//! The trust report of one law as rows of text. Both the text report and the page show them, and a test compares the
//! documentation with their names and meanings.

mod linear;
mod quantity;
mod runs;

pub use quantity::TrustQuantity;
use quantity::Values;

use super::LawTrust;
use upright_design::rig::Rig;

/// One row of the trust report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundRow {
    /// Name of the quantity, with its link or source.
    pub name: String,
    /// What was found, with its unit.
    pub value: String,
    /// What the value means.
    pub meaning: &'static str,
}

/// Every quantity, in the order in which they are shown.
pub fn quantities() -> impl Iterator<Item = &'static TrustQuantity> {
    linear::QUANTITIES.iter().chain(runs::QUANTITIES)
}

/// The rows of one law. Those that the report does not have, because the rig has no such part or the loop is unstable,
/// are left out.
pub fn rows(rig: &Rig, law: &LawTrust) -> Vec<FoundRow> {
    let rows_of = |quantity: &'static TrustQuantity| {
        let values = match quantity.values {
            Values::One(value) => value(rig, law).map(|value| (String::new(), value)).into_iter().collect(),
            Values::Each(values) => values(rig, law),
        };
        values.into_iter().map(|(part, value)| FoundRow {
            name: format!("{}{part}", quantity.name),
            value,
            meaning: quantity.meaning,
        })
    };
    quantities().flat_map(rows_of).collect()
}
