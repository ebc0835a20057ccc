//! Values that no bench has: most often a number in another unit.

use std::f64::consts::TAU;
use std::fmt;

use serde::{Serialize, Serializer};

use super::base::Base;
use super::description::Rig;
use super::edit::place_in;
use super::key::Section;
use super::sections::actuator::ACTUATOR;
use super::sections::chain::CART;
use super::sections::limits::LIMITS;
use super::sections::link::{LINK, LinkEncoder};
use super::sections::tick::TICK;
use super::value::Keys;
use crate::number::significant;

/// The smallest and the largest value that a rig on a bench has, by key, and that of an arm in its own unit. A key that
/// may be 0 has 0 as its smallest.
const USUAL: &[Usual] = &[
    ("tick.period_s", [2e-5, 0.1], None),
    ("cart.mass_kg", [0.01, 100.0], Some([1e-6, 10.0])),
    ("cart.friction_n_s_per_m", [0.0, 200.0], Some([0.0, 5.0])),
    ("cart.travel_m", [0.02, 20.0], Some([0.1, 1e3])),
    ("cart.encoder_step_m", [1e-8, 5e-3], Some([1e-6, 0.126])),
    ("link.mass_kg", [1e-3, 50.0], None),
    ("link.length_m", [5e-3, 5.0], None),
    ("link.friction_n_m_s_per_rad", [0.0, 1.0], None),
    ("link.encoder_step_rad", [6e-7, 0.126], None),
    ("link.encoder_counts_per_rev", [50.0, 1e7], None),
    ("link.sensor_delay_s", [0.0, 0.1], None),
    ("actuator.force_limit_n", [0.05, 2000.0], Some([1e-3, 500.0])),
    ("actuator.driver_lag_s", [1e-6, 0.2], None),
    ("actuator.torque_constant_n_m_per_a", [1e-4, 5.0], None),
    ("actuator.back_emf_constant_v_s_per_rad", [1e-4, 5.0], None),
    ("actuator.resistance_ohm", [0.01, 500.0], None),
    ("actuator.gear_ratio", [0.05, 1000.0], None),
    ("actuator.pulley_radius_m", [1e-3, 0.5], None),
    ("actuator.supply_v", [1.0, 400.0], None),
    ("actuator.acceleration_limit_m_per_s2", [0.1, 500.0], Some([1.0, 1e4])),
    ("actuator.step_m", [1e-8, 5e-3], Some([1e-6, 0.1])),
    ("actuator.speed_limit_m_per_s", [0.02, 50.0], Some([0.1, 500.0])),
    ("actuator.step_rate_limit_hz", [100.0, 5e7], None),
    ("actuator.bandwidth_hz", [0.3, 1e4], None),
    ("limits.speed_m_per_s", [0.02, 50.0], Some([0.1, 500.0])),
    ("limits.jog_force_n", [5e-3, 500.0], Some([1e-4, 100.0])),
];

/// Key, values of a cart, and those of an arm if they differ.
type Usual = (&'static str, [f64; 2], Option<[f64; 2]>);

/// What is usual for the speed of a cart whose motor has no load (m/s), and of an arm (rad/s).
const FREE_SPEED: [[f64; 2]; 2] = [[0.05, 50.0], [0.5, 2e3]];

/// A value far from those of any bench. It is not an error. Displayed, it is a sentence; so it is in JSON.
#[derive(Debug, Clone, PartialEq)]
pub struct UnusualValue {
    /// Its key: `link[1].mass_kg`.
    pub key: String,
    /// What it is, if it is not the value of the key.
    what: Option<String>,
    value: f64,
    unit: &'static str,
    usual: [f64; 2],
}

impl UnusualValue {
    /// The line, counted from 1, on which the text of a rig file gives it.
    pub fn line(&self, text: &str) -> Option<usize> {
        let start = place_in(text, &self.key)?;
        Some(1 + text.get(..start)?.matches('\n').count())
    }
}

impl fmt::Display for UnusualValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, what, value, unit, usual: [low, high] } = self;
        let value = significant(*value, 4);
        match what {
            Some(what) => write!(f, "{what} = {value} {unit}")?,
            None => write!(f, "{key} = {value} {unit}")?,
        }
        match *low == 0.0 {
            true => write!(f, ": at most {high} {unit} is usual; is the unit right?"),
            false => write!(f, ": {low} to {high} {unit} are usual; is the unit right?"),
        }
    }
}

impl Serialize for UnusualValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl Rig {
    /// Values far from those of any bench. None of them is an error.
    pub fn unusual_values(&self) -> Vec<UnusualValue> {
        let mut found = UnusualValues { base: self.base(), unusual: Vec::new() };
        if let Some(chain) = self.chain() {
            found.expect_all(&CART, &chain.cart);
            for (number, link) in (1..).zip(&chain.links) {
                let mut of_link =
                    |name, value| found.expect(&LINK, &format!("link[{number}].{name}"), name, value);
                of_link("mass_kg", link.mass_kg);
                of_link("length_m", link.length_m);
                of_link("friction_n_m_s_per_rad", link.friction_n_m_s_per_rad);
                of_link("sensor_delay_s", link.sensor_delay_s);
                match link.encoder {
                    Some(LinkEncoder::StepRad(step)) => of_link("encoder_step_rad", step),
                    Some(LinkEncoder::CountsPerRev(counts)) => of_link("encoder_counts_per_rev", counts),
                    Some(LinkEncoder::Absolute { .. }) | None => {}
                }
            }
        }
        let actuator = &self.actuator;
        let mut of_actuator = |name: &'static str, value: Option<f64>| {
            value
                .into_iter()
                .for_each(|value| found.expect(&ACTUATOR, &format!("actuator.{name}"), name, value));
        };
        of_actuator("force_limit_n", actuator.force().and_then(|force| force.limit_n));
        of_actuator("driver_lag_s", actuator.lag_s());
        if let Some(drive) = actuator.pulses() {
            found.expect_all(&ACTUATOR, drive);
        }
        if let Some(motor) = actuator.motor() {
            found.expect_all(&ACTUATOR, motor);
            found.expect_free_speed(motor.supply_v / motor.volts_per_speed());
        }
        found.expect_all(&TICK, &self.tick);
        found.expect_all(&LIMITS, &self.limits);
        found.unusual
    }

    /// Whether the rail is shorter than one turn of the motor's pulley, as the arc of an arm is that turns about a
    /// vertical axis and is described as a cart. A belt or a rack is longer than that.
    pub fn may_be_an_arm(&self) -> bool {
        let pulley = self.actuator.motor().map(|motor| motor.pulley_radius_m);
        pulley.zip(self.chain()).is_some_and(|(radius_m, chain)| {
            let [low, high] = chain.cart.travel_m;
            chain.base.is_cart() && high - low < TAU * radius_m
        })
    }
}

struct UnusualValues {
    base: Base,
    unusual: Vec<UnusualValue>,
}

impl UnusualValues {
    /// Compares the numbers of a section with what is usual: of a pair, its length.
    fn expect_all<T: Keys>(&mut self, section: &'static Section, values: &T) {
        let (base, keys) = (self.base, T::KEYS.iter().zip(values.values()));
        for (key, numbers) in keys.filter(|(key, _)| base.has(section, key.name)) {
            let value = match numbers[..] {
                [value] => value,
                [low, high] => high - low,
                _ => continue,
            };
            self.expect(section, &format!("{}.{}", section.name, key.name), key.name, value);
        }
    }

    fn expect(&mut self, section: &'static Section, key: &str, name: &str, value: f64) {
        let is_key = |known: &&(&str, _, _)| known.0.split_once('.') == Some((section.name, name));
        let Some(&(_, of_cart, of_arm)) = USUAL.iter().find(is_key) else { return };
        let (base, unit) = (self.base, self.base.key(section, name).unit);
        let usual = if base.is_cart() { of_cart } else { of_arm.unwrap_or(of_cart) };
        let what = (name == "travel_m").then(|| format!("length of {}", base.path("cart.travel_m")));
        self.compare(UnusualValue { key: base.path(key), what, value, unit, usual });
    }

    fn expect_free_speed(&mut self, value: f64) {
        let base = self.base;
        self.compare(UnusualValue {
            key: "actuator".to_owned(),
            what: Some(format!("speed of the {} without load, from [actuator],", base.noun())),
            value,
            unit: base.speed().unit,
            usual: FREE_SPEED[usize::from(!base.is_cart())],
        });
    }

    fn compare(&mut self, value: UnusualValue) {
        let [low, high] = value.usual;
        if !(low..=high).contains(&value.value) {
            self.unusual.push(value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_usual_range_is_that_of_a_key() {
        for (key, [low, high], _) in USUAL {
            let (section, name) = key.split_once('.').unwrap();
            let sections = [&CART, &LINK, &ACTUATOR, &TICK, &LIMITS];
            let section = sections.into_iter().find(|known| known.name == section).unwrap();
            assert_eq!(section.key(name).name, name);
            assert!(low < high, "{key}");
        }
    }
}
