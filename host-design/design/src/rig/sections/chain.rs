//! The plant of a rig file: `[cart]`, `[[link]]` and `[gravity]`, or `[model]`.

use std::f64::consts::TAU;

use serde::Serialize;

use super::super::base::Base;
use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::{Node, Table};
use super::super::quantity::Quantity;
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use super::link::{self, LINK, Link, is_zero};
use super::model::{self, LinearPlant};

/// Largest number of links of a chain; plants with more are not compiled.
pub const MAX_LINKS: usize = 14;

/// `[cart]`
pub(crate) static CART: Section = Section {
    name: "cart",
    title: "[cart]",
    meaning: "the cart and its rail",
    absent: Absent::RequiredIf("unless [model]"),
    keys: &[Cart::KEYS, OF_ARM],
};

/// Keys of an arm that a cart does not have.
const OF_ARM: &[Key] = &[
    Key {
        name: "radius_m",
        unit: "m",
        rule: Rule::POSITIVE,
        meaning: "distance from the arm's axis to the plane in which the links turn",
        absent: Absent::RequiredIf("unless each [[link]] has its own"),
    },
    Key {
        name: "encoder_counts_per_rev",
        unit: "counts/rev",
        rule: Rule::COUNTS,
        meaning: "resolution of the arm's encoder after quadrature (four counts per line)",
        absent: Absent::Follows("what encoder_step_rad gives"),
    },
];

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
        #[serde(skip_serializing_if = "Option::is_none")]
        sensor_bits: Option<f64>, "bits", Rule::BITS,
            "resolution of an absolute sensor at its pulley, instead of the encoder",
            Absent::Follows("an encoder");
        #[serde(skip_serializing_if = "is_zero")]
        sensor_noise_m: f64, "m", Rule::NOISE_M,
            "noise of this sensor besides rounding, root mean square", Absent::Numbers(&[0.0]);
    }
}

/// The plant to balance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum PlantDescription {
    /// Links on a cart or an arm.
    Chain(Chain),
    /// A linear single-input plant given by its matrices.
    Model(LinearPlant),
}

/// Share of the distance from a soft limit to the end of the rail that stays free while the rig moves: a plan turns
/// within the soft limits, but the rig may start away from its set-point.
const FREE_SHARE: f64 = 0.25;

impl Chain {
    /// Lowest and highest position of the cart while its links are raised, lowered or stilled, with these soft limits
    /// of the rail (m).
    pub fn rail_in_motion_m(&self, soft_m: [f32; 2]) -> [f32; 2] {
        let end = |side: usize| {
            let end = self.cart.travel_m[side];
            (end - FREE_SHARE * (end - f64::from(soft_m[side]))) as f32
        };
        [end(0), end(1)]
    }
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

    /// Its name and unit on this base.
    pub fn quantity(self, base: Base) -> Quantity {
        match self {
            Self::Force => base.force(),
            Self::Acceleration => base.acceleration(),
        }
    }

    /// The sensor that shows what the motor does (0: cart, 1: first link). What a drive with pulses does to the cart is
    /// known only from its own count.
    pub fn motor_sensor(&self) -> usize {
        usize::from(!self.is_force())
    }

    /// The key of its weight in `[lqr]`.
    pub fn weight_key(&self) -> &'static str {
        if self.is_force() { "force_weight" } else { "acceleration_weight" }
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
        self.refuse_other_input(input, force, acceleration)?;
        self.value(if input.is_force() { force } else { acceleration })
    }

    /// Refuses the key, of these two, that does not belong to `input`.
    pub(super) fn refuse_other_input(
        &self,
        input: CartInput,
        force: &str,
        acceleration: &str,
    ) -> Result<(), RigError> {
        let ([wanted, other], kind) = match input {
            CartInput::Force => ([force, acceleration], "acceleration"),
            CartInput::Acceleration => ([acceleration, force], "force"),
        };
        match self.get(other) {
            Some(node) => Err(node.out_of_range(
                &format!("only with kind = \"{kind}\" in [actuator]"),
                &format!("give {wanted} instead, or change kind"),
            )),
            None => Ok(()),
        }
    }

    /// Refuses keys that a drive that imposes the cart's acceleration has no use for.
    pub(super) fn refuse_for_acceleration(&self, keys: &[&str]) -> Result<(), RigError> {
        match keys.iter().find_map(|key| self.get(key)) {
            Some(node) => Err(node.out_of_range(
                "only with kind = \"force\" in [actuator]",
                "leave it out: of a drive that imposes the cart's acceleration, it changes nothing that is simulated",
            )),
            None => Ok(()),
        }
    }
}

/// A cart or an arm with n >= 1 links.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chain {
    /// The cart, or the arm in its place.
    pub cart: Cart,
    /// Which of the two it is.
    #[serde(skip_serializing_if = "Base::is_cart")]
    pub base: Base,
    /// Links from the cart outwards.
    pub links: Vec<Link>,
    /// Acceleration of gravity (m/s²).
    pub gravity_m_per_s2: f64,
    /// What the drive imposes on the cart.
    #[serde(skip_serializing_if = "CartInput::is_force")]
    pub input: CartInput,
}

impl Chain {
    /// Mass of the cart and all links (kg), or moment of inertia of an arm with upright links about its axis (kg·m²); a
    /// base whose mass is not given counts nothing.
    pub fn total_mass_kg(&self) -> f64 {
        let of_links = match self.base {
            Base::Cart => self.links_mass_kg(),
            Base::Arm => {
                let about_axis =
                    |link: &Link| link.mass_kg * link.radius_m.powi(2) + link.axial_inertia_kg_m2;
                self.links.iter().map(about_axis).sum()
            }
        };
        self.cart.mass_kg.unwrap_or_default() + of_links
    }

    /// Distance of the plane of link `index`, counted from 0, from the axis of the arm (m); none on a cart.
    pub fn radius_m(&self, index: usize) -> Option<f64> {
        if self.base.is_cart() { None } else { Some(self.links.get(index)?.radius_m) }
    }

    /// Travel of the first joint per unit of the base's position: 1 on a cart, and the arc per angle on an arm (m/rad).
    pub fn arc_m(&self) -> f64 {
        self.radius_m(0).unwrap_or(1.0)
    }

    /// Mass of all links (kg).
    pub fn links_mass_kg(&self) -> f64 {
        self.links.iter().map(|link| link.mass_kg).sum()
    }
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
    const ONE: &str = "keep [model], or [cart] or [arm] with its [[link]]s and [gravity], not both";
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
    let cart =
        root.need("cart", "[cart] and its [[link]]s, or [model]: the plant is not described; an [arm] takes the place of a [cart]")?;
    let table = cart.table(&CART)?;
    let (cart, base) = (cart_driven_by(input, &table)?, root.base());
    let radius_m = table.get("radius_m").map(|_| table.value("radius_m")).transpose()?;
    let links = root.need(LINK.name, LINKS)?;
    let entries = links.list("a list of tables", LINKS)?;
    if !(1..=MAX_LINKS).contains(&entries.len()) {
        return Err(links.wrong_length(entries.len(), &format!("1 to {MAX_LINKS}"), LINKS));
    }
    let gravity_m_per_s2 = root.get("gravity").map_or(Ok(GRAVITY_M_PER_S2), |node| gravity(&node))?;
    let links = entries.iter().enumerate();
    let links = links.map(|(index, entry)| link::link(entry, gravity_m_per_s2, index == 0, radius_m));
    let links = links.collect::<Result<Vec<_>, _>>()?;
    if !base.is_cart() && links.iter().any(|link| link.radius_m == 0.0) {
        return Err(table.missing("radius_m", &table.asks_for("radius_m")));
    }
    Ok(Chain { cart, base, links, gravity_m_per_s2, input })
}

/// A force moves a mass; a drive that imposes an acceleration also knows where it has put the cart.
fn cart_driven_by(input: CartInput, table: &Table<'_>) -> Result<Cart, RigError> {
    let mut cart = Cart::read(table)?;
    if !table.base().is_cart() {
        cart.encoder_step_m = of_a_turn(table, &cart)?;
    }
    let given = ["encoder_step_m", "sensor_bits", "sensor_noise_m"].map(|key| table.get(key));
    match (input, given.iter().flatten().next()) {
        (CartInput::Force, _) if cart.mass_kg.is_none() => {
            Err(table.missing("mass_kg", &table.asks_for("mass_kg")))
        }
        (CartInput::Acceleration, Some(node)) => Err(node.out_of_range(
            "no encoder or sensor of the cart with kind = \"acceleration\" in [actuator]",
            "leave it out: the drive's pulses are the position, and step_m of [actuator] is its step",
        )),
        _ => match given {
            [None, Some(_), _] if cart.encoder_step_m.is_none() => {
                Err(table.missing("encoder_step_m", "the travel per count of the sensor in m"))
            }
            [_, None, Some(_)] => {
                Err(table.missing("sensor_bits", "the bits per turn of the absolute sensor"))
            }
            _ => Ok(cart),
        },
    }
}

/// The angle per count (rad) of an arm's sensor, whichever way the file gives it.
fn of_a_turn(table: &Table<'_>, arm: &Cart) -> Result<Option<f64>, RigError> {
    table.not_both("encoder_step_m", "encoder_counts_per_rev", "keep the one the data sheet gives")?;
    table.not_both(
        "encoder_step_m",
        "sensor_bits",
        "a turn of the sensor is one of the arm: its bits are enough",
    )?;
    table.not_both("encoder_counts_per_rev", "sensor_bits", "keep the one that the board reads")?;
    let counts = match table.get("encoder_counts_per_rev") {
        Some(_) => Some(table.value("encoder_counts_per_rev")?),
        None => arm.sensor_bits.map(f64::exp2),
    };
    Ok(arm.encoder_step_m.or(counts.map(|counts| TAU / counts)))
}

fn gravity(node: &Node<'_>) -> Result<f64, RigError> {
    node.table(&GRAVITY)?.value("m_per_s2")
}
