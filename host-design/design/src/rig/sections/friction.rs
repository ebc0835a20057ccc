//! `[friction]`: Coulomb friction that is known, and that the controller compensates.

use super::super::error::RigError;
use super::super::key::{Absent, Section};
use super::super::node::{Node, Table};
use super::super::rule::Rule;
use super::super::value::{Keys, PerJoint, keys};
use super::chain::{CartInput, PlantDescription};

/// `[friction]`
pub(crate) static FRICTION: Section = Section {
    name: "friction",
    title: "[friction]",
    meaning: "known Coulomb friction, which the controller compensates; needs [kalman], not possible with [model]",
    absent: Absent::Follows("nothing is compensated"),
    keys: &[KnownFriction::KEYS],
};

const NONE: Absent = Absent::Numbers(&[0.0]);

keys! {
    /// Known Coulomb friction, which the controller compensates, `[friction]`. The friction of the simulated machine
    /// is in `[reality]`.
    pub struct KnownFriction {
        joint_n_m: PerJoint, "N·m", Rule::NOT_NEGATIVE.worded("a number >= 0, or one per joint"),
            "known Coulomb friction of each joint", NONE;
        cart_n: f64, "N", Rule::NOT_NEGATIVE, "known Coulomb friction of the cart; 90 % of it is compensated", NONE;
        joint_rate_rad_per_s: f64, "rad/s", Rule::POSITIVE,
            "rate of a joint at which the compensation reaches its full value", Absent::Numbers(&[0.07]);
        cart_speed_m_per_s: f64, "m/s", Rule::POSITIVE,
            "speed of the cart at which the compensation reaches its full value", Absent::Numbers(&[0.01]);
        fed_forward_percent: f64, "%", Rule::SPREAD,
            "share of the joints' friction whose static effect is cancelled by a feedforward force",
            Absent::Numbers(&[30.0]);
    }
}

/// Reads `[friction]`, which needs a chain and an observer.
pub(crate) fn friction(
    node: &Node<'_>,
    plant: &PlantDescription,
    has_observer: bool,
) -> Result<KnownFriction, RigError> {
    let PlantDescription::Chain(chain) = plant else {
        let remedy = "describe the machine by [cart] and [[link]], or leave [friction] out";
        return Err(node.out_of_range("only a chain of links", remedy));
    };
    if !has_observer {
        return Err(node.out_of_range("only with [kalman]", "add [kalman], or leave [friction] out"));
    }
    let table: Table<'_> = node.table(&FRICTION)?;
    if chain.input == CartInput::Acceleration {
        table.refuse_for_acceleration(&["cart_n", "cart_speed_m_per_s"])?;
    }
    let known = KnownFriction::read(&table)?;
    if let Some(list) = table.get("joint_n_m").filter(Node::is_list) {
        list.numbers(chain.links.len(), Rule::ANY, &table.asks_for("joint_n_m"))?;
    }
    Ok(known)
}
