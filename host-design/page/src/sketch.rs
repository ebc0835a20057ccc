//! What a page draws of a rig before it is designed.

use serde_json::{Value, json};
use upright_design::rig::{Chain, Link, LinkEncoder, PlantDescription, Quantity, Rig, RigText};

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
        "base": drawn_base(rig),
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
        "fields": fields(rig, text),
        "weights": rig.lqr.as_ref().map(|lqr| json!({ "states": lqr.state_weights, "force": lqr.force_weight })),
        "unusual": rig.unusual_values(),
    })
}

/// What carries the links, as a page names and draws it: `arc_m` is the way of the first joint per unit of its
/// position.
pub(crate) fn drawn_base(rig: &Rig) -> Value {
    let base = rig.base();
    json!({
        "noun": base.noun(),
        "turns": !base.is_cart(),
        "position": shown_quantity(base.position()),
        "force": shown_quantity(base.force()),
        "arc_m": rig.chain().map_or(1.0, Chain::arc_m),
    })
}

/// Name and unit of a quantity.
pub(crate) fn shown_quantity(Quantity { name, unit }: Quantity) -> [&'static str; 2] {
    [name, unit]
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

/// The numbers that a page offers as fields: keys of the rig file, as a file with a cart calls them, too, with label,
/// unit and value. `text` is the rig's file.
fn fields(rig: &Rig, text: &RigText) -> Vec<Value> {
    let mut fields = Vec::new();
    let mut field = |key: &str, label: &str, unit: &str, value: Option<f64>| {
        let label = rig.words(label);
        let told = |value| json!({ "key": rig.base().path(key), "on_cart": key, "label": label, "unit": unit, "value": value });
        fields.extend(value.map(told));
    };
    let base = rig.base();
    let [position, force] = [base.position().unit, base.force().unit];
    let per_count = format!("{position}/count");
    if let PlantDescription::Chain(chain) = &rig.plant {
        // A drive that imposes the cart's acceleration does not care for its mass.
        field("cart.mass_kg", "mass of the cart", base.mass().unit, chain.cart.mass_kg);
        field("cart.radius_m", "distance of the links from the axis", "m", text.number("cart.radius_m"));
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
        let counts = text.number("cart.encoder_counts_per_rev");
        field("cart.encoder_counts_per_rev", "sensor of the cart", "counts/rev", counts);
        let step_m = chain.cart.encoder_step_m.filter(|_| counts.is_none());
        field("cart.encoder_step_m", "sensor of the cart", &per_count, step_m);
    }
    let actuator = &rig.actuator;
    let limit = |quantity: Quantity| format!("{} limit", quantity.name);
    let largest = actuator.force().and_then(|force| force.limit_n);
    field("actuator.force_limit_n", &limit(base.force()), force, largest);
    field("actuator.supply_v", "supply", "V", actuator.motor().map(|motor| motor.supply_v));
    if let Some(drive) = actuator.pulses() {
        let (acceleration, speed) = (base.acceleration(), base.speed());
        let most = Some(drive.acceleration_limit_m_per_s2);
        field("actuator.step_m", "travel per pulse", position, Some(drive.step_m));
        field("actuator.acceleration_limit_m_per_s2", &limit(acceleration), acceleration.unit, most);
        field("actuator.speed_limit_m_per_s", &limit(speed), speed.unit, drive.speed_limit_m_per_s);
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
        for (name, count) in [
            ("single-stepper", 8),
            ("quadruple-paper", 16),
            ("quadruple-paper-printed", 1),
            ("single-qube-servo-2", 8),
        ] {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{name}.toml"));
            let toml = std::fs::read_to_string(&file).unwrap();
            let rig = Rig::from_toml(&toml, &file).unwrap();
            let fields = fields(&rig, &RigText::parse(&toml, &file).unwrap());
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
