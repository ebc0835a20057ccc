//! What carries the links: a cart on a rail, or an arm.

use serde::Serialize;

use super::key::{Absent, Key, Section};
use super::quantity::Quantity;

/// What carries the links: a cart on a rail, or an arm that turns about a vertical axis.
///
/// The code names the quantities of the base and their units after the cart. An arm moves by an angle, so that its
/// quantities are in rad, N·m and kg·m² in the places of m, N and kg; the file, and all that is printed, names them so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum Base {
    /// A cart on a straight rail.
    #[default]
    Cart,
    /// An arm.
    Arm,
}

/// A key that a file with an arm gives another name, or does not have.
struct OnArm {
    section: &'static str,
    /// Its name in a file with a cart; none if only an arm has it.
    cart: Option<&'static str>,
    /// Name and unit in a file with an arm; none if only a cart has it.
    arm: Option<[&'static str; 2]>,
    /// What applies on an arm without the key, if not the same.
    absent: Option<Absent>,
}

const fn renamed(section: &'static str, cart: &'static str, arm: &'static str, unit: &'static str) -> OnArm {
    OnArm { section, cart: Some(cart), arm: Some([arm, unit]), absent: None }
}

const fn with_default(row: OnArm, absent: Absent) -> OnArm {
    OnArm { absent: Some(absent), ..row }
}

const fn cart_only(section: &'static str, cart: &'static str, absent: Absent) -> OnArm {
    OnArm { section, cart: Some(cart), arm: None, absent: Some(absent) }
}

const fn arm_only(section: &'static str, arm: &'static str) -> OnArm {
    OnArm { section, cart: None, arm: Some([arm, ""]), absent: None }
}

/// Every key that depends on the base.
static ON_ARM: &[OnArm] = &[
    renamed("", "cart", "arm", ""),
    arm_only("cart", "radius_m"),
    arm_only("cart", "encoder_counts_per_rev"),
    renamed("cart", "mass_kg", "inertia_kg_m2", "kg·m²"),
    renamed("cart", "friction_n_s_per_m", "friction_n_m_s_per_rad", "N·m·s/rad"),
    renamed("cart", "travel_m", "travel_rad", "rad"),
    renamed("cart", "encoder_step_m", "encoder_step_rad", "rad"),
    renamed("cart", "sensor_noise_m", "sensor_noise_rad", "rad"),
    arm_only("link", "radius_m"),
    arm_only("link", "axial_inertia_kg_m2"),
    renamed("actuator", "force_limit_n", "torque_limit_n_m", "N·m"),
    cart_only("actuator", "pulley_radius_m", Absent::Numbers(&[1.0])),
    renamed("actuator", "acceleration_limit_m_per_s2", "acceleration_limit_rad_per_s2", "rad/s²"),
    renamed("actuator", "step_m", "step_rad", "rad"),
    renamed("actuator", "speed_limit_m_per_s", "speed_limit_rad_per_s", "rad/s"),
    renamed("lqr", "force_weight", "torque_weight", ""),
    renamed("kalman", "force_noise_n2_s", "torque_noise_n2_m2_s", "N²·m²·s"),
    renamed("kalman", "acceleration_noise_m2_per_s3", "acceleration_noise_rad2_per_s3", "rad²/s³"),
    renamed("friction", "cart_n", "arm_n_m", "N·m"),
    with_default(
        renamed("friction", "cart_speed_m_per_s", "arm_speed_rad_per_s", "rad/s"),
        Absent::Numbers(&[0.05]),
    ),
    renamed("limits", "speed_m_per_s", "speed_rad_per_s", "rad/s"),
    renamed("limits", "rail_margin_m", "travel_margin_rad", "rad"),
    renamed("limits", "travel_tolerance_m", "travel_tolerance_rad", "rad"),
    renamed("limits", "jog_force_n", "jog_torque_n_m", "N·m"),
    renamed("limits", "arm_speed_m_per_s", "arm_speed_rad_per_s", "rad/s"),
    renamed("verify", "force_rms_n", "arm_torque_rms_n_m", "N·m"),
    renamed("verify", "cart_friction_n", "arm_friction_n_m", "N·m"),
    renamed("verify", "backlash_m", "backlash_rad", "rad"),
    renamed("verify", "belt_compliance_m_per_n", "gear_compliance_rad_per_n_m", "rad/(N·m)"),
    renamed("verify", "force_percent", "torque_percent", "%"),
    cart_only("verify", "rail_tilt_rad", Absent::Follows("not required")),
    renamed("reality", "cart_friction_n", "arm_friction_n_m", "N·m"),
    with_default(
        renamed("reality", "stribeck_m_per_s", "arm_stribeck_rad_per_s", "rad/s"),
        Absent::Numbers(&[0.1]),
    ),
    with_default(renamed("reality", "presliding_m", "arm_presliding_rad", "rad"), Absent::Numbers(&[0.001])),
    renamed("reality", "backlash_m", "backlash_rad", "rad"),
    renamed("reality", "belt_compliance_m_per_n", "gear_compliance_rad_per_n_m", "rad/(N·m)"),
    renamed("reality", "rotor_mass_kg", "rotor_inertia_kg_m2", "kg·m²"),
    renamed("reality", "force_percent", "torque_percent", "%"),
    renamed("reality", "holding_force_n", "holding_torque_n_m", "N·m"),
    renamed("reality", "full_step_m", "full_step_rad", "rad"),
    renamed("reality", "corner_speed_m_per_s", "corner_speed_rad_per_s", "rad/s"),
    renamed("reality", "cart_mass_percent", "arm_inertia_percent", "%"),
    cart_only("reality", "rail_tilt_rad", Absent::Numbers(&[0.0])),
    renamed("robust", "cart_friction_n", "arm_friction_n_m", "N·m"),
    renamed("swing_up", "force_n", "torque_n_m", "N·m"),
    renamed("swing_up", "acceleration_m_per_s2", "acceleration_rad_per_s2", "rad/s²"),
    renamed("swing_up", "speed_m_per_s", "speed_rad_per_s", "rad/s"),
    renamed("swing_up", "rail_m", "travel_rad", "rad"),
];

/// Words of messages that depend on the base, besides the keys: those of a cart, and of an arm.
const WORDS: &[[&str; 2]] = &[
    ["mass_kg of [cart]", "inertia_kg_m2 of [arm]"],
    ["[cart]", "[arm]"],
    ["cart.mass_kg", "arm.inertia_kg_m2"],
    ["mass of the cart", "moment of inertia of the arm about its axis"],
    ["cart", "arm"],
    ["Cart", "Arm"],
    ["rail", "travel"],
    ["largest force", "largest torque"],
    ["equivalent mass", "moment of inertia"],
    ["equal masses", "equal inertias"],
    ["force on the", "torque on the"],
    ["in m:", "in rad:"],
    ["(m),", "(rad),"],
    ["pulley", "arm"],
];

impl Base {
    /// That of a rig file.
    pub(super) fn of(document: &toml_edit::Table) -> Self {
        if document.contains_key("arm") { Self::Arm } else { Self::Cart }
    }

    /// Whether it is a cart.
    pub fn is_cart(&self) -> bool {
        *self == Self::Cart
    }

    /// The row of the key that a file with a cart calls `name`.
    pub(crate) fn key(self, section: &'static Section, name: &str) -> Key {
        let key = *section.key(name);
        let row = ON_ARM.iter().find(|row| row.section == section.name && row.cart == Some(name));
        match (self, row) {
            (Self::Arm, Some(row)) => Key {
                name: row.arm.map_or(key.name, |[name, _]| name),
                unit: row.arm.map_or(key.unit, |[_, unit]| unit),
                absent: row.absent.unwrap_or(key.absent),
                ..key
            },
            _ => key,
        }
    }

    /// Whether a file with this base has the key that one with a cart calls `name`.
    pub(crate) fn has(self, section: &Section, name: &str) -> bool {
        let rows = || ON_ARM.iter().filter(|row| row.section == section.name);
        match self {
            Self::Cart => !rows().any(|row| row.cart.is_none() && row.arm.is_some_and(|arm| arm[0] == name)),
            Self::Arm => !rows().any(|row| row.cart == Some(name) && row.arm.is_none()),
        }
    }

    /// The name, in a file with this base, of the key or section that one with a cart calls `name`.
    pub fn name<'n>(self, section: &str, name: &'n str) -> &'n str {
        let row = ON_ARM.iter().find(|row| row.section == section && row.cart == Some(name));
        match (self, row.and_then(|row| row.arm)) {
            (Self::Arm, Some([arm, _])) => arm,
            _ => name,
        }
    }

    /// A path such as `cart.mass_kg` or `limits.speed_m_per_s`, as a file with this base has it.
    pub fn path(self, path: &str) -> String {
        match path.split_once('.') {
            Some((section, key)) => format!("{}.{}", self.name("", section), self.name(section, key)),
            None => self.name("", path).to_owned(),
        }
    }

    /// A text about a cart, for this base.
    pub fn words(self, text: &str) -> String {
        if self.is_cart() {
            return text.to_owned();
        }
        let keys = ON_ARM.iter().filter(|row| !row.section.is_empty());
        let keys = keys.filter_map(|row| Some([row.cart?, row.arm?[0]]));
        // A link has a mass_kg, too.
        let keys = keys.filter(|[cart, _]| *cart != "mass_kg");
        let words = WORDS.iter().copied().chain(keys);
        words.fold(text.to_owned(), |text, [cart, arm]| replace_words(&text, cart, arm))
    }

    /// Its position.
    pub fn position(self) -> Quantity {
        self.quantities().position
    }

    /// Its speed.
    pub fn speed(self) -> Quantity {
        self.quantities().speed
    }

    /// What a motor does to it.
    pub fn force(self) -> Quantity {
        self.quantities().force
    }

    /// Its acceleration.
    pub fn acceleration(self) -> Quantity {
        self.quantities().acceleration
    }

    /// What resists its acceleration.
    pub fn mass(self) -> Quantity {
        self.quantities().mass
    }

    /// What resists its speed.
    pub fn damping(self) -> Quantity {
        self.quantities().damping
    }

    /// What it is called.
    pub fn noun(self) -> &'static str {
        self.quantities().noun
    }

    fn quantities(self) -> &'static Quantities {
        match self {
            Self::Cart => &OF_CART,
            Self::Arm => &OF_ARM,
        }
    }
}

/// A base's name and its quantities.
struct Quantities {
    noun: &'static str,
    position: Quantity,
    speed: Quantity,
    acceleration: Quantity,
    force: Quantity,
    mass: Quantity,
    damping: Quantity,
}

static OF_CART: Quantities = Quantities {
    noun: "cart",
    position: Quantity { name: "position", unit: "m" },
    speed: Quantity { name: "speed", unit: "m/s" },
    acceleration: Quantity { name: "acceleration", unit: "m/s²" },
    force: Quantity { name: "force", unit: "N" },
    mass: Quantity { name: "mass", unit: "kg" },
    damping: Quantity { name: "viscous friction", unit: "N·s/m" },
};

static OF_ARM: Quantities = Quantities {
    noun: "arm",
    position: Quantity { name: "arm angle", unit: "rad" },
    speed: Quantity { name: "arm speed", unit: "rad/s" },
    acceleration: Quantity { name: "acceleration", unit: "rad/s²" },
    force: Quantity { name: "torque", unit: "N·m" },
    mass: Quantity { name: "inertia", unit: "kg·m²" },
    damping: Quantity { name: "viscous friction", unit: "N·m·s/rad" },
};

/// `text` with `to` in the places where `from` stands as a word of its own.
fn replace_words(text: &str, from: &str, to: &str) -> String {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let (mut replaced, mut rest) = (String::with_capacity(text.len()), text);
    let [first, last] = [from.starts_with(is_part), from.ends_with(is_part)];
    while let Some(start) = rest.find(from) {
        let (before, after) = (&rest[..start], &rest[start + from.len()..]);
        let is_word = !(first && before.ends_with(is_part) || last && after.starts_with(is_part));
        replaced.push_str(before);
        replaced.push_str(if is_word { to } else { from });
        rest = after;
    }
    replaced + rest
}

#[cfg(test)]
mod tests {
    use super::super::key::unit_in_names;
    use super::super::sections::{SECTIONS, TOP};
    use super::*;

    const ARM: Base = Base::Arm;

    #[test]
    fn every_row_is_that_of_a_key_whose_name_ends_in_its_unit() {
        for row in ON_ARM.iter().filter(|row| !row.section.is_empty()) {
            let section = SECTIONS.into_iter().find(|section| section.name == row.section).unwrap();
            let names: Vec<_> = section.keys().map(|key| key.name).collect();
            let own = row.cart.or(row.arm.map(|[name, _]| name)).unwrap();
            assert!(names.contains(&own), "{} {own}", row.section);
            if let (Some(_), Some([name, unit])) = (row.cart, row.arm) {
                assert!(name.ends_with(&unit_in_names(unit)), "{name} {unit}");
                assert!(!names.contains(&name), "{} has {name} twice", row.section);
            }
        }
        assert!(ON_ARM.iter().any(|row| row.section == TOP.name && row.cart == Some("cart")));
    }

    /// A key whose unit is that of a cart's quantity has a row, or an arm would be told metres.
    #[test]
    fn no_key_of_the_base_is_forgotten() {
        let of_base = ["m/s", "m/s²", "N", "N·s/m", "m/N", "N²·s", "m²/s³"];
        for section in SECTIONS {
            for key in section.keys().filter(|key| of_base.contains(&key.unit)) {
                // Gravity is not a quantity of the base.
                if section.name == "gravity" {
                    continue;
                }
                let known =
                    ON_ARM.iter().any(|row| row.section == section.name && row.cart == Some(key.name));
                assert!(known, "{} {}", section.title, key.name);
            }
        }
    }

    #[test]
    fn words_are_replaced_whole() {
        let text =
            "give speed_m_per_s of [limits], not arm_speed_m_per_s, or mass_kg of [cart]: the cart, carts";
        assert_eq!(
            ARM.words(text),
            "give speed_rad_per_s of [limits], not arm_speed_rad_per_s, or inertia_kg_m2 of [arm]: the arm, carts"
        );
        assert_eq!(Base::Cart.words(text), text);
        assert_eq!(ARM.path("cart.mass_kg"), "arm.inertia_kg_m2");
        assert_eq!(ARM.path("link[1].mass_kg"), "link[1].mass_kg");
    }
}
