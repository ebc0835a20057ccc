//! What a row of the trust report is made from.

use crate::verify::LawTrust;
use upright_design::number::significant;
use upright_design::rig::{CartInput, Rig};

/// One quantity of the trust report.
#[derive(Debug, Clone, Copy)]
pub struct TrustQuantity {
    /// Name of its row, or beginning of the names of its rows.
    pub name: &'static str,
    /// What the value means.
    pub meaning: &'static str,
    pub(super) values: Values,
}

/// Function that makes the text of the values.
#[derive(Debug, Clone, Copy)]
pub(super) enum Values {
    /// One row; none where the report does not have it.
    One(fn(&Rig, &LawTrust) -> Option<String>),
    /// A row for each link or source, whose name follows that of the quantity.
    Each(fn(&Rig, &LawTrust) -> Vec<(String, String)>),
}

/// Three significant digits.
pub(super) fn number(x: f64) -> String {
    significant(x, 3)
}

/// Whether lengths, angles and forces have the units of a chain; a model has units of its own.
pub(super) fn is_chain(rig: &Rig) -> bool {
    rig.chain().is_some()
}

/// A force, the cart's acceleration where the drive imposes that, or the input of a model, with its unit.
pub(super) fn force(rig: &Rig, force_n: f64) -> String {
    format!("{}{}", number(force_n), input(rig).1)
}

/// Name and unit of the plant's input.
pub(super) fn input(rig: &Rig) -> (&'static str, &'static str) {
    match rig.actuator.input() {
        _ if !is_chain(rig) => ("input", ""),
        CartInput::Force => ("force", " N"),
        CartInput::Acceleration => ("acceleration", " m/s²"),
    }
}

/// Signs of a combination, such as `+-+-`.
pub(super) fn signs(signs: &[i8]) -> String {
    signs.iter().map(|&sign| if sign > 0 { '+' } else { '-' }).collect()
}
