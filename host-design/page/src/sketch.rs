//! What a page draws of a rig before it is designed.

use serde_json::{Value, json};
use upright_design::rig::{Link, LinkEncoder, PlantDescription, Rig, RigText};

use crate::changes::dials;

/// Names, lengths and travel; what can be changed while one looks; values that no bench has. `text` is the rig's file.
pub(crate) fn sketch(rig: &Rig, text: &RigText) -> Value {
    let (lengths_m, travel_m) = match &rig.plant {
        PlantDescription::Chain(chain) => {
            (chain.links.iter().map(|link| link.length_m).collect(), chain.cart.travel_m.map(Some))
        }
        PlantDescription::Model(_) => (Vec::new(), [None, None]),
    };
    // Without a limit, JSON has null.
    let travel_m = travel_m.map(|end| end.filter(|end: &f64| end.is_finite()));
    json!({
        "input": rig.input_quantity().title(),
        "rig": rig.name,
        "lengths_m": lengths_m,
        "travel_m": travel_m,
        "drive": drive(rig),
        "sensors": sensors(rig),
        "has_observer": rig.kalman.is_some(),
        "states": rig.states(),
        "tick_s": rig.tick.period_s,
        "dials": dials(rig, text),
        "fields": fields(rig),
        "weights": rig.lqr.as_ref().map(|lqr| json!({ "states": lqr.state_weights, "force": lqr.force_weight })),
        "unusual": rig.unusual_values(),
    })
}

/// The kind of the drive, of those that a page has pictures of.
fn drive(rig: &Rig) -> &'static str {
    match (rig.actuator.pulses(), rig.actuator.motor()) {
        (Some(_), _) => "stepper",
        (None, Some(_)) => "motor",
        (None, None) => "force",
    }
}

/// The kind of the links' sensors, if all have the same.
fn sensors(rig: &Rig) -> Option<&'static str> {
    let links = rig.chain().map_or(&[][..], |chain| &chain.links);
    let is_absolute = |link: &Link| matches!(link.encoder, Some(LinkEncoder::Absolute { .. }));
    if !links.is_empty() && links.iter().all(is_absolute) {
        Some("absolute")
    } else if !links.is_empty() && links.iter().all(|link| link.encoder.is_some() && !is_absolute(link)) {
        Some("encoder")
    } else {
        None
    }
}

/// The numbers that a page offers as fields: keys of the rig file, with label, unit and value.
fn fields(rig: &Rig) -> Vec<Value> {
    let mut fields = Vec::new();
    let mut field = |key: &str, label: &str, unit: &str, value: Option<f64>| {
        fields.extend(value.map(|value| json!({ "key": key, "label": label, "unit": unit, "value": value })));
    };
    if let PlantDescription::Chain(chain) = &rig.plant {
        // A drive that imposes the cart's acceleration does not care for its mass.
        field("cart.mass_kg", "mass of the cart", "kg", chain.cart.mass_kg);
        for (number, link) in (1..).zip(&chain.links) {
            let mut of_link = |name: &str, label: &str, unit: &str, value| {
                field(&format!("link[{number}].{name}"), &format!("{label} of link {number}"), unit, value);
            };
            of_link("mass_kg", "mass", "kg", Some(link.mass_kg));
            of_link("length_m", "length", "m", Some(link.length_m));
            match link.encoder {
                Some(LinkEncoder::CountsPerRev(counts)) => {
                    of_link("encoder_counts_per_rev", "sensor", "counts/rev", Some(counts));
                }
                Some(LinkEncoder::StepRad(step)) => {
                    of_link("encoder_step_rad", "sensor", "rad/count", Some(step))
                }
                Some(LinkEncoder::Absolute { bits, .. }) => {
                    of_link("sensor_bits", "sensor", "bits", Some(f64::from(bits)));
                }
                None => {}
            }
        }
        field("cart.encoder_step_m", "sensor of the cart", "m/count", chain.cart.encoder_step_m);
    }
    let actuator = &rig.actuator;
    field("actuator.force_limit_n", "force limit", "N", actuator.force().and_then(|force| force.limit_n));
    field("actuator.supply_v", "supply", "V", actuator.motor().map(|motor| motor.supply_v));
    if let Some(drive) = actuator.pulses() {
        let limit = Some(drive.acceleration_limit_m_per_s2);
        field("actuator.step_m", "travel per pulse", "m", Some(drive.step_m));
        field("actuator.acceleration_limit_m_per_s2", "acceleration limit", "m/s²", limit);
        field("actuator.speed_limit_m_per_s", "speed limit", "m/s", drive.speed_limit_m_per_s);
        field("actuator.step_rate_limit_hz", "most pulses", "Hz", drive.step_rate_limit_hz);
    }
    field("tick.period_s", "tick", "s", Some(rig.tick.period_s));
    fields
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn each_field_is_a_key_of_the_file_with_its_value() {
        for (name, count) in [("single-stepper", 8), ("quadruple-paper", 16), ("quadruple-paper-printed", 1)]
        {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{name}.toml"));
            let toml = std::fs::read_to_string(&file).unwrap();
            let rig = Rig::from_toml(&toml, &file).unwrap();
            let fields = fields(&rig);
            assert_eq!(fields.len(), count, "{name}: {fields:?}");
            for field in &fields {
                // The same value changes nothing; another one changes the rig.
                let with = |value: f64| {
                    let mut text = RigText::parse(&toml, &file).unwrap();
                    text.set(field["key"].as_str().unwrap(), &value.to_string()).unwrap();
                    Rig::from_toml(&text.to_string(), &file).unwrap()
                };
                let value = field["value"].as_f64().unwrap();
                assert_eq!(with(value).hash(), rig.hash(), "{field}");
                assert_ne!(with(2.0 * value).hash(), rig.hash(), "{field}");
            }
        }
    }
}
