//! `[model]`: a linear plant by its matrices.

use serde::Serialize;

use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::Node;
use super::super::rule::Rule;

/// Highest order of a linear model.
const MAX_STATES: usize = 60;

/// `[model]`
pub(crate) static MODEL: Section = Section {
    name: "model",
    title: "[model]",
    meaning: "`x' = a x + b u`, instead of `[cart]`, `[[link]]` and `[gravity]`",
    absent: Absent::RequiredIf("unless [cart] and [[link]]"),
    keys: &[&[
        Key {
            name: "a",
            unit: "",
            rule: Rule::checked_by_its_section("a square matrix, 1 to 60 rows"),
            meaning: "rows of A, as [[0, 1], [2, 0]], square",
            absent: Absent::Required,
        },
        Key {
            name: "b",
            unit: "",
            rule: Rule::checked_by_its_section("one number per state"),
            meaning: "entries of B, one per state: the model has a single input",
            absent: Absent::Required,
        },
        Key {
            name: "output",
            unit: "",
            rule: Rule::checked_by_its_section("the index of a state"),
            meaning: "index of the state that follows the set-point, counted from 0",
            absent: Absent::Numbers(&[0.0]),
        },
        Key {
            name: "measured",
            unit: "",
            rule: Rule::checked_by_its_section("indices of states, each once"),
            meaning: "indices of the measured states, counted from 0, each once",
            absent: Absent::Follows("[output]"),
        },
        Key {
            name: "measured_steps",
            unit: "",
            rule: Rule::checked_by_its_section("one number > 0 per measured state"),
            meaning: "step of each measured state's sensor, in the state's unit",
            absent: Absent::Follows("none; required with [kalman]"),
        },
        Key {
            name: "noise_input",
            unit: "",
            rule: Rule::checked_by_its_section("columns of one number per state"),
            meaning: "columns through which noise enters, each with one entry per state",
            absent: Absent::Follows("b alone"),
        },
    ]],
};

/// `[model]`: `ẋ = A x + B u` with one input.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinearPlant {
    /// Rows of A, s×s.
    pub a: Vec<Vec<f64>>,
    /// Entries of B, s.
    pub b: Vec<f64>,
    /// Index of the state that follows the set-point.
    pub output: usize,
    /// Indices of the measured states, in the order of the sensors.
    pub measured: Vec<usize>,
    /// Sensor step of each measured state.
    pub measured_steps: Vec<f64>,
    /// Columns through which process noise enters, each of length s; default: B alone.
    pub noise_input: Option<Vec<Vec<f64>>>,
}

/// Reads `[model]`.
pub(super) fn model(node: &Node<'_>) -> Result<LinearPlant, RigError> {
    let table = node.table(&MODEL)?;
    let a_node = table.required("a")?;
    let asks_for = table.asks_for("a");
    let rows = a_node.list("a list of rows", &asks_for)?;
    let states = rows.len();
    if !(1..=MAX_STATES).contains(&states) {
        return Err(a_node.wrong_length(states, &format!("1 to {MAX_STATES} rows"), &asks_for));
    }
    let a = rows.iter().map(|row| row.numbers(states, Rule::ANY, &asks_for)).collect::<Result<_, _>>()?;
    let b = table.numbers("b", states, Rule::ANY)?;
    let output = match table.get("output") {
        Some(node) => state_index(&node, states)?,
        None => 0,
    };
    let measured = match table.get("measured") {
        Some(node) => measured(&node, states, &table.asks_for("measured"))?,
        None => vec![output],
    };
    let measured_steps = match table.get("measured_steps") {
        Some(_) => table.numbers("measured_steps", measured.len(), Rule::POSITIVE)?,
        None => Vec::new(),
    };
    let noise_input = match table.get("noise_input") {
        Some(node) => Some(noise_input(&node, states, &table.asks_for("noise_input"))?),
        None => None,
    };
    Ok(LinearPlant { a, b, output, measured, measured_steps, noise_input })
}

fn state_index(node: &Node<'_>, states: usize) -> Result<usize, RigError> {
    node.index(
        states - 1,
        &format!("a whole number from 0 to {}", states - 1),
        "the index of a state, counted from 0",
    )
}

fn measured(node: &Node<'_>, states: usize, asks_for: &str) -> Result<Vec<usize>, RigError> {
    let entries = node.list("a list of state indices", asks_for)?;
    if !(1..=states).contains(&entries.len()) {
        return Err(node.wrong_length(entries.len(), &format!("1 to {states}"), asks_for));
    }
    let mut indices = Vec::with_capacity(entries.len());
    for entry in &entries {
        let index = state_index(entry, states)?;
        if indices.contains(&index) {
            return Err(entry.out_of_range("each state once", &format!("give {asks_for}")));
        }
        indices.push(index);
    }
    Ok(indices)
}

fn noise_input(node: &Node<'_>, states: usize, asks_for: &str) -> Result<Vec<Vec<f64>>, RigError> {
    let columns = node.list("a list of columns", asks_for)?;
    if !(1..=states).contains(&columns.len()) {
        return Err(node.wrong_length(columns.len(), &format!("1 to {states} columns"), asks_for));
    }
    columns.iter().map(|column| column.numbers(states, Rule::ANY, asks_for)).collect()
}
