//! The rig file with the identified numbers.

use std::path::Path;

use upright_design::identify::{Identification, Realised};
use upright_design::number::rounded;
use upright_design::rig::{Actuator, Rig, RigError, with_value};

/// Why there is no rig file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotWritten {
    /// A key of the old file cannot be changed.
    #[error("{0}: write it on a line of its own, as `key = value`, then it can be changed")]
    Key(String),
    /// The new text is not a valid rig file.
    #[error(transparent)]
    Rig(#[from] RigError),
}

/// Errors of masses and lengths in `[reality]`. The identified numbers include them, so they are set to 0.
const WITHIN: [&str; 5] = [
    "cart_mass_percent",
    "link_mass_percent",
    "link_length_percent",
    "link_inertia_percent",
    "parameter_spread_percent",
];

/// The text of `old` with the identified numbers, with comments and layout as they were, and `note` as first line.
///
/// # Errors
/// [`NotWritten`] if a key cannot be changed or the result would not be a valid rig file.
pub fn rig_file(
    old: &str,
    rig: &Rig,
    found: &Identification,
    note: &str,
    file: &Path,
) -> Result<String, NotWritten> {
    let mut text = old.to_owned();
    let mut set = |key: &str, value: String| {
        let changed = with_value(&text, key, &value).ok_or_else(|| NotWritten::Key(key.to_owned()))?;
        text = changed.text;
        Ok::<(), NotWritten>(())
    };
    if let Some(realised) = &found.realised {
        for (key, value) in values(realised, &rig.actuator) {
            set(&key, value)?;
        }
    }
    if let Some(delay) = found.other_delay() {
        set("tick.delay_ticks", delay.to_string())?;
    }
    for key in WITHIN {
        let is_given = old.lines().any(|line| line.trim_start().starts_with(key));
        if is_given {
            set(&format!("reality.{key}"), "0".to_owned())?;
        }
    }
    let text = format!("# {note}\n{text}");
    Rig::from_toml(&text, file)?;
    Ok(text)
}

/// Keys and values, with six digits: more than the identification knows.
fn values(realised: &Realised, actuator: &Actuator) -> Vec<(String, String)> {
    let number = |value: f64| rounded(value, 6).to_string();
    let mut values = vec![
        ("cart.mass_kg".to_owned(), number(realised.cart_kg)),
        ("cart.friction_n_s_per_m".to_owned(), number(realised.cart_viscous)),
        ("reality.cart_friction_n".to_owned(), number(realised.cart_dry_n)),
        ("reality.rail_tilt_rad".to_owned(), number(realised.tilt_rad)),
    ];
    for (index, link) in realised.links.iter().enumerate() {
        let key = |name: &str| format!("link[{}].{name}", index + 1);
        values.extend([
            (key("mass_kg"), number(link.mass_kg)),
            (key("length_m"), number(link.length_m)),
            (key("centre_of_mass_m"), number(link.centre_m)),
            (key("inertia_kg_m2"), number(link.inertia_kg_m2)),
            (key("friction_n_m_s_per_rad"), number(link.viscous)),
        ]);
    }
    let dry: Vec<String> = realised.links.iter().map(|link| number(link.dry_n_m)).collect();
    values.push(("reality.joint_friction_n_m".to_owned(), format!("[{}]", dry.join(", "))));
    if let Some(motor) = &actuator.motor {
        values.push(("actuator.dead_zone_v".to_owned(), number(realised.dead_zone_v)));
        let resistance = motor.resistance_ohm * realised.resistance_factor;
        if realised.resistance_factor != 1.0 {
            values.push(("actuator.resistance_ohm".to_owned(), number(resistance)));
        }
    }
    values
}
