//! What a page is told first.

use serde_json::{Value, json};
use upright::supervision::supervisor::State;
use upright_closed_loop::conversation::words;
use upright_closed_loop::defects::{Defect, Expected, Needs, Ticks};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::table::TableValues;

use super::property::Properties;
use crate::sketch::{drawn_base, shown_quantity};

/// Most links of a chain that stands while a person goes on pulling one of them.
const FEW_LINKS: usize = 2;

/// The rig, its limits, and what can be done with it. `defects` are those that can begin; none if it is a real machine.
pub fn greeting(rig: &Rig, table: &TableValues, place: &str, defects: Option<&[Defect]>) -> Value {
    let is_simulated = defects.is_some();
    let (base, takes_pulses) = (rig.base(), table.drive.pulses().is_some());
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
        State::Stilling,
        State::Fault,
    ];
    let defects = Defect::ALL.iter().filter(|defect| defects.is_some_and(|defects| defects.contains(defect)));
    json!({
        "rig": rig.name,
        "place": place,
        "is_simulated": is_simulated,
        "has_swing_up": table.swing_up.is_some(),
        "has_stilling": table.stilling.is_some(),
        "tick_s": rig.tick.period_s,
        "falls_when_held": lengths.len() > FEW_LINKS,
        "lengths_m": lengths,
        "travel_m": travel,
        "soft_m": table.limits.rail_m,
        "setpoints_m": table.limits.setpoints_m(),
        "angle_limit_rad": table.limits.angle_rad,
        "force_limit_n": table.drive.largest_force_n(),
        "base": drawn_base(rig),
        "input": shown_quantity(if takes_pulses { base.acceleration() } else { base.force() }),
        "push_unit": if takes_pulses { "N" } else { base.force().unit },
        "step": table.observer.as_ref()
            .map(|_| table.rows().iter().map(|sensor| sensor.step).collect::<Vec<_>>()),
        "sensors": (0..table.sensors()).map(|sensor| base.words(&words::joint(sensor as u8))).collect::<Vec<_>>(),
        "laws": table.laws.present().map(|(law, _)| json!({ "name": law.option(), "title": law.title(), "value": law }))
            .collect::<Vec<Value>>(),
        "states": states.map(|state| json!({ "state": state, "text": base.words(words::state(state)) })),
        "properties": if is_simulated { json!(Properties::of(rig).described()) } else { json!([]) },
        "defects": defects
            .map(|&kind| json!({ "name": kind.name(), "meaning": base.words(kind.meaning()), "group": group(kind), "must": must(kind) }))
            .collect::<Vec<_>>(),
    })
}

/// The heading under which a page shows a defect.
fn group(kind: Defect) -> &'static str {
    match kind {
        kind if kind.has_sensor() || kind == Defect::CartEncoderFrozen => "Encoders",
        Defect::MotorDead | Defect::MotorReversed | Defect::MotorStuck | Defect::MotorWeak => "Motor",
        Defect::CartJammed | Defect::PulsesMissing | Defect::SomePulsesMissing | Defect::StepsLost => "Motor",
        Defect::SupplyNotANumber
        | Defect::SupplySag
        | Defect::SupplyDip
        | Defect::SupplySurge
        | Defect::SupplySpike => "Supply",
        Defect::EmergencyStop | Defect::DriverFault | Defect::LimitSwitch => "Contacts",
        Defect::OneOverrun | Defect::Overruns | Defect::Push => "Time and touch",
        _ => "Serial line",
    }
}

/// What the firmware has to do, in few words.
fn must(kind: Defect) -> String {
    match kind.expected() {
        Expected::Fault(_, Ticks::Exactly(1)) => "off in the same tick".to_owned(),
        Expected::Fault(_, Ticks::Exactly(ticks)) => format!("off in {ticks} ticks"),
        Expected::Fault(_, Ticks::Supply | Ticks::Link) => "off after a time limit".to_owned(),
        Expected::Off(ticks) => format!("off, at best in {ticks} ticks"),
        Expected::Counted => "ignored, and counted".to_owned(),
        Expected::Ignored => "ignored".to_owned(),
        Expected::Changed | Expected::Bounded => "off before it is far off".to_owned(),
        Expected::Survived => "survived".to_owned(),
        Expected::Refused(_) | Expected::LetGo | Expected::Found(_) => "refused".to_owned(),
        Expected::Dead => "off at once".to_owned(),
    }
}

/// The defects that a person can begin in a rig with this table, whose firmware runs in this process.
pub fn breakable(table: &TableValues) -> Vec<Defect> {
    let can_begin = |kind: &Defect| {
        kind.is_possible(table) && kind.can_begin_while_balancing() && kind.needs() != Needs::Board
    };
    Defect::ALL.iter().copied().filter(can_begin).collect()
}
