//! What is true of the simulated machine but not known to the controller.

use serde::Serialize;
use upright_design::rig::{PlantDescription, Rig};
use upright_design::verify::Disturbance;

/// A property that can be changed while the rig runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Property {
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
    /// Whether the machine has to be built again for it.
    #[serde(skip)]
    rebuilds: bool,
}

/// All properties of a machine as designed for, in the order of the page.
const PROPERTIES: [Property; 8] = {
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
        property("joint-friction", "viscous friction in each joint", "µN·m·s/rad more", [0.0, 500.0, 1.0]),
        property("cart-friction", "viscous friction of the cart", "N·s/m more", [0.0, 10.0, 0.1]),
        property("force-noise", "force noise", "N rms", [0.0, 2.0, 0.01]),
        Property {
            rebuilds: false,
            nominal: 1.0,
            ..property("coarseness", "coarser encoders", "times", [1.0, 32.0, 1.0])
        },
        Property { rebuilds: false, ..property("delay", "more delay", "ticks", [0.0, 100.0, 1.0]) },
        Property {
            rebuilds: false,
            nominal: 100.0,
            ..property("force", "force of the motor", "%", [0.0, 100.0, 1.0])
        },
    ]
};

/// The properties of a machine, and their values of now.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Properties {
    all: [Property; PROPERTIES.len()],
    values: [f64; PROPERTIES.len()],
}

impl Properties {
    /// The properties of `rig` as designed for, with the disturbances that its file expects.
    pub(super) fn of(rig: &Rig) -> Self {
        let mut all = PROPERTIES;
        for property in &mut all {
            if property.name == "force-noise" {
                property.nominal = Disturbance::of(rig).force_n;
            }
        }
        Self { values: all.map(|property| property.nominal), all }
    }

    /// What there is to change.
    pub(super) fn described(&self) -> &[Property] {
        &self.all
    }

    /// Sets a property, within its range. Gives whether the machine has to be built again; none if there is no such
    /// property.
    pub(super) fn set(&mut self, name: &str, value: f64) -> Option<bool> {
        let index = self.all.iter().position(|property| property.name == name)?;
        let Property { low, high, rebuilds, .. } = self.all[index];
        self.values[index] = value.clamp(low, high);
        Some(rebuilds)
    }

    /// Value of a property.
    pub(super) fn get(&self, name: &str) -> f64 {
        self.all.iter().position(|property| property.name == name).map_or(0.0, |index| self.values[index])
    }

    /// Names and values.
    pub(super) fn all(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.all.iter().map(|property| property.name).zip(self.values)
    }

    /// The rig as it truly is.
    pub(super) fn applied_to(&self, rig: &Rig) -> Rig {
        let mut rig = rig.clone();
        if let PlantDescription::Chain(chain) = &mut rig.plant {
            let links = 1.0 + 0.01 * self.get("mass");
            chain.cart.mass_kg *= 1.0 + 0.01 * self.get("cart-mass");
            chain.cart.friction_n_s_per_m += self.get("cart-friction");
            for link in &mut chain.links {
                link.mass_kg *= links;
                // A given inertia follows the mass, as that of a rod does.
                link.inertia_kg_m2 = link.inertia_kg_m2.map(|inertia| inertia * links);
                link.friction_n_m_s_per_rad += 1e-6 * self.get("joint-friction");
            }
        }
        rig
    }
}
