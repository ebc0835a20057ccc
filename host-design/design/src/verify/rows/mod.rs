//! The trust report of one law as rows of text. Both the text report and the page show them, and a test compares the
//! documentation with their names and meanings.

mod linear;
mod runs;

use super::LawTrust;
use crate::number::significant;
use crate::rig::{PlantDescription, Rig};

/// One quantity of the trust report.
#[derive(Debug, Clone, Copy)]
pub struct Quantity {
    /// Name of its row, or beginning of the names of its rows.
    pub name: &'static str,
    /// What the value means.
    pub meaning: &'static str,
    values: Values,
}

/// Function that makes the text of the values.
#[derive(Debug, Clone, Copy)]
enum Values {
    /// One row; none where the report does not have it.
    One(fn(&Rig, &LawTrust) -> Option<String>),
    /// A row for each link or source, whose name follows that of the quantity.
    Each(fn(&Rig, &LawTrust) -> Vec<(String, String)>),
}

/// One row of the trust report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Name of the quantity, with its link or source.
    pub name: String,
    /// What was found, with its unit.
    pub value: String,
    /// What the value means.
    pub meaning: &'static str,
}

/// Every quantity, in the order in which they are shown.
pub fn quantities() -> impl Iterator<Item = &'static Quantity> {
    linear::QUANTITIES.iter().chain(runs::QUANTITIES)
}

/// The rows of one law. Those that the report does not have, because the rig has no such part or the loop is unstable,
/// are left out.
pub fn rows(rig: &Rig, law: &LawTrust) -> Vec<Row> {
    let rows_of = |quantity: &'static Quantity| {
        let values = match quantity.values {
            Values::One(value) => value(rig, law).map(|value| (String::new(), value)).into_iter().collect(),
            Values::Each(values) => values(rig, law),
        };
        values.into_iter().map(|(part, value)| Row {
            name: format!("{}{part}", quantity.name),
            value,
            meaning: quantity.meaning,
        })
    };
    quantities().flat_map(rows_of).collect()
}

/// Three significant digits.
fn number(x: f64) -> String {
    significant(x, 3)
}

/// Whether lengths, angles and forces have the units of a chain; a model has units of its own.
fn is_chain(rig: &Rig) -> bool {
    matches!(rig.plant, PlantDescription::Chain(_))
}

/// A force, or the input of a model, with its unit.
fn force(rig: &Rig, force_n: f64) -> String {
    let unit = if is_chain(rig) { " N" } else { "" };
    format!("{}{unit}", number(force_n))
}

/// Signs of a combination, such as `+-+-`.
fn signs(signs: &[i8]) -> String {
    signs.iter().map(|&sign| if sign > 0 { '+' } else { '-' }).collect()
}
