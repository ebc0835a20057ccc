//! `[pole_placement]`: poles to place, by a response or one by one.

use serde::Serialize;

use super::super::error::{RigError, RigErrorKind};
use super::super::key::{Absent, Key, Section};
use super::super::node::{Node, Table};
use super::super::rule::Rule;

const UNLESS_POLES: Absent =
    Absent::RequiredIf("unless poles are given one by one, as poles = [[re, im], ...]");

/// `[pole_placement]`
pub(crate) static POLE_PLACEMENT: Section = Section {
    name: "pole_placement",
    title: "[pole_placement]",
    meaning: "poles of the continuous closed loop",
    absent: Absent::Follows("no pole placement"),
    keys: &[&[
        Key {
            name: "overshoot_percent",
            unit: "%",
            rule: Rule::PERCENT,
            meaning: "overshoot of the dominant pair",
            absent: UNLESS_POLES,
        },
        Key {
            name: "settling_time_s",
            unit: "s",
            rule: Rule::POSITIVE,
            meaning: "settling time ts of the dominant pair, ωn = 4 / (ζ ts)",
            absent: UNLESS_POLES,
        },
        Key {
            name: "far_poles",
            unit: "1/s",
            rule: Rule::checked_by_its_section("numbers < 0, two fewer than states"),
            meaning: "poles besides the dominant pair, real and negative",
            absent: UNLESS_POLES,
        },
        Key {
            name: "poles",
            unit: "1/s",
            rule: Rule::checked_by_its_section("[re < 0, im] per state, complex ones in conjugate pairs"),
            meaning: "poles instead of these three, one pole per state as [re, im] with re < 0",
            absent: Absent::Follows("the three above"),
        },
    ]],
};

/// The poles to place, `[pole_placement]`, in one of two forms.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum PolePlacement {
    /// A dominant pair from a second-order response, and real far poles.
    Response {
        /// Overshoot of the dominant pair (%), 0 < PO < 100.
        overshoot_percent: f64,
        /// Settling time of the dominant pair (s): ωn = 4 / (ζ ts).
        settling_time_s: f64,
        /// The other poles (1/s), all real.
        far_poles: Vec<f64>,
    },
    /// Every pole as [re, im] (1/s), complex ones in conjugate pairs.
    Poles(Vec<[f64; 2]>),
}

/// Reads `[pole_placement]`, with one pole per state.
pub(crate) fn pole_placement(node: &Node<'_>, states: usize) -> Result<PolePlacement, RigError> {
    let table = node.table(&POLE_PLACEMENT)?;
    for key in ["overshoot_percent", "settling_time_s", "far_poles"] {
        table.not_both(
            "poles",
            key,
            "keep either poles, or overshoot_percent, settling_time_s and far_poles",
        )?;
    }
    match table.get("poles") {
        Some(node) => poles(&node, states, &table.asks_for("poles")).map(PolePlacement::Poles),
        None => response(&table, states),
    }
}

fn response(table: &Table<'_>, states: usize) -> Result<PolePlacement, RigError> {
    let asks_for = table.asks_for("far_poles");
    let overshoot_percent = table.value("overshoot_percent")?;
    let settling_time_s = table.value("settling_time_s")?;
    let far = table.required("far_poles")?;
    let entries = far.list("a list of numbers", &asks_for)?;
    if entries.len() + 2 != states {
        let accepts = match states.checked_sub(2) {
            Some(wanted) => format!("{wanted}, one per state besides the dominant pair"),
            None => format!("none: a dominant pair needs 2 states and the plant has {states}"),
        };
        return Err(pole_count(&far, entries.len(), accepts, &asks_for));
    }
    let far_poles =
        entries.iter().map(|pole| pole.number(Rule::NEGATIVE, &asks_for)).collect::<Result<_, _>>()?;
    Ok(PolePlacement::Response { overshoot_percent, settling_time_s, far_poles })
}

/// One pole per state, complex ones in conjugate pairs.
pub(super) fn poles(node: &Node<'_>, states: usize, asks_for: &str) -> Result<Vec<[f64; 2]>, RigError> {
    let entries = node.list("a list of [re, im] pairs", asks_for)?;
    if entries.len() != states {
        return Err(pole_count(node, entries.len(), format!("{states}, one per state"), asks_for));
    }
    let poles: Vec<[f64; 2]> = entries.iter().map(pole).collect::<Result<_, _>>()?;
    match unpaired(&poles) {
        None => Ok(poles),
        Some(alone) => {
            let [re, im] = poles[alone];
            let (pole, conjugate) = (format!("[{re}, {im}]"), format!("[{re}, {}]", -im));
            Err(entries[alone].error(RigErrorKind::UnpairedPole { pole, conjugate }))
        }
    }
}

fn pole(node: &Node<'_>) -> Result<[f64; 2], RigError> {
    const PART: &str = "the pole as [re, im] in 1/s, with re < 0";
    match node.numbers(2, Rule::ANY, PART)?[..] {
        [re, im] if re < 0.0 => Ok([re, im]),
        _ => Err(node.out_of_range("[a number < 0, a number]", "give a pole in the left half-plane")),
    }
}

fn pole_count(node: &Node<'_>, found: usize, accepts: String, asks_for: &str) -> RigError {
    node.error(RigErrorKind::PoleCount { found, accepts, remedy: format!("give {asks_for}") })
}

/// Index of the first complex pole without a conjugate; each pole is the conjugate of one other pole only.
fn unpaired(poles: &[[f64; 2]]) -> Option<usize> {
    let mut paired: Vec<bool> = poles.iter().map(|[_, im]| *im == 0.0).collect();
    for (index, [re, im]) in poles.iter().enumerate() {
        if paired[index] {
            continue;
        }
        match (index + 1..poles.len()).find(|&other| !paired[other] && poles[other] == [*re, -im]) {
            Some(conjugate) => paired[conjugate] = true,
            None => return Some(index),
        }
    }
    None
}
