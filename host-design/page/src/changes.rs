//! Changes of a rig file that are more than another value of a key.

use std::path::Path;

use serde_json::{Value, json};
use upright_design::rig::{PlantDescription, Rig, RigText};

use crate::refusal::{FILE, PageRefusal};

/// Lists with entries for the links: key, entries besides, entries for each link.
const OF_LINKS: [(&str, usize, usize); 8] = [
    ("link", 0, 1),
    ("lqr.state_weights", 2, 2),
    ("lqr.cross_weights", 2, 2),
    ("pole_placement.far_poles", 0, 2),
    ("pole_placement.poles", 2, 2),
    ("kalman.joint_noise", 0, 1),
    ("kalman.observer_poles", 2, 2),
    ("friction.joint_n_m", 0, 1),
];

/// Each further pole of a pole placement is faster than the one before by this much (1/s): equal ones cannot be placed.
const APART_PER_S: f64 = 2.0;

/// The text with this number of links, whose new ones are copies of the last one, and then with other values of some
/// keys; those without a value are left out of it.
pub(crate) fn changed(
    toml: &str,
    links: Option<usize>,
    values: &[(String, Option<String>)],
) -> Result<String, PageRefusal> {
    let mut text = RigText::parse(toml, Path::new(FILE))?;
    if let Some(links) = links {
        for (key, besides, each) in OF_LINKS {
            text.resize(key, besides + each * links, each);
        }
        part_poles(&mut text, 2 * links)?;
    }
    for (key, value) in values {
        match value {
            Some(value) => text.set(key, value)?,
            None => text.remove(key),
        }
    }
    Ok(text.to_string())
}

/// Moves the far poles apart that are copies of others.
fn part_poles(text: &mut RigText, poles: usize) -> Result<(), PageRefusal> {
    if !text.has("pole_placement.far_poles") {
        return Ok(());
    }
    let parsed = |text: &RigText, pole: usize| text.number(&format!("pole_placement.far_poles[{pole}]"));
    let mut fastest = f64::INFINITY;
    for pole in 1..=poles {
        let Some(value) = parsed(text, pole) else { return Ok(()) };
        let parted = if value < fastest { value } else { fastest - APART_PER_S };
        if parted != value {
            text.set(&format!("pole_placement.far_poles[{pole}]"), &parted.to_string())?;
        }
        fastest = fastest.min(parted);
    }
    Ok(())
}

/// The keys that two files give different values: key, value in `from`, value in `toml`; null where it is not given.
pub(crate) fn differences(from: &str, toml: &str) -> Result<Vec<Value>, PageRefusal> {
    let read = |text: &str| RigText::parse(text, Path::new(FILE)).map(|text| text.values());
    let (before, now) = (read(from)?, read(toml)?);
    let find = |values: &[(String, String)], key: &str| {
        values.iter().find(|(other, _)| other == key).map(|(_, value)| value.clone())
    };
    let gone = before.iter().filter(|(key, _)| find(&now, key).is_none());
    let keys = now.iter().chain(gone).map(|(key, _)| key);
    let pairs = keys.map(|key| (key, find(&before, key), find(&now, key)));
    Ok(pairs
        .filter(|(_, before, now)| before != now)
        .map(|(key, before, now)| json!([key, before, now]))
        .collect())
}

/// The sliders that a person finds first: what each changes, and the keys that change with it. Each key has its value
/// and the power of the slider's relative change by which it is multiplied; without a power, it has the slider's own
/// value.
pub(crate) fn dials(rig: &Rig, text: &RigText) -> Vec<Value> {
    let PlantDescription::Chain(chain) = &rig.plant else { return Vec::new() };
    let mut scales: [Vec<Value>; 2] = Default::default();
    for number in 1..=chain.links.len() {
        for (name, powers) in [
            ("length_m", [Some(1.0), None]),
            ("centre_of_mass_m", [Some(1.0), None]),
            ("mass_kg", [None, Some(1.0)]),
            ("tip_mass_kg", [None, Some(1.0)]),
            ("inertia_kg_m2", [Some(2.0), Some(1.0)]),
            ("inertia_about_joint_kg_m2", [Some(2.0), Some(1.0)]),
            ("swing_period_s", [Some(0.5), None]),
        ] {
            let key = format!("link[{number}].{name}");
            if let Some(value) = text.number(&key) {
                for (scales, power) in scales.iter_mut().zip(powers) {
                    scales.extend(power.map(|power| json!([key, value, power])));
                }
            }
        }
    }
    let [of_length, of_mass] = scales;
    let length_m: f64 = chain.links.iter().map(|link| link.length_m).sum();
    let mass_kg: f64 = chain.links.iter().map(|link| link.mass_kg).sum();
    let mut dials = vec![
        json!({ "name": "length", "unit": "m", "value": length_m, "scales": of_length }),
        json!({ "name": "weight", "unit": "kg", "value": mass_kg, "scales": of_mass }),
    ];
    if let Some(force) = rig.actuator.force() {
        let lag_s = force.lag_s.unwrap_or(0.0);
        dials.push(json!({ "name": "late", "unit": "s", "value": lag_s, "scales": [["actuator.driver_lag_s", lag_s, null]] }));
    }
    dials
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(rig: &str) -> String {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{rig}.toml"));
        std::fs::read_to_string(file).unwrap()
    }

    fn rig(toml: &str) -> Rig {
        Rig::from_toml(toml, Path::new(FILE)).unwrap()
    }

    #[test]
    fn a_link_that_is_added_and_taken_away_again_leaves_the_file_as_it_was() {
        for name in ["single-quanser-ip02", "double-quanser-dbpen", "single-stepper", "quadruple-paper"] {
            let toml = read(name);
            let links = rig(&toml).chain().unwrap().links.len();
            let more = changed(&toml, Some(links + 1), &[]).unwrap();
            let with_more = rig(&more);
            assert_eq!(with_more.states(), 2 * links + 4, "{name}");
            upright_design::design::design(&with_more).unwrap();
            assert_eq!(rig(&changed(&more, Some(links), &[]).unwrap()).hash(), rig(&toml).hash(), "{name}");
        }
    }

    #[test]
    fn differences_are_keys_with_both_values_and_comments_are_none() {
        let toml = read("single-quanser-ip02");
        let other = toml.replace("supply_v = 10.0", "supply_v = 12").replace("dead_zone_v = 0.3 ", "#");
        let other = format!("{other}\n[integral]\nposition_weight = 1\n");
        let found = differences(&toml, &other).unwrap();
        let expected = [
            json!(["actuator.supply_v", "10.0", "12"]),
            json!(["integral.position_weight", null, "1"]),
            json!(["actuator.dead_zone_v", "0.3", null]),
        ];
        assert_eq!(found, expected);
        assert!(differences(&toml, &toml.replace("# ours", "# his")).unwrap().is_empty());
    }

    #[test]
    fn a_dial_changes_all_keys_that_go_with_it_and_a_key_without_a_value_goes() {
        let toml = read("single-quanser-ip02");
        let text = RigText::parse(&toml, Path::new(FILE)).unwrap();
        let dials = dials(&rig(&toml), &text);
        let keys = |dial: &Value| -> Vec<Value> {
            dial["scales"].as_array().unwrap().iter().map(|scale| scale[0].clone()).collect()
        };
        assert_eq!(
            keys(&dials[0]),
            ["link[1].length_m", "link[1].centre_of_mass_m", "link[1].inertia_kg_m2"]
        );
        assert_eq!(keys(&dials[1]), ["link[1].mass_kg", "link[1].inertia_kg_m2"]);
        assert_eq!(keys(&dials[2]), ["actuator.driver_lag_s"]);
        let key = "actuator.driver_lag_s".to_owned();
        let late = changed(&toml, None, &[(key.clone(), Some("0.01".to_owned()))]).unwrap();
        assert_eq!(rig(&late).actuator.lag_s(), Some(0.01));
        assert_eq!(changed(&late, None, &[(key, None)]).unwrap(), toml);
        // A cart that goes where its pulses say has no force that could be late.
        let stepper = read("single-stepper");
        let text = RigText::parse(&stepper, Path::new(FILE)).unwrap();
        assert_eq!(super::dials(&rig(&stepper), &text).len(), 2);
    }
}
