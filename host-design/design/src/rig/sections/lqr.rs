//! `[lqr]`: weights of the linear quadratic regulator.

use serde::Serialize;

use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::Node;
use super::super::rule::Rule;

/// `[lqr]`
pub(crate) static LQR: Section = Section {
    name: "lqr",
    title: "[lqr]",
    meaning: "minimises the integral of `Σ q x² + r u²`",
    absent: Absent::Follows("no LQR"),
    keys: &[&[
        Key {
            name: "state_weights",
            unit: "",
            rule: Rule::checked_by_its_section("one number >= 0 per state"),
            meaning: "weights q of the squared states, one weight per state, in the order x, its rate, θ1, its rate, …",
            absent: Absent::Required,
        },
        Key {
            name: "force_weight",
            unit: "",
            rule: Rule::POSITIVE,
            meaning: "weight r of the squared force; with r = 0 there would be no optimum",
            absent: Absent::Required,
        },
    ]],
};

/// `[lqr]`: minimise the integral of `xᵀ diag(q) x + r u²`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lqr {
    /// Diagonal of Q, one weight per state.
    pub state_weights: Vec<f64>,
    /// Weight r > 0 of the squared force.
    pub force_weight: f64,
}

/// Reads `[lqr]`, with one weight per state.
pub(crate) fn lqr(node: &Node<'_>, states: usize) -> Result<Lqr, RigError> {
    let table = node.table(&LQR)?;
    Ok(Lqr {
        state_weights: table.numbers("state_weights", states, Rule::NOT_NEGATIVE)?,
        force_weight: table.value("force_weight")?,
    })
}
