//! The design wishes of a rig file: `[lqr]`, `[pole_placement]`, `[kalman]` and `[integral]`.

use crate::rig::error::{RigError, RigErrorKind};
use crate::rig::node::{Node, Section};
use crate::rig::rule::Rule;
use crate::rig::{Integral, Kalman, Lqr, PlantDescription, PolePlacement};

/// `[lqr]`, with one weight per state.
pub(super) fn lqr(node: &Node<'_>, states: usize) -> Result<Lqr, RigError> {
    const WEIGHTS: &str = "one weight per state, in the order x, its rate, theta 1, its rate, ...";
    let table = node.section(&["state_weights", "force_weight"])?;
    Ok(Lqr {
        state_weights: table.need("state_weights", WEIGHTS)?.numbers(states, Rule::NOT_NEGATIVE, WEIGHTS)?,
        force_weight: table.number(
            "force_weight",
            Rule::POSITIVE,
            "the weight of the squared force; without a price for force there is no optimum",
        )?,
    })
}

/// `[pole_placement]`, with one pole per state.
pub(super) fn pole_placement(node: &Node<'_>, states: usize) -> Result<PolePlacement, RigError> {
    let table = node.section(&["overshoot_percent", "settling_time_s", "far_poles", "poles"])?;
    for key in ["overshoot_percent", "settling_time_s", "far_poles"] {
        table.not_both(
            "poles",
            key,
            "keep either poles, or overshoot_percent, settling_time_s and far_poles",
        )?;
    }
    match table.get("poles") {
        Some(node) => poles(&node, states).map(PolePlacement::Poles),
        None => response(&table, states),
    }
}

fn response(table: &Section<'_>, states: usize) -> Result<PolePlacement, RigError> {
    const FAR: &str = "the poles besides the dominant pair in 1/s, real and negative";
    let overshoot_percent = table.number(
        "overshoot_percent",
        Rule::PERCENT,
        "the overshoot of the dominant pair in %, or poles = [[re, im], ...]",
    )?;
    let settling_time_s =
        table.number("settling_time_s", Rule::POSITIVE, "the settling time of the dominant pair in s")?;
    let far = table.need("far_poles", FAR)?;
    let entries = far.list("a list of numbers", FAR)?;
    if entries.len() + 2 != states {
        let accepts = match states.checked_sub(2) {
            Some(wanted) => format!("{wanted}, one per state besides the dominant pair"),
            None => format!("none: a dominant pair needs 2 states and the plant has {states}"),
        };
        return Err(pole_count(&far, entries.len(), accepts, FAR));
    }
    let far_poles = entries.iter().map(|pole| pole.number(Rule::NEGATIVE, FAR)).collect::<Result<_, _>>()?;
    Ok(PolePlacement::Response { overshoot_percent, settling_time_s, far_poles })
}

fn poles(node: &Node<'_>, states: usize) -> Result<Vec<[f64; 2]>, RigError> {
    const POLES: &str = "one pole per state as [re, im] in 1/s, with re < 0";
    let entries = node.list("a list of [re, im] pairs", POLES)?;
    if entries.len() != states {
        return Err(pole_count(node, entries.len(), format!("{states}, one per state"), POLES));
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

fn pole_count(node: &Node<'_>, found: usize, accepts: String, meaning: &str) -> RigError {
    node.error(RigErrorKind::PoleCount { found, accepts, remedy: format!("give {meaning}") })
}

/// Index of the first complex pole that no other pole is the conjugate of, each pole serving once.
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

/// `[kalman]`, with one intensity per noise input.
pub(super) fn kalman(node: &Node<'_>, plant: &PlantDescription) -> Result<Kalman, RigError> {
    let table = node.section(&["force_noise_n2_s", "joint_noise"])?;
    let (further, meaning) = match plant {
        PlantDescription::Chain(chain) => {
            (chain.links.len(), "one intensity per joint in (N·m)²·s, that is variance times hold time")
        }
        PlantDescription::Model(model) => (
            model.noise_input.as_ref().map_or(1, Vec::len) - 1,
            "one intensity per column of model.noise_input after the first",
        ),
    };
    let force_noise_n2_s = table.number(
        "force_noise_n2_s",
        Rule::NOT_NEGATIVE,
        "the intensity of the force noise in N²·s, that is variance times hold time",
    )?;
    let joint_noise = match table.get("joint_noise") {
        Some(node) => node.numbers(further, Rule::NOT_NEGATIVE, meaning)?,
        None if further == 0 => Vec::new(),
        None => return Err(table.missing("joint_noise", meaning)),
    };
    Ok(Kalman { force_noise_n2_s, joint_noise })
}

/// `[integral]`
pub(super) fn integral(node: &Node<'_>) -> Result<Integral, RigError> {
    let position_weight = node.section(&["position_weight"])?.number(
        "position_weight",
        Rule::POSITIVE,
        "the weight of the integrated position error, or leave [integral] out",
    )?;
    Ok(Integral { position_weight })
}
