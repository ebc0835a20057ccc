//! What a page draws of a rig before it is designed.

use serde_json::{Value, json};
use upright_design::rig::{CartInput, PlantDescription, Rig};

/// Names, lengths and travel; the weights that can be changed while one looks; values that no bench has.
pub(crate) fn of(rig: &Rig) -> Value {
    let (lengths_m, travel_m) = match &rig.plant {
        PlantDescription::Chain(chain) => {
            (chain.links.iter().map(|link| link.length_m).collect(), chain.cart.travel_m.map(Some))
        }
        PlantDescription::Model(_) => (Vec::new(), [None, None]),
    };
    // Without a limit, JSON has null.
    let travel_m = travel_m.map(|end| end.filter(|end: &f64| end.is_finite()));
    let input = match rig.actuator.input() {
        CartInput::Force => "force (N)",
        CartInput::Acceleration => "acceleration (m/s²)",
    };
    json!({
        "input": input,
        "rig": rig.name,
        "lengths_m": lengths_m,
        "travel_m": travel_m,
        "states": rig.states(),
        "tick_s": rig.tick.period_s,
        "fields": fields(rig),
        "weights": rig.lqr.as_ref().map(|lqr| json!({ "states": lqr.state_weights, "force": lqr.force_weight })),
        "unusual": rig.unusual_values(),
    })
}

/// The numbers that a page offers as fields: keys of the rig file, with label, unit and value.
fn fields(rig: &Rig) -> Vec<Value> {
    let field = |key: String, label: String, unit: &str, value: f64| json!({ "key": key, "label": label, "unit": unit, "value": value });
    let mut fields = Vec::new();
    if let PlantDescription::Chain(chain) = &rig.plant {
        // A drive that imposes the cart's acceleration does not care for its mass.
        if let Some(mass_kg) = chain.cart.mass_kg {
            fields.push(field("cart.mass_kg".to_owned(), "mass of the cart".to_owned(), "kg", mass_kg));
        }
        for (number, link) in (1..).zip(&chain.links) {
            fields.push(field(
                format!("link[{number}].mass_kg"),
                format!("mass of link {number}"),
                "kg",
                link.mass_kg,
            ));
            fields.push(field(
                format!("link[{number}].length_m"),
                format!("length of link {number}"),
                "m",
                link.length_m,
            ));
        }
    }
    if let Some(limit_n) = rig.actuator.force_limit_n {
        let key = "actuator.force_limit_n".to_owned();
        fields.push(field(key, "force limit".to_owned(), "N", limit_n));
    }
    fields.push(field("tick.period_s".to_owned(), "tick".to_owned(), "s", rig.tick.period_s));
    fields
}
