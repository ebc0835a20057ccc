//! The plant of a rig file: `[cart]`, `[[link]]` and `[gravity]`, or `[model]`.

use serde::Serialize;

use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::{Node, Table};
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use super::link::{self, LINK, Link};
use super::model::{self, LinearPlant};

/// Largest number of links of a chain; plants with more are not compiled.
pub const MAX_LINKS: usize = 14;

/// `[cart]`
pub(crate) static CART: Section = Section {
    name: "cart",
    title: "[cart]",
    meaning: "the cart and its rail",
    absent: Absent::RequiredIf("unless [model]"),
    keys: &[Cart::KEYS],
};

/// `[gravity]`
pub(crate) static GRAVITY: Section = Section {
    name: "gravity",
    title: "[gravity]",
    meaning: "gravity",
    absent: Absent::Numbers(&[GRAVITY_M_PER_S2]),
    keys: &[&[Key {
        name: "m_per_s2",
        unit: "m/s²",
        rule: Rule::POSITIVE,
        meaning: "acceleration of gravity, about 9.81",
        absent: Absent::Required,
    }]],
};

/// Acceleration of gravity (m/s²) without `[gravity]`.
const GRAVITY_M_PER_S2: f64 = 9.81;

keys! {
    /// The cart and its rail, `[cart]`.
    pub struct Cart {
        mass_kg: f64, "kg", Rule::POSITIVE,
            "mass of the cart, with the equivalent mass of belt, gear and motor", Absent::Required;
        friction_n_s_per_m: f64, "N·s/m", Rule::NOT_NEGATIVE,
            "viscous friction of the cart on the rail", Absent::Numbers(&[0.0]);
        travel_m: [f64; 2], "m", Rule::AROUND_ZERO,
            "ends of the rail, with the start position 0 between them", Absent::Numbers(&[-2.0, 2.0]);
        encoder_step_m: Option<f64>, "m", Rule::POSITIVE,
            "travel per encoder count", Absent::Follows("no encoder; required with [kalman]");
    }
}

/// The plant to balance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum PlantDescription {
    /// Links on a cart.
    Chain(Chain),
    /// A linear single-input plant given by its matrices.
    Model(LinearPlant),
}

/// A cart with n >= 1 links.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chain {
    /// The cart.
    pub cart: Cart,
    /// Links from the cart outwards.
    pub links: Vec<Link>,
    /// Acceleration of gravity (m/s²).
    pub gravity_m_per_s2: f64,
}

impl PlantDescription {
    /// Number of states: 2n + 2 for n links, or the order of the model.
    pub fn states(&self) -> usize {
        match self {
            PlantDescription::Chain(chain) => 2 * chain.links.len() + 2,
            PlantDescription::Model(model) => model.b.len(),
        }
    }
}

/// Reads the plant, which the file gives either as a chain or as a linear model.
pub(crate) fn plant(root: &Table<'_>) -> Result<PlantDescription, RigError> {
    const ONE: &str = "keep [model], or [cart] with its [[link]]s and [gravity], not both";
    for part in ["cart", "link", "gravity"] {
        root.not_both("model", part, ONE)?;
    }
    match root.get("model") {
        Some(node) => model::model(&node).map(PlantDescription::Model),
        None => chain(root).map(PlantDescription::Chain),
    }
}

fn chain(root: &Table<'_>) -> Result<Chain, RigError> {
    const LINKS: &str = "one [[link]] table per link, from the cart outwards";
    let cart = root.need("cart", "[cart] and its [[link]]s, or [model]: the plant is not described")?;
    let cart = Cart::read(&cart.table(&CART)?)?;
    let links = root.need(LINK.name, LINKS)?;
    let entries = links.list("a list of tables", LINKS)?;
    if !(1..=MAX_LINKS).contains(&entries.len()) {
        return Err(links.wrong_length(entries.len(), &format!("1 to {MAX_LINKS}"), LINKS));
    }
    let gravity_m_per_s2 = root.get("gravity").map_or(Ok(GRAVITY_M_PER_S2), |node| gravity(&node))?;
    let links = entries.iter().map(|entry| link::link(entry, gravity_m_per_s2)).collect::<Result<_, _>>()?;
    Ok(Chain { cart, links, gravity_m_per_s2 })
}

fn gravity(node: &Node<'_>) -> Result<f64, RigError> {
    node.table(&GRAVITY)?.value("m_per_s2")
}
