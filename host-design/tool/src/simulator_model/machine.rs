//! What both formats take from a rig.

use upright_design::reality::real_chain;
use upright_design::rig::{Base, Chain, Link, Rig};

/// Name of the link without mass at the end of the last link in a URDF: a URDF has no lengths.
pub(crate) const TIP: &str = "tip";

/// Force and speed of a URDF's joint that has no limit (N, m/s): the format has no word for that.
pub(crate) const UNLIMITED: f64 = 1e9;

/// Why a rig has no model for a simulator.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoModel {
    /// It is given by matrices.
    #[error("[model] has no bodies: describe the machine by [cart] and [[link]]")]
    NoBodies,
    /// Its links are on an arm.
    #[error("links on an arm are not written: only a cart and a chain of hinges are")]
    Arm,
    /// The mass of the cart is unknown.
    #[error("mass_kg of [cart] is missing: a URDF needs it, whatever drives the cart")]
    NoCartMass,
}

/// Keys of `[reality]` that every format has: those of the chain and of its joints.
const CARRIED: [&str; 7] = [
    "joint_friction_n_m",
    "cart_mass_percent",
    "link_mass_percent",
    "link_length_percent",
    "link_inertia_percent",
    "parameter_spread_percent",
    "parameter_seed",
];

/// The simulated machine's chain.
pub(super) fn machine(rig: &Rig) -> Result<Chain, NoModel> {
    let chain = rig.chain().ok_or(NoModel::NoBodies)?;
    if chain.base != Base::Cart {
        return Err(NoModel::Arm);
    }
    Ok(real_chain(chain, &rig.reality.parameters))
}

/// Moment of inertia about the centre of mass (kg·m²).
pub(super) fn inertia_kg_m2(link: &Link) -> f64 {
    link.inertia_kg_m2.unwrap_or(link.mass_kg * link.length_m * link.length_m / 12.0)
}

/// Lines of an XML comment: each sensor's step, noise and age, the tick, and the keys of `[reality]` that are not among
/// those that every format has, or `further` ones that this format has.
pub(super) fn facts(rig: &Rig, further: &[&str]) -> String {
    let period_s = rig.tick.period_s;
    let begins = if rig.tick.delay_ticks == 0 { "in its tick" } else { "one tick later" };
    let mut lines = format!("  A tick is {period_s} s, and its input begins {begins}.\n");
    for sensor in rig.sensors() {
        let (joint, unit) = match sensor.state {
            0 => ("slide".to_owned(), "m"),
            state => (format!("hinge_{}", state / 2), "rad"),
        };
        let (step, delay_s) = (sensor.step::<f64>(), sensor.delay_s);
        lines += &format!(
            "  The sensor of {joint}: steps of {step} {unit}, noise {} {unit} rms, {delay_s} s old.\n",
            sensor.noise
        );
    }
    let left: Vec<&str> =
        rig.reality.given_keys().filter(|key| !CARRIED.contains(key) && !further.contains(key)).collect();
    if !left.is_empty() {
        lines += &format!("  Not in this file, of [reality]: {}.\n", left.join(", "));
    }
    lines
}

/// A rig's name within an XML comment or attribute.
pub(super) fn plain(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_alphanumeric() || "-_. ".contains(c) { c } else { '_' }).collect();
    // Two hyphens end a comment.
    plain.replace("--", "__")
}
