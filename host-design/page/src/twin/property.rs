//! What is true of the simulated machine but not known to the controller.

use serde::Serialize;
use upright_design::rig::{IMPERFECTIONS, Imperfection, Rig};
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
    change: Changed,
}

/// What a property changes.
#[derive(Debug, Clone, Copy)]
enum Changed {
    /// An imperfection, by this many of its units.
    Imperfection(&'static Imperfection, f64),
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

impl Property {
    fn new(
        name: &'static str,
        label: &'static str,
        unit: &'static str,
        [low, high, step]: [f64; 3],
        change: Changed,
    ) -> Self {
        Self { name, label, unit, low, high, step, nominal: 0.0, change }
    }

    /// The slider of an imperfection; none if it has none, or is not simulated on `rig`.
    fn of_imperfection(imperfection: &'static Imperfection, rig: &Rig) -> Option<Self> {
        let slider = imperfection.slider.filter(|_| imperfection.not_on(rig).is_none())?;
        let change = Changed::Imperfection(imperfection, slider.scale);
        Some(Self::new(slider.name, slider.label, slider.unit, slider.range, change))
    }

    /// All properties of a machine as designed for, in the order of the page. The cart of a drive that takes pulses
    /// goes where they say; forces on it matter only if `[reality]` has the motor.
    fn all_of(rig: &Rig) -> Vec<Self> {
        let takes_pulses = rig.actuator.held().is_motion();
        let feels_forces = !takes_pulses || rig.reality.step_motor.holding_force_n.is_some();
        let mass = Changed::Rig(|rig, more| {
            let percent = &mut rig.reality.parameters.link_mass_percent;
            *percent = percent.plus(more);
        });
        let cart_mass = Changed::Rig(|rig, more| rig.reality.parameters.cart_mass_percent += more);
        let mut all = vec![Self::new("mass", "masses of the links", "% more", [-50.0, 100.0, 1.0], mass)];
        if feels_forces {
            all.push(Self::new("cart-mass", "mass of the cart", "% more", [-50.0, 100.0, 1.0], cart_mass));
        }
        all.extend(IMPERFECTIONS.iter().filter_map(|imperfection| Self::of_imperfection(imperfection, rig)));
        let viscous = Changed::Rig(|rig, more| {
            let links = rig.chain_mut().into_iter().flat_map(|chain| &mut chain.links);
            links.for_each(|link| link.friction_n_m_s_per_rad += 1e-3 * more);
        });
        let drag = Changed::Rig(|rig, more| {
            let drag = &mut rig.reality.air_drag.air_drag_n_m_s2_per_rad2;
            *drag = drag.plus(1e-3 * more);
        });
        all.extend([
            Self::new(
                "joint-viscous",
                "viscous friction in each joint",
                "mN·m·s/rad more",
                [0.0, 1.0, 0.01],
                viscous,
            ),
            Self::new("air-drag", "air drag of each link", "mN·m·s²/rad² more", [0.0, 1.0, 0.001], drag),
        ]);
        if feels_forces {
            let viscous = Changed::Rig(|rig, more| {
                rig.chain_mut().into_iter().for_each(|chain| chain.cart.friction_n_s_per_m += more);
            });
            let unit = "N·s/m more";
            all.push(Self::new(
                "cart-viscous",
                "viscous friction of the cart",
                unit,
                [0.0, 10.0, 0.1],
                viscous,
            ));
            let noise =
                Self::new(FORCE_NOISE, "force noise", "N rms", [0.0, 2.0, 0.01], Changed::Disturbance);
            all.push(Self { nominal: Disturbance::of(rig).force_n, ..noise });
        }
        let coarseness =
            Self::new(COARSENESS, "coarser encoders", "times", [1.0, 32.0, 1.0], Changed::Signals);
        all.push(Self { nominal: 1.0, ..coarseness });
        if !takes_pulses {
            let jitter = Changed::Rig(|rig, percent| {
                rig.reality.driver.jitter_s += 0.01 * percent * rig.tick.period_s;
            });
            all.push(Self::new("jitter", "jitter of the tick", "% of a tick", [0.0, 40.0, 1.0], jitter));
            all.push(Self::new(DELAY, "more delay", "ticks", [0.0, 100.0, 1.0], Changed::Signals));
        }
        all
    }
}

/// The properties of a machine, and their current values.
#[derive(Debug, Clone)]
pub struct Properties {
    all: Vec<Property>,
    values: Vec<f64>,
}

impl Properties {
    /// The properties of `rig` as designed for, with the disturbances that its file expects.
    pub fn of(rig: &Rig) -> Self {
        let all = Property::all_of(rig);
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
        let Property { low, high, change, .. } = self.all[index];
        self.values[index] = value.clamp(low, high);
        Some(!matches!(change, Changed::Signals))
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
            match property.change {
                Changed::Imperfection(imperfection, scale) => {
                    imperfection.add(&mut rig.reality, scale * value)
                }
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
    fn every_slider_of_an_imperfection_adds_to_it_in_its_unit() {
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
        let rig = Rig::from_path(&rigs.join("quadruple-paper.toml")).unwrap();
        let mut number = 0;
        for imperfection in &IMPERFECTIONS {
            let Some(slider) = imperfection.slider else { continue };
            let mut properties = Properties::of(&rig);
            assert_eq!(properties.applied_to(&rig), rig, "negative control");
            let [_, high, _] = slider.range;
            assert_eq!(properties.set(slider.name, 2.0 * high), Some(true), "the machine is built again");
            let mut with = rig.clone();
            imperfection.add(&mut with.reality, slider.scale * high);
            assert!(with != rig && properties.applied_to(&rig) == with, "{}", imperfection.key);
            let same = properties.described().iter().filter(|property| property.name == slider.name);
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
        let all = ["mass", "joint-dry", "tilt", "joint-viscous", "air-drag", "coarseness"];
        assert_eq!(names("single-stepper.toml"), all);
    }
}
