//! The plant of a rig file: `[cart]`, `[[link]]` and `[gravity]`, or `[model]`.

use serde::Serialize;

use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::{Node, Table};
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
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

/// `[[link]]`
pub(crate) static LINK: Section = Section {
    name: "link",
    title: "[[link]]",
    meaning: "one table per link, from the cart outwards, 1 to 14 of them",
    absent: Absent::RequiredIf("unless [model]"),
    keys: &[LINK_KEYS],
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

const LINK_KEYS: &[Key] = &[
    Key {
        name: "mass_kg",
        unit: "kg",
        rule: Rule::POSITIVE,
        meaning: "mass of the link",
        absent: Absent::Required,
    },
    Key {
        name: "length_m",
        unit: "m",
        rule: Rule::POSITIVE,
        meaning: "length of the link from its joint to the next one, or to its tip",
        absent: Absent::Required,
    },
    Key {
        name: "centre_of_mass_m",
        unit: "m",
        rule: Rule::POSITIVE.worded("a number > 0, at most 10 times length_m"),
        meaning: "distance from the link's joint to its centre of mass",
        absent: Absent::Follows("half the length"),
    },
    Key {
        name: "inertia_kg_m2",
        unit: "kg·m²",
        rule: Rule::NOT_NEGATIVE,
        meaning: "moment of inertia about the centre of mass (0 for a point mass)",
        absent: Absent::Follows("a uniform rod, mass · length² / 12"),
    },
    Key {
        name: "friction_n_m_s_per_rad",
        unit: "N·m·s/rad",
        rule: Rule::NOT_NEGATIVE,
        meaning: "viscous friction in the link's lower joint",
        absent: Absent::Numbers(&[0.0]),
    },
    Key {
        name: "encoder_step_rad",
        unit: "rad",
        rule: Rule::ANGLE,
        meaning: "angle per encoder count",
        absent: Absent::Follows("what encoder_counts_per_rev gives"),
    },
    Key {
        name: "encoder_counts_per_rev",
        unit: "counts/rev",
        rule: Rule::COUNTS,
        meaning: "resolution of the encoder after quadrature (four counts per line)",
        absent: Absent::Follows("what encoder_step_rad gives; neither, no encoder"),
    },
];

keys! {
    /// The cart and its rail, `[cart]`.
    pub struct Cart {
        mass_kg: Option<f64>, "kg", Rule::POSITIVE,
            "mass of the cart, with the equivalent mass of belt, gear and motor",
            Absent::RequiredIf("unless kind = \"acceleration\" in [actuator]");
        friction_n_s_per_m: f64, "N·s/m", Rule::NOT_NEGATIVE,
            "viscous friction of the cart on the rail", Absent::Numbers(&[0.0]);
        travel_m: [f64; 2], "m", Rule::AROUND_ZERO,
            "ends of the rail, with the start position 0 between them", Absent::Numbers(&[-2.0, 2.0]);
        encoder_step_m: Option<f64>, "m", Rule::POSITIVE,
            "travel per encoder count; none with kind = \"acceleration\", which counts its pulses",
            Absent::Follows("no encoder; required with [kalman]");
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

/// What the drive imposes on the cart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum CartInput {
    /// A force (N).
    #[default]
    Force,
    /// An acceleration (m/s²), whatever force that takes.
    Acceleration,
}

impl CartInput {
    /// Whether it is a force.
    pub fn is_force(&self) -> bool {
        *self == CartInput::Force
    }
}

impl Table<'_> {
    /// The number of the key that belongs to `input`; the other one is refused.
    pub(super) fn of_input(
        &self,
        input: CartInput,
        force: &str,
        acceleration: &str,
    ) -> Result<f64, RigError> {
        let ([wanted, other], kind) = match input {
            CartInput::Force => ([force, acceleration], "acceleration"),
            CartInput::Acceleration => ([acceleration, force], "force"),
        };
        if let Some(node) = self.get(other) {
            let accepts = format!("only with kind = \"{kind}\" in [actuator]");
            return Err(node.out_of_range(&accepts, &format!("give {wanted} instead, or change kind")));
        }
        self.value(wanted)
    }

    /// Refuses keys that a drive that imposes the cart's acceleration has no use for.
    pub(super) fn refuse_for_acceleration(&self, keys: &[&str]) -> Result<(), RigError> {
        match keys.iter().find_map(|key| self.get(key)) {
            Some(node) => Err(node.out_of_range(
                "only with kind = \"force\" in [actuator]",
                "leave it out: a drive that imposes the cart's acceleration is not affected",
            )),
            None => Ok(()),
        }
    }
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
    /// What the drive imposes on the cart.
    #[serde(skip_serializing_if = "CartInput::is_force")]
    pub input: CartInput,
}

/// One link of a chain, `[[link]]`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Link {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Distance from this link's joint to the next one (m).
    pub length_m: f64,
    /// Distance from the joint to the centre of mass (m); half the length if not given.
    pub centre_of_mass_m: Option<f64>,
    /// Moment of inertia about the centre of mass (kg·m²); that of a uniform rod, m l²/12, if not given.
    pub inertia_kg_m2: Option<f64>,
    /// Viscous friction in the lower joint, on the relative rate (N·m·s/rad).
    pub friction_n_m_s_per_rad: f64,
    /// Resolution of the joint's encoder.
    pub encoder: Option<LinkEncoder>,
}

/// Resolution of a joint encoder, in the form that the file gives.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum LinkEncoder {
    /// `encoder_step_rad`: angle per count (rad).
    StepRad(f64),
    /// `encoder_counts_per_rev`: counts per revolution; the step is 2π / counts (rad).
    CountsPerRev(f64),
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
pub(crate) fn plant(root: &Table<'_>, input: CartInput) -> Result<PlantDescription, RigError> {
    const ONE: &str = "keep [model], or [cart] with its [[link]]s and [gravity], not both";
    for part in ["cart", "link", "gravity"] {
        root.not_both("model", part, ONE)?;
    }
    match root.get("model") {
        Some(node) if input == CartInput::Acceleration => {
            let remedy = "describe the machine by [cart] and [[link]], or give [model] an input in any unit without kind";
            Err(node.out_of_range("only with kind = \"force\" in [actuator]", remedy))
        }
        Some(node) => model::model(&node).map(PlantDescription::Model),
        None => chain(root, input).map(PlantDescription::Chain),
    }
}

fn chain(root: &Table<'_>, input: CartInput) -> Result<Chain, RigError> {
    const LINKS: &str = "one [[link]] table per link, from the cart outwards";
    let cart = root.need("cart", "[cart] and its [[link]]s, or [model]: the plant is not described")?;
    let cart = cart_driven_by(input, &cart.table(&CART)?)?;
    let links = root.need(LINK.name, LINKS)?;
    let entries = links.list("a list of tables", LINKS)?;
    if !(1..=MAX_LINKS).contains(&entries.len()) {
        return Err(links.wrong_length(entries.len(), &format!("1 to {MAX_LINKS}"), LINKS));
    }
    Ok(Chain {
        cart,
        links: entries.iter().map(link).collect::<Result<_, _>>()?,
        gravity_m_per_s2: root.get("gravity").map_or(Ok(GRAVITY_M_PER_S2), |node| gravity(&node))?,
        input,
    })
}

/// A force moves a mass; a drive that imposes an acceleration also knows where it has put the cart.
fn cart_driven_by(input: CartInput, table: &Table<'_>) -> Result<Cart, RigError> {
    let cart = Cart::read(table)?;
    match (input, table.get("encoder_step_m")) {
        (CartInput::Force, _) if cart.mass_kg.is_none() => {
            Err(table.missing("mass_kg", &table.asks_for("mass_kg")))
        }
        (CartInput::Acceleration, Some(node)) => Err(node.out_of_range(
            "no encoder of the cart with kind = \"acceleration\" in [actuator]",
            "leave it out: the drive's pulses are the position, and step_m of [actuator] is its step",
        )),
        _ => Ok(cart),
    }
}

fn link(node: &Node<'_>) -> Result<Link, RigError> {
    let table = node.table(&LINK)?;
    let length_m = table.value("length_m")?;
    let centre_of_mass_m = table.value("centre_of_mass_m")?;
    within_reach(&table, centre_of_mass_m, length_m)?;
    Ok(Link {
        mass_kg: table.value("mass_kg")?,
        length_m,
        centre_of_mass_m,
        inertia_kg_m2: table.value("inertia_kg_m2")?,
        friction_n_m_s_per_rad: table.value("friction_n_m_s_per_rad")?,
        encoder: link_encoder(&table)?,
    })
}

/// The centre of mass may lie beyond the next joint (a link with an extension), but not far beyond.
fn within_reach(table: &Table<'_>, centre_of_mass_m: Option<f64>, length_m: f64) -> Result<(), RigError> {
    let most = 10.0 * length_m;
    match (table.get("centre_of_mass_m"), centre_of_mass_m) {
        (Some(node), Some(distance)) if distance > most => Err(node.out_of_range(
            &format!("a number > 0 and <= 10 times length_m, {most} (m)"),
            "give the distance from the joint to the centre of mass in m, or correct length_m",
        )),
        _ => Ok(()),
    }
}

fn link_encoder(table: &Table<'_>) -> Result<Option<LinkEncoder>, RigError> {
    table.not_both("encoder_step_rad", "encoder_counts_per_rev", "keep the one the data sheet gives")?;
    let step: Option<f64> = table.value("encoder_step_rad")?;
    let counts: Option<f64> = table.value("encoder_counts_per_rev")?;
    Ok(step.map(LinkEncoder::StepRad).or(counts.map(LinkEncoder::CountsPerRev)))
}

fn gravity(node: &Node<'_>) -> Result<f64, RigError> {
    node.table(&GRAVITY)?.value("m_per_s2")
}
