//! Values that no bench has: most often a number in another unit.

use super::description::Rig;
use super::sections::link::LinkEncoder;
use crate::number::significant;

/// Largest and smallest value that a rig on a bench has, of each kind.
const MASS_KG: [f64; 2] = [1e-3, 500.0];
const LENGTH_M: [f64; 2] = [5e-3, 10.0];
const TRAVEL_M: [f64; 2] = [0.02, 50.0];
const PULLEY_M: [f64; 2] = [1e-3, 0.5];
const SPEED_M_PER_S: [f64; 2] = [0.05, 50.0];
const COUNTS: [f64; 2] = [50.0, 1e7];

impl Rig {
    /// Values far from those of any bench, each with its key, as sentences. None of them is an error.
    pub fn unusual_values(&self) -> Vec<String> {
        let mut unusual = Vec::new();
        let mut expect = |key: &str, value: f64, unit: &str, [low, high]: [f64; 2]| {
            if !(low..=high).contains(&value) {
                let value = significant(value, 4);
                unusual.push(format!(
                    "{key} = {value} {unit}: {low} to {high} {unit} are usual; is the unit right?"
                ));
            }
        };
        if let Some(chain) = self.chain() {
            if let Some(mass_kg) = chain.cart.mass_kg {
                expect("cart.mass_kg", mass_kg, "kg", MASS_KG);
            }
            expect("length of cart.travel_m", chain.cart.travel_m[1] - chain.cart.travel_m[0], "m", TRAVEL_M);
            for (number, link) in (1..).zip(&chain.links) {
                expect(&format!("link[{number}].mass_kg"), link.mass_kg, "kg", MASS_KG);
                expect(&format!("link[{number}].length_m"), link.length_m, "m", LENGTH_M);
                if let Some(LinkEncoder::CountsPerRev(counts)) = link.encoder {
                    expect(&format!("link[{number}].encoder_counts_per_rev"), counts, "counts/rev", COUNTS);
                }
            }
        }
        if let Some(motor) = &self.actuator.motor {
            expect("actuator.pulley_radius_m", motor.pulley_radius_m, "m", PULLEY_M);
            let speed_m_per_s = motor.supply_v / motor.volts_per_speed();
            expect("speed of the cart without load, from [actuator],", speed_m_per_s, "m/s", SPEED_M_PER_S);
        }
        unusual
    }
}
