//! What a page is told first.

use serde_json::{Value, json};
use upright::supervision::supervisor::State;
use upright_design::conversation::words;
use upright_design::defects::{Defect, Needs};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::table::TableValues;

use super::property::Properties;

/// The rig, its limits, and what can be done with it. `defects` are those that can begin; none if it is a real machine.
pub fn greeting(rig: &Rig, table: &TableValues, place: &str, defects: Option<&[Defect]>) -> Value {
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
    })
}

/// The defects that a person can begin in a rig with this table, whose firmware runs in this process.
pub fn breakable(table: &TableValues) -> Vec<Defect> {
    let can_begin = |kind: &Defect| {
        kind.is_possible(table) && kind.can_begin_while_balancing() && kind.needs() != Needs::Image
    };
    Defect::ALL.iter().copied().filter(can_begin).collect()
}
