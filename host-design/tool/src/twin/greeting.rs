//! What a page is told first.

use serde_json::{Value, json};
use upright::supervision::supervisor::State;
use upright_design::rig::{PlantDescription, Rig};
use upright_design::table::TableValues;

use super::property::Properties;
use crate::campaign::Defect;
use crate::figure::{CHROMATIC, curve_colour, curve_dash, limit_colour, reference_colour};
use crate::monitor::words;

/// The rig, its limits, and what can be done with it. `defects` are those that can begin; none if it is a real machine.
pub(super) fn greeting(rig: &Rig, table: &TableValues, place: &str, defects: Option<&[Defect]>) -> Value {
    let is_simulated = defects.is_some();
    let (lengths, travel) = match &rig.plant {
        PlantDescription::Chain(chain) => {
            (chain.links.iter().map(|link| link.length_m).collect::<Vec<_>>(), chain.cart.travel_m.map(Some))
        }
        PlantDescription::Model(_) => (Vec::new(), [None, None]),
    };
    let states = [
        State::Disarmed,
        State::Homing,
        State::Calibrated,
        State::Jogging,
        State::Identifying,
        State::Armed,
        State::Raising,
        State::Balancing,
        State::Holding,
        State::Lowering,
        State::Fault,
    ];
    let defects = Defect::ALL.iter().filter(|defect| defects.is_some_and(|defects| defects.contains(defect)));
    json!({
        "rig": rig.name,
        "place": place,
        "is_simulated": is_simulated,
        "has_swing_up": table.swing_up.is_some(),
        "tick_s": rig.tick.period_s,
        "lengths_m": lengths,
        "travel_m": travel,
        "soft_m": table.limits.rail_m,
        "angle_limit_rad": table.limits.angle_rad,
        "force_limit_n": table.force_limit_n,
        "sensors": (0..table.sensors()).map(|sensor| words::joint(sensor as u8)).collect::<Vec<_>>(),
        "laws": table.laws.present().map(|(law, _)| json!({ "name": law.option(), "title": law.title(), "value": law }))
            .collect::<Vec<Value>>(),
        "states": states.map(|state| json!({ "state": state, "text": words::state(state) })),
        "properties": if is_simulated { json!(Properties::of(rig).described()) } else { json!([]) },
        "defects": defects
            .map(|kind| json!({ "name": kind.name(), "meaning": kind.meaning(), "has_sensor": kind.has_sensor() }))
            .collect::<Vec<_>>(),
        "colours": (0..CHROMATIC).map(curve_colour).collect::<Vec<_>>(),
        "dashes": (0..CHROMATIC).map(curve_dash).collect::<Vec<_>>(),
        "reference": reference_colour(),
        "limit": limit_colour(),
    })
}
