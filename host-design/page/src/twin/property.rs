//! What is true of the simulated machine but not known to the controller.

use serde::Serialize;
use serde_json::{Value, json};
use upright_design::rig::{Base, Imperfection, Reality, Rig};
use upright_design::simulate::Disturbance;

/// A property that can be changed while the rig runs.
#[derive(Debug, Clone, Copy, Serialize)]
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
    #[serde(skip)]
    changed: Changed,
    /// Whether it changes how the machine of a rig moves.
    #[serde(skip)]
    acts: fn(&Rig) -> bool,
    /// Unit and range on an arm, if not the same.
    #[serde(skip)]
    on_arm: Option<(&'static str, [f64; 3])>,
}

/// What a property changes.
#[derive(Debug, Clone, Copy)]
enum Changed {
    /// The machine as it truly is.
    Reality(fn(&mut Reality, f64)),
    /// Something else of the rig as it truly is.
    Rig(fn(&mut Rig, f64)),
    /// The disturbances of the simulated machine.
    Disturbance,
    /// What goes to the machine and comes from it.
    Signals,
}

/// Name of the noise of the force (N rms).
pub(crate) const FORCE_NOISE: &str = "force-noise";
/// Name of the factor by which the encoders are coarser.
pub(crate) const COARSENESS: &str = "coarseness";
/// Name of the additional delay (ticks).
pub(crate) const DELAY: &str = "delay";

const fn property(
    name: &'static str,
    label: &'static str,
    unit: &'static str,
    [low, high, step]: [f64; 3],
    changed: Changed,
    acts: fn(&Rig) -> bool,
) -> Property {
    Property { name, label, unit, low, high, step, nominal: 0.0, changed, acts, on_arm: None }
}

const fn otherwise_on_arm(property: Property, unit: &'static str, range: [f64; 3]) -> Property {
    Property { on_arm: Some((unit, range)), ..property }
}

/// The properties that are no rows of [`IMPERFECTIONS`].
const OTHERS: [Property; 9] = {
    const PERCENT: [f64; 3] = [-50.0, 100.0, 1.0];
    let mass = Changed::Reality(|reality, more| {
        let each = &mut reality.parameters.link_mass_percent;
        *each = each.plus(more);
    });
    let cart_mass = Changed::Reality(|reality, more| reality.parameters.cart_mass_percent += more);
    let drag = Changed::Reality(|reality, more| {
        let each = &mut reality.air_drag.air_drag_n_m_s2_per_rad2;
        *each = each.plus(1e-3 * more);
    });
    let joint_viscous = Changed::Rig(|rig, more| {
        let links = rig.chain_mut().into_iter().flat_map(|chain| &mut chain.links);
        links.for_each(|link| link.friction_n_m_s_per_rad += 1e-3 * more);
    });
    let cart_viscous = Changed::Rig(|rig, more| {
        rig.chain_mut().into_iter().for_each(|chain| chain.cart.friction_n_s_per_m += more);
    });
    let jitter =
        Changed::Rig(|rig, percent| rig.reality.driver.jitter_s += 0.01 * percent * rig.tick.period_s);
    let (coarse, small) = ([1.0, 32.0, 1.0], [0.0, 1.0, 0.01]);
    [
        property("mass", "masses of the links", "% more", PERCENT, mass, always),
        property("cart-mass", "mass of the cart", "% more", PERCENT, cart_mass, feels_forces),
        property(
            "joint-viscous",
            "viscous friction in each joint",
            "mN·m·s/rad more",
            small,
            joint_viscous,
            always,
        ),
        property("air-drag", "air drag of each link", "mN·m·s²/rad² more", [0.0, 1.0, 0.001], drag, always),
        otherwise_on_arm(
            property(
                "cart-viscous",
                "viscous friction of the cart",
                "N·s/m more",
                [0.0, 10.0, 0.1],
                cart_viscous,
                feels_forces,
            ),
            "N·m·s/rad more",
            [0.0, 0.02, 1e-4],
        ),
        otherwise_on_arm(
            property(
                FORCE_NOISE,
                "force noise",
                "N rms",
                [0.0, 2.0, 0.01],
                Changed::Disturbance,
                feels_forces,
            ),
            "N·m rms",
            [0.0, 0.2, 1e-3],
        ),
        property("jitter", "jitter of the tick", "% of a tick", [0.0, 40.0, 1.0], jitter, imposes_force),
        Property {
            nominal: 1.0,
            ..property(COARSENESS, "coarser encoders", "times", coarse, Changed::Signals, always)
        },
        property(DELAY, "more delay", "ticks", [0.0, 100.0, 1.0], Changed::Signals, imposes_force),
    ]
};

fn always(_: &Rig) -> bool {
    true
}

fn imposes_force(rig: &Rig) -> bool {
    rig.actuator.input().is_force()
}

/// The cart of a drive that takes pulses goes where they say; forces on it matter only if `[reality]` has the motor.
fn feels_forces(rig: &Rig) -> bool {
    imposes_force(rig) || rig.reality.step_motor.holding_force_n.is_some()
}

/// The slider of an imperfection; none if it has none, or is not simulated on `rig`.
fn of_imperfection(imperfection: &Imperfection, rig: &Rig) -> Option<Property> {
    let slider = imperfection.slider.filter(|_| imperfection.not_on(rig).is_none())?;
    Some(property(slider.name, slider.label, slider.unit, slider.range, Changed::Reality(slider.add), always))
}

/// The properties of a machine, and their current values.
#[derive(Debug, Clone)]
pub struct Properties {
    base: Base,
    all: Vec<Property>,
    values: Vec<f64>,
}

impl Properties {
    /// The properties of `rig` as designed for, with the disturbances that its file expects.
    pub fn of(rig: &Rig) -> Self {
        let others = OTHERS.into_iter().filter(|property| (property.acts)(rig));
        let imperfections = Imperfection::of_base(rig.base())
            .iter()
            .filter_map(|imperfection| of_imperfection(imperfection, rig));
        let mut all: Vec<Property> = others.chain(imperfections).collect();
        for property in all.iter_mut().filter(|property| property.name == FORCE_NOISE) {
            property.nominal = Disturbance::of(rig).force_n;
        }
        if !rig.base().is_cart() {
            for property in &mut all {
                if let Some((unit, [low, high, step])) = property.on_arm {
                    *property = Property { unit, low, high, step, ..*property };
                }
            }
        }
        Self { base: rig.base(), values: all.iter().map(|property| property.nominal).collect(), all }
    }

    /// All properties, as the page is told.
    pub(crate) fn described(&self) -> Vec<Value> {
        let told = |property: &Property| {
            let mut told = json!(property);
            told["label"] = json!(self.base.words(property.label));
            told
        };
        self.all.iter().map(told).collect()
    }

    /// Sets a property, within its range. Returns whether the machine has to be built again; `None` if there is no
    /// such property.
    pub(crate) fn set(&mut self, name: &str, value: f64) -> Option<bool> {
        let index = self.all.iter().position(|property| property.name == name)?;
        let Property { low, high, changed, .. } = self.all[index];
        self.values[index] = value.clamp(low, high);
        Some(!matches!(changed, Changed::Signals))
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
        for (property, &value) in self.all.iter().zip(&self.values) {
            match property.changed {
                Changed::Reality(add) => add(&mut rig.reality, value),
                Changed::Rig(apply) => apply(&mut rig, value),
                Changed::Disturbance | Changed::Signals => {}
            }
        }
        rig
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn every_slider_of_an_imperfection_adds_to_it_and_to_nothing_else() {
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
        let rig = Rig::from_path(&rigs.join("quadruple-paper.toml")).unwrap();
        let mut number = 0;
        for imperfection in Imperfection::of_base(rig.base()) {
            let Some(slider) = imperfection.slider else { continue };
            let mut properties = Properties::of(&rig);
            assert_eq!(properties.applied_to(&rig), rig, "negative control");
            let [_, high, _] = slider.range;
            assert_eq!(properties.set(slider.name, 2.0 * high), Some(true), "the machine is built again");
            let mut with = rig.clone();
            (slider.add)(&mut with.reality, high);
            assert!(with != rig && properties.applied_to(&rig) == with, "{}", imperfection.key);
            // What is added is what a machine with this imperfection alone has.
            (imperfection.set)(&mut with.reality, 0.0);
            assert_eq!(with.reality, rig.reality, "{}", imperfection.key);
            let same = properties.described().into_iter().filter(|property| property["name"] == slider.name);
            assert_eq!(same.count(), 1, "{}", slider.name);
            number += 1;
        }
        assert_eq!(number, 4);
    }

    #[test]
    fn a_cart_that_goes_where_its_pulses_say_has_no_slider_for_a_force_on_it() {
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
        let names = |rig: &str| -> Vec<&str> {
            let rig = Rig::from_path(&rigs.join(rig)).unwrap();
            Properties::of(&rig).all().map(|(name, _)| name).collect()
        };
        assert_eq!(names("quadruple-paper.toml").len(), 13);
        let all = ["mass", "joint-viscous", "air-drag", "coarseness", "joint-dry", "tilt"];
        assert_eq!(names("single-stepper.toml"), all);
    }
}
