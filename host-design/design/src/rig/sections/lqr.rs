//! `[lqr]`: weights of the linear quadratic regulator.

use serde::Serialize;

use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::Node;
use super::super::rule::Rule;
use super::chain::CartInput;

/// `[lqr]`
pub(crate) static LQR: Section = Section {
    name: "lqr",
    title: "[lqr]",
    meaning: "minimises the cost `xᵀ Q x + 2 u s x + r u²`",
    absent: Absent::Follows("no LQR"),
    keys: &[&[
        Key {
            name: "state_weights",
            unit: "",
            rule: Rule::checked_by_its_section(
                "one number >= 0 per state, or the rows of a symmetric matrix",
            ),
            meaning: "weights q of the squared states, one weight per state, in the order x, its rate, θ1, its rate, …; \
                or all of Q as [[10, 0, …], …]",
            absent: Absent::Required,
        },
        Key {
            name: "force_weight",
            unit: "",
            rule: Rule::POSITIVE,
            meaning: "weight r of the squared force; with r = 0 there would be no optimum",
            absent: Absent::RequiredIf("with kind = \"force\" in [actuator]"),
        },
        Key {
            name: "acceleration_weight",
            unit: "",
            rule: Rule::POSITIVE,
            meaning: "the same weight of the cart's squared acceleration",
            absent: Absent::RequiredIf("with kind = \"acceleration\""),
        },
        Key {
            name: "cross_weights",
            unit: "",
            rule: Rule::checked_by_its_section("one number per state"),
            meaning: "weights s of `2 u s x`, one per state (N of MATLAB's `lqr`)",
            absent: Absent::Follows("none"),
        },
        Key {
            name: "angles",
            unit: "",
            rule: Rule::checked_by_its_section("\"relative\" or \"absolute\""),
            meaning: "angles that the weights are for: each against the link before it, or all against upright",
            absent: Absent::Follows("relative"),
        },
        Key {
            name: "cost",
            unit: "",
            rule: Rule::checked_by_its_section("\"integral\" or \"sum\""),
            meaning: "what the gains of the tick minimise: the integral over time (MATLAB's `lqrd`), or the sum over \
                the ticks (`dlqr`)",
            absent: Absent::Follows("integral"),
        },
    ]],
};

/// `[lqr]`: minimise the integral of `xᵀ Q x + 2 xᵀ s u + r u²`, or its sum over the ticks.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Lqr {
    /// Diagonal of Q, one weight per state.
    pub state_weights: Vec<f64>,
    /// Weight r > 0 of the squared input: force, or acceleration of the cart.
    pub force_weight: f64,
    /// The entries of Q beside its diagonal, as a symmetric matrix with zeros on the diagonal; empty if there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mixed_weights: Vec<Vec<f64>>,
    /// Weights s, one per state; empty if there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cross_weights: Vec<f64>,
    /// Whether the weights are for angles against upright instead of those against the link before.
    #[serde(skip_serializing_if = "is_default")]
    pub angles_are_absolute: bool,
    /// Whether the gains of the tick minimise the sum over the ticks instead of the integral over time.
    #[serde(skip_serializing_if = "is_default")]
    pub cost_is_sum: bool,
}

/// Leaves out what the file did not ask for, so that rigs keep the hash that they had without these keys.
fn is_default(value: &bool) -> bool {
    !*value
}

impl Lqr {
    /// Q as its file gives it, s×s.
    pub fn weight_rows(&self) -> Vec<Vec<f64>> {
        let entry = |i: usize, j: usize| match self.mixed_weights.get(i) {
            _ if i == j => self.state_weights[i],
            Some(row) => row[j],
            None => 0.0,
        };
        let states = self.state_weights.len();
        (0..states).map(|i| (0..states).map(|j| entry(i, j)).collect()).collect()
    }

    /// Q and s for the states of the plant, whose angles are relative.
    pub fn weights(&self) -> (Vec<Vec<f64>>, Vec<f64>) {
        let (mut q, states) = (self.weight_rows(), self.state_weights.len());
        let mut s =
            if self.cross_weights.is_empty() { vec![0.0; states] } else { self.cross_weights.clone() };
        if self.angles_are_absolute {
            // An absolute angle is the sum of the relative ones up to it, so that Tᵀ Q T adds up what comes after.
            for i in (2..states.saturating_sub(2)).rev() {
                s[i] += s[i + 2];
                let (rows, below) = q.split_at_mut(i + 2);
                rows[i].iter_mut().zip(&below[0]).for_each(|(sum, entry)| *sum += entry);
            }
            for row in &mut q {
                for i in (2..states.saturating_sub(2)).rev() {
                    row[i] += row[i + 2];
                }
            }
        }
        (q, s)
    }
}

/// Reads `[lqr]`, with one weight per state. `is_chain`: whether the states are those of a chain of links.
pub(crate) fn lqr(node: &Node<'_>, states: usize, is_chain: bool, input: CartInput) -> Result<Lqr, RigError> {
    let table = node.table(&LQR)?;
    let weights = table.required("state_weights")?;
    let is_matrix = weights
        .list("a list", &table.asks_for("state_weights"))
        .is_ok_and(|entries| entries.first().is_some_and(Node::is_list));
    let mut lqr =
        Lqr { force_weight: table.of_input(input, "force_weight", "acceleration_weight")?, ..Lqr::default() };
    if is_matrix {
        (lqr.state_weights, lqr.mixed_weights) =
            full_weights(&weights, states, &table.asks_for("state_weights"))?;
    } else {
        lqr.state_weights = table.numbers("state_weights", states, Rule::NOT_NEGATIVE)?;
    }
    if let Some(cross) = table.get("cross_weights") {
        lqr.cross_weights = cross.numbers(states, Rule::ANY, &table.asks_for("cross_weights"))?;
    }
    if let Some(angles) = table.get("angles") {
        lqr.angles_are_absolute = angles.one_of(["relative", "absolute"], &table.asks_for("angles"))? == 1;
        if !is_chain {
            return Err(angles.out_of_range("a chain of links", "leave it out: a [model] has no angles"));
        }
    }
    if let Some(cost) = table.get("cost") {
        lqr.cost_is_sum = cost.one_of(["integral", "sum"], &table.asks_for("cost"))? == 1;
    }
    if !costs_nothing_negative(&lqr) {
        return Err(weights.out_of_range(
            "weights with which no state and force cost less than 0",
            "check the entries beside the diagonal and cross_weights against the diagonal and force_weight",
        ));
    }
    Ok(lqr)
}

/// The diagonal and the rest of Q.
fn full_weights(
    node: &Node<'_>,
    states: usize,
    asks_for: &str,
) -> Result<(Vec<f64>, Vec<Vec<f64>>), RigError> {
    let rows = node.list("a list of rows", asks_for)?;
    if rows.len() != states {
        return Err(node.wrong_length(rows.len(), &format!("{states}"), asks_for));
    }
    let mut q: Vec<Vec<f64>> = Vec::with_capacity(states);
    for (i, row) in rows.iter().enumerate() {
        let entries = row.numbers(states, Rule::ANY, asks_for)?;
        if let Some(j) = (0..i).find(|&j| q[j][i] != entries[j]) {
            return Err(row.out_of_range(
                &format!("a symmetric matrix, here {} in column {}", q[j][i], j + 1),
                "give both halves of the matrix the same numbers",
            ));
        }
        q.push(entries);
    }
    let diagonal = (0..states).map(|i| std::mem::take(&mut q[i][i])).collect();
    if q.iter().flatten().all(|&weight| weight == 0.0) {
        q.clear();
    }
    Ok((diagonal, q))
}

/// Whether `[Q s; sᵀ r]` is positive semidefinite, by a Cholesky factorisation with pivots.
fn costs_nothing_negative(lqr: &Lqr) -> bool {
    let mut rows = lqr.weight_rows();
    if !lqr.cross_weights.is_empty() {
        rows.iter_mut().zip(&lqr.cross_weights).for_each(|(row, &weight)| row.push(weight));
        rows.push([&lqr.cross_weights[..], &[lqr.force_weight]].concat());
    }
    let rounding = 1e-12 * (0..rows.len()).map(|i| rows[i][i]).fold(0.0, f64::max);
    let mut left: Vec<usize> = (0..rows.len()).collect();
    while let Some(place) =
        (0..left.len()).max_by(|&i, &j| rows[left[i]][left[i]].total_cmp(&rows[left[j]][left[j]]))
    {
        let pivot = left.swap_remove(place);
        let largest = rows[pivot][pivot];
        if largest <= rounding {
            let mut rest = left.iter().chain([&pivot]);
            return rest.all(|&i| left.iter().chain([&pivot]).all(|&j| rows[i][j].abs() <= rounding));
        }
        let pivot_row = rows[pivot].clone();
        for &i in &left {
            for &j in &left {
                rows[i][j] -= pivot_row[i] * pivot_row[j] / largest;
            }
        }
    }
    true
}
