//! What is true of the simulated machine but not known to the controller.

use serde::Serialize;
use upright_design::rig::Rig;
use upright_design::simulate::Disturbance;

/// A property that can be changed while the rig runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Property {
    /// Name in messages.
    name: &'static str,
    /// Name on the page.
    label: &'static str,
    unit: &'static str,
    low: f64,
    high: f64,
    step: f64,
    /// Value of the machine as designed for.
    nominal: f64,
    /// Whether the simulated machine has to be built again after a change.
    #[serde(skip)]
    rebuilds: bool,
}

/// All properties of a machine as designed for, in the order of the page.
const PROPERTIES: [Property; 13] = {
    const fn property(
        name: &'static str,
        label: &'static str,
        unit: &'static str,
        range: [f64; 3],
    ) -> Property {
        let [low, high, step] = range;
        Property { name, label, unit, low, high, step, nominal: 0.0, rebuilds: true }
    }
    [
        property("mass", "masses of the links", "% more", [-50.0, 100.0, 1.0]),
        property("cart-mass", "mass of the cart", "% more", [-50.0, 100.0, 1.0]),
        property("joint-dry", "dry friction in each joint", "mN·m more", [0.0, 20.0, 0.01]),
        property("cart-dry", "dry friction of the cart", "N more", [0.0, 5.0, 0.05]),
        property("joint-viscous", "viscous friction in each joint", "mN·m·s/rad more", [0.0, 1.0, 0.01]),
        property("air-drag", "air drag of each link", "mN·m·s²/rad² more", [0.0, 1.0, 0.001]),
        property("cart-viscous", "viscous friction of the cart", "N·s/m more", [0.0, 10.0, 0.1]),
        property("tilt", "slope of the rail", "°", [-5.0, 5.0, 0.1]),
        property("force-noise", "force noise", "N rms", [0.0, 2.0, 0.01]),
        property("force", "force of the motor", "% more", [-100.0, 100.0, 1.0]),
        property("jitter", "jitter of the tick", "% of a tick", [0.0, 40.0, 1.0]),
        Property {
            rebuilds: false,
            nominal: 1.0,
            ..property("coarseness", "coarser encoders", "times", [1.0, 32.0, 1.0])
        },
        Property { rebuilds: false, ..property("delay", "more delay", "ticks", [0.0, 100.0, 1.0]) },
    ]
};

/// Whether a property changes how `rig` moves. The cart of a drive that takes pulses goes where they say; forces on it
/// matter only if `[reality]` has the motor.
fn acts(name: &str, rig: &Rig) -> bool {
    let takes_pulses = rig.actuator.acceleration.is_some();
    match name {
        "force" | "jitter" | "delay" => !takes_pulses,
        "cart-mass" | "cart-dry" | "cart-viscous" | "force-noise" => {
            !takes_pulses || rig.reality.step_motor.holding_force_n.is_some()
        }
        _ => true,
    }
}

/// The properties of a machine, and their current values.
#[derive(Debug, Clone, PartialEq)]
pub struct Properties {
    all: Vec<Property>,
    values: Vec<f64>,
}

impl Properties {
    /// The properties of `rig` as designed for, with the disturbances that its file expects.
    pub fn of(rig: &Rig) -> Self {
        let mut all: Vec<_> =
            PROPERTIES.iter().copied().filter(|property| acts(property.name, rig)).collect();
        for property in &mut all {
            if property.name == "force-noise" {
                property.nominal = Disturbance::of(rig).force_n;
            }
        }
        Self { values: all.iter().map(|property| property.nominal).collect(), all }
    }

    /// All properties, as the page is told.
    pub(crate) fn described(&self) -> &[Property] {
        &self.all
    }

    /// Sets a property, within its range. Returns whether the machine has to be built again; `None` if there is no
    /// such property.
    pub(crate) fn set(&mut self, name: &str, value: f64) -> Option<bool> {
        let index = self.all.iter().position(|property| property.name == name)?;
        let Property { low, high, rebuilds, .. } = self.all[index];
        self.values[index] = value.clamp(low, high);
        Some(rebuilds)
    }

    /// Current value of a property, in its unit; 0 if there is no such property.
    pub(crate) fn get(&self, name: &str) -> f64 {
        self.all.iter().position(|property| property.name == name).map_or(0.0, |index| self.values[index])
    }

    /// Names and values.
    pub(crate) fn all(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.all.iter().map(|property| property.name).zip(self.values.iter().copied())
    }

    /// The rig as it truly is: its file with these values in `[reality]`, and more viscous friction.
    pub(crate) fn applied_to(&self, rig: &Rig) -> Rig {
        let mut rig = rig.clone();
        let Some(chain) = rig.chain_mut() else { return rig };
        chain.cart.friction_n_s_per_m += self.get("cart-viscous");
        for link in &mut chain.links {
            link.friction_n_m_s_per_rad += 1e-3 * self.get("joint-viscous");
        }
        let reality = &mut rig.reality;
        let parameters = &mut reality.parameters;
        parameters.link_mass_percent = parameters.link_mass_percent.plus(self.get("mass"));
        parameters.cart_mass_percent += self.get("cart-mass");
        let friction = &mut reality.friction;
        friction.joint_friction_n_m = friction.joint_friction_n_m.plus(1e-3 * self.get("joint-dry"));
        friction.cart_friction_n += self.get("cart-dry");
        let drag = &mut reality.air_drag.air_drag_n_m_s2_per_rad2;
        *drag = drag.plus(1e-3 * self.get("air-drag"));
        reality.sensors.rail_tilt_rad += self.get("tilt").to_radians();
        reality.driver.force_percent += self.get("force");
        reality.driver.jitter_s += 0.01 * self.get("jitter") * rig.tick.period_s;
        rig
    }
}
