//! `[robust]`: how far the machine may be from the file.

use super::super::error::RigError;
use super::super::key::{Absent, Section};
use super::super::node::Node;
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use super::chain::{CartInput, PlantDescription};

/// `[robust]`
pub(crate) static ROBUST: Section = Section {
    name: "robust",
    title: "[robust]",
    meaning: "tolerances that `upright robust` chooses weights, far poles and joint noise for, not with [model]; changes \
              no gain by itself, but fault detection tolerates as much, and at least a typical machine",
    absent: Absent::Follows("fault detection tolerates a typical machine"),
    keys: &[Tolerances::KEYS],
};

const NONE: Absent = Absent::Numbers(&[0.0]);
/// Largest accepted error of the masses (%) and latency (ticks): twice these values, which the front tries, can still
/// be simulated.
const MOST: [f64; 2] = [45.0, 0.3];

keys! {
    /// How far the machine may be from the file, `[robust]`. It changes no gain, so it is not part of the rig's hash.
    pub struct Tolerances {
        mass_percent: f64, "%", Rule::SPREAD.worded("a number >= 0 and <= 45 (%)"),
            "error (±) of the masses, in every combination", NONE;
        joint_friction_n_m: f64, "N·m", Rule::NOT_NEGATIVE, "largest Coulomb friction of each joint", NONE;
        cart_friction_n: f64, "N", Rule::NOT_NEGATIVE, "largest Coulomb friction of the cart", NONE;
        homing_error_rad: f64, "rad", Rule::NOT_NEGATIVE, "largest error of each joint's zero", NONE;
        latency_s: f64, "s", Rule::NOT_NEGATIVE.worded("a number >= 0 and <= 0.3 period_s"),
            "largest delay of the force in addition to delay_ticks", NONE;
    }
}

/// One of the tolerances.
#[derive(Debug, Clone, Copy)]
pub struct ToleranceKey {
    /// Its key in `[robust]`.
    pub key: &'static str,
    /// Its value.
    pub at: fn(&mut Tolerances) -> &mut f64,
}

macro_rules! tolerance {
    ($key:ident) => {
        ToleranceKey { key: stringify!($key), at: |tolerances| &mut tolerances.$key }
    };
}

impl Tolerances {
    /// The error of the masses.
    pub const MASS: ToleranceKey = tolerance!(mass_percent);
    /// The friction of the joints.
    pub const JOINT_FRICTION: ToleranceKey = tolerance!(joint_friction_n_m);
    /// The friction of the cart.
    pub const CART_FRICTION: ToleranceKey = tolerance!(cart_friction_n);
    /// The errors of the zeros.
    pub const HOMING_ERROR: ToleranceKey = tolerance!(homing_error_rad);
}

impl Default for Tolerances {
    fn default() -> Self {
        Tolerances::when_absent().expect("no key of [robust] is required")
    }
}

impl Tolerances {
    /// Every tolerance times `scale`.
    pub fn scaled(&self, scale: f64) -> Self {
        Self {
            mass_percent: scale * self.mass_percent,
            joint_friction_n_m: scale * self.joint_friction_n_m,
            cart_friction_n: scale * self.cart_friction_n,
            homing_error_rad: scale * self.homing_error_rad,
            latency_s: scale * self.latency_s,
        }
    }

    /// The larger one of each tolerance and that of `other`.
    pub fn at_least(&self, other: &Self) -> Self {
        Self {
            mass_percent: self.mass_percent.max(other.mass_percent),
            joint_friction_n_m: self.joint_friction_n_m.max(other.joint_friction_n_m),
            cart_friction_n: self.cart_friction_n.max(other.cart_friction_n),
            homing_error_rad: self.homing_error_rad.max(other.homing_error_rad),
            latency_s: self.latency_s.max(other.latency_s),
        }
    }

    /// The tolerance that is too large to be simulated with a tick of `period_s`, if one is: its name, its value, and
    /// what is accepted.
    pub fn too_large(&self, period_s: f64) -> Option<(&'static str, f64, &'static str)> {
        let most =
            [("mass_percent", self.mass_percent, MOST[0]), ("latency_s", self.latency_s, MOST[1] * period_s)];
        let (name, value, _) = most.into_iter().find(|(_, value, most)| value > most)?;
        Some((name, value, ROBUST.key(name).rule.accepts))
    }

    /// The name of each tolerance, its unit and its value.
    pub fn each(&self) -> impl Iterator<Item = (&'static str, &'static str, f64)> {
        let values = self.values().into_iter().flatten();
        Self::KEYS.iter().zip(values).map(|(key, value)| (key.name, key.unit, value))
    }
}

/// Reads `[robust]`, which needs a chain.
pub(crate) fn robust(
    node: &Node<'_>,
    plant: &PlantDescription,
    period_s: f64,
) -> Result<Tolerances, RigError> {
    let PlantDescription::Chain(chain) = plant else {
        let remedy = "describe the machine by [cart] and [[link]], or leave [robust] out";
        return Err(node.out_of_range("only a chain of links", remedy));
    };
    let table = node.table(&ROBUST)?;
    if chain.input == CartInput::Acceleration {
        table.refuse_for_acceleration(&["cart_friction_n", "latency_s"])?;
    }
    let tolerances = Tolerances::read(&table)?;
    match tolerances.too_large(period_s).and_then(|(name, _, accepts)| Some((table.get(name)?, accepts))) {
        Some((node, accepts)) => {
            Err(node.out_of_range(accepts, "give less, or weigh the parts and set delay_ticks = 1"))
        }
        None => Ok(tolerances),
    }
}
