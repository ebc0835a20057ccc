//! The rig file of an imported machine.

use std::fmt::Write as _;
use std::path::Path;

use upright_design::number::significant;
use upright_design::rig::Rig;

use super::error::ImportError;
use super::hinges::Machine;
use crate::simulator_model::UNLIMITED;

/// Digits of a number from the file; more than any URDF has.
const DIGITS: usize = 9;

pub(super) fn rig_text(name: &str, file: &str, machine: &Machine<'_>) -> Result<String, ImportError> {
    let number = |x: f64| significant(x, DIGITS);
    let slide = machine.slide;
    let mut text = format!(
        "# From {file}. What a URDF does not have is marked \"missing\": look it up, measure it, or choose it.\nname = {name:?}\n\n\
         [cart] # joint {:?}\nmass_kg = {}\nfriction_n_s_per_m = {}\n",
        slide.name,
        number(machine.cart_kg),
        number(slide.friction[0])
    );
    match slide.ends {
        Some([low, high]) if low < 0.0 && high > 0.0 => {
            text += &format!("travel_m = [{}, {}]\n", number(low), number(high));
        }
        _ => text += "# travel_m = [-0.5, 0.5] # missing: ends of the rail around the start\n",
    }
    text += "# encoder_step_m = 2e-5 # missing: travel per count\n";
    for link in &machine.links {
        let length = match link.length_m {
            Some(length_m) => number(length_m),
            None => format!(
                "{} # missing: to the tip; twice the distance of the centre of mass",
                number(2.0 * link.centre_m)
            ),
        };
        let _ = write!(
            text,
            "\n[[link]] # joint {:?}\nmass_kg = {}\nlength_m = {length}\ncentre_of_mass_m = {}\ninertia_kg_m2 = {}\n\
             friction_n_m_s_per_rad = {}\n# encoder_counts_per_rev = 4096 # missing\n",
            link.hinge.name,
            number(link.mass_kg),
            number(link.centre_m),
            number(link.inertia_kg_m2),
            number(link.hinge.friction[0])
        );
    }
    let [effort, speed] = slide.most.map(|most| if most < UNLIMITED { most } else { 0.0 });
    text += "\n[actuator] # missing: the motor\n";
    text += &match effort > 0.0 {
        true => format!("force_limit_n = {}\n", number(effort)),
        false => "# force_limit_n = 10 # missing\n".to_owned(),
    };
    if speed > 0.0 {
        text += &format!("\n[limits]\nspeed_m_per_s = {}\n", number(speed));
    }
    let weights = vec!["1"; 2 * (1 + machine.links.len())].join(", ");
    let _ = write!(text, "\n[lqr] # missing: your weights\nstate_weights = [{weights}]\nforce_weight = 1\n");
    text += &reality(machine);
    Rig::from_toml(&text, Path::new(file))?;
    Ok(text)
}

/// Dry friction, which changes no gain.
fn reality(machine: &Machine<'_>) -> String {
    let joints: Vec<f64> = machine.links.iter().map(|link| link.hinge.friction[1]).collect();
    let cart = machine.slide.friction[1];
    let mut text = String::new();
    if cart > 0.0 {
        text += &format!("cart_friction_n = {}\n", significant(cart, DIGITS));
    }
    if joints.iter().any(|&friction| friction > 0.0) {
        let joints: Vec<String> = joints.iter().map(|&friction| significant(friction, DIGITS)).collect();
        text += &format!("joint_friction_n_m = [{}]\n", joints.join(", "));
    }
    if text.is_empty() { text } else { format!("\n[reality]\n{text}") }
}
