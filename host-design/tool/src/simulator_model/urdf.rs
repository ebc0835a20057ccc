//! The machine as a URDF (<http://wiki.ros.org/urdf/XML>), which [`import`](crate::import) reads again.

use std::fmt::Write as _;

use upright_design::rig::Rig;

use super::machine::{NoModel, TIP, UNLIMITED, facts, inertia_kg_m2, machine, plain};

/// The key of `[reality]` that the file has beside those of the chain.
const CARRIED: &[&str] = &["cart_friction_n"];

/// The bodies and joints of `rig` as a URDF. It has no motor, sensors and gravity; a comment names their numbers.
///
/// # Errors
/// [`NoModel`] for a rig that is given by matrices, or whose cart has no mass.
pub fn urdf(rig: &Rig) -> Result<String, NoModel> {
    let chain = machine(rig)?;
    let (cart, friction) = (&chain.cart, &rig.reality.friction);
    let cart_kg = cart.mass_kg.ok_or(NoModel::NoCartMass)?;
    let most_n = rig.actuator.largest_force_n().unwrap_or(UNLIMITED);
    let most_m_per_s = rig.limits.speed_m_per_s.unwrap_or(UNLIMITED);
    let name = plain(&rig.name);
    let mut out = format!(
        "<?xml version=\"1.0\"?>\n<!--\n  The machine of the rig \"{name}\", written by \"upright export\".\n{}-->\n\
         <robot name=\"{}\">\n  <link name=\"rail\"/>\n",
        facts(rig, CARRIED),
        rig.name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;"),
    );
    let [low, high] = cart.travel_m;
    body(&mut out, "cart", 0.0, cart_kg, cart_kg);
    let limit =
        format!("<limit lower=\"{low}\" upper=\"{high}\" effort=\"{most_n}\" velocity=\"{most_m_per_s}\"/>");
    let loss = [cart.friction_n_s_per_m, friction.cart_friction_n];
    joint(
        &mut out,
        "slide\" type=\"prismatic",
        ["rail", "cart"],
        0.0,
        &format!("<axis xyz=\"1 0 0\"/>{limit}"),
        loss,
    );
    let (mut below, mut from_m) = ("cart".to_owned(), 0.0);
    for (index, link) in chain.links.iter().enumerate() {
        let this = format!("link_{}", index + 1);
        body(&mut out, &this, link.centre_m(), link.mass_kg, inertia_kg_m2(link));
        let loss = [link.friction_n_m_s_per_rad, friction.joint_friction_n_m.of_joint(index)];
        let hinge = format!("hinge_{}\" type=\"continuous", index + 1);
        joint(&mut out, &hinge, [&below, &this], from_m, "<axis xyz=\"0 -1 0\"/>", loss);
        (below, from_m) = (this, link.length_m);
    }
    let _ = write!(
        out,
        "  <link name=\"{TIP}\"/>\n  <joint name=\"end\" type=\"fixed\">\n    <parent link=\"{below}\"/><child \
         link=\"{TIP}\"/><origin xyz=\"0 0 {from_m}\"/>\n  </joint>\n</robot>\n"
    );
    Ok(out)
}

/// A body whose inertia (kg·m²) is the same about each axis: only the one of the hinges counts.
fn body(out: &mut String, name: &str, centre_m: f64, mass_kg: f64, inertia: f64) {
    let _ = write!(
        out,
        "  <link name=\"{name}\">\n    <inertial><origin xyz=\"0 0 {centre_m}\"/><mass value=\"{mass_kg}\"/><inertia \
         ixx=\"{inertia}\" iyy=\"{inertia}\" izz=\"{inertia}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>\n  </link>\n"
    );
}

/// A joint with viscous and dry friction, `from_m` above the joint of its parent.
fn joint(out: &mut String, name: &str, [parent, child]: [&str; 2], from_m: f64, axis: &str, loss: [f64; 2]) {
    let [damping, friction] = loss;
    let _ = write!(
        out,
        "  <joint name=\"{name}\">\n    <parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"0 0 \
         {from_m}\"/>\n    {axis}<dynamics damping=\"{damping}\" friction=\"{friction}\"/>\n  </joint>\n"
    );
}
