//! `src/gains.rs`: the table as Rust source, in rustfmt's format, the same bytes for the same rig.

use core::fmt::Write;

use super::supervision_source::write_supervision;
use super::{LawValues, MotorValues, ObserverValues, TableValues};
use crate::rig::{PlantDescription, Rig};

/// The source of a `gains.rs` for `table`, designed from `rig`.
pub fn gains_source(rig: &Rig, table: &TableValues) -> String {
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write_source(&mut out, rig, table);
    out
}

fn write_source(out: &mut String, rig: &Rig, table: &TableValues) -> core::fmt::Result {
    let crc = table.crc();
    let states = state_meanings(rig);
    writeln!(out, "//! Gains of the rig `{}`, written by `upright design`; do not edit.", table.rig)?;
    writeln!(out, "//!")?;
    writeln!(out, "//! Every gain is the exact answer of its design problem, rounded once to f32.\n")?;
    if table.motor.is_some() {
        writeln!(out, "use crate::control::actuator::MotorMap;")?;
    }
    writeln!(out, "use crate::supervision::detection::{{MotorTest, Thresholds}};")?;
    writeln!(out, "use crate::table::limits::Limits;")?;
    if table.observer.is_some() {
        writeln!(out, "use crate::control::observer::ObserverGains;")?;
    }
    writeln!(out, "use crate::control::state_feedback::LawGains;")?;
    writeln!(out, "use crate::table::{{GainTable, TABLE_FORMAT, columns}};\n")?;
    let mut constant = |doc: &str, name: &str, kind: &str, value: &str| {
        writeln!(out, "/// {doc}\npub const {name}: {kind} = {value};\n")
    };
    constant("Name of the rig.", "RIG", "&str", &format!("{:?}", table.rig))?;
    constant(
        "Version of the tool that designed the gains.",
        "TOOL_VERSION",
        "&str",
        &format!("{:?}", env!("CARGO_PKG_VERSION")),
    )?;
    constant("Hash of the rig file's values.", "RIG_HASH", "u64", &hexadecimal(table.rig_hash))?;
    constant("Control period (s).", "TICK_S", "f32", &literal(table.tick_s))?;
    constant("Number of states.", "STATES", "usize", &table.states.to_string())?;
    constant("Number of sensors.", "SENSORS", "usize", &table.sensors.to_string())?;
    writeln!(out, "/// The gain table.\npub static TABLE: GainTable<STATES, SENSORS> = GainTable {{")?;
    writeln!(out, "    format: TABLE_FORMAT,")?;
    writeln!(out, "    states: {},", table.states)?;
    writeln!(out, "    sensors: {},", table.sensors)?;
    writeln!(out, "    // index of the state that follows the set-point\n    output: {},", table.output)?;
    writeln!(out, "    rig_hash: RIG_HASH,")?;
    writeln!(out, "    // s: control period\n    tick_s: TICK_S,")?;
    writeln!(out, "    // ticks between a measurement and the force computed from it")?;
    writeln!(out, "    delay_ticks: {},", table.delay_ticks)?;
    writeln!(
        out,
        "    // N: largest force on the cart\n    force_limit_n: {},",
        literal(table.force_limit_n)
    )?;
    writeln!(out, "    // linear quadratic regulator")?;
    write_law(out, "lqr", &table.lqr, &states)?;
    writeln!(out, "    // pole placement")?;
    write_law(out, "pole_placement", &table.pole_placement, &states)?;
    write_observer(out, &table.observer, &states)?;
    write_motor(out, &table.motor)?;
    let measured = measured_names(table, &states);
    write_supervision(out, &table.limits, &table.thresholds, &measured)?;
    let (high, low) = (crc >> 16, crc & 0xffff);
    writeln!(out, "    // CRC-32 of all values above\n    crc: 0x{high:04x}_{low:04x},\n}};")
}

fn write_law(out: &mut String, name: &str, law: &Option<LawValues>, states: &[Meaning]) -> core::fmt::Result {
    let Some(law) = law else {
        return writeln!(out, "    {name}: None,");
    };
    writeln!(out, "    {name}: Some(LawGains {{\n        k: columns([[")?;
    for (gain, state) in law.k.iter().zip(states) {
        entry(out, 12, &format!("{}: {}", state.gain_unit, state.name), *gain)?;
    }
    writeln!(out, "        ]]),")?;
    let mut field = |name: &str, meaning: &str, value: f32| {
        writeln!(out, "        // {meaning}\n        {name}: {},", literal(value))
    };
    field("k_pending", "1: gain on the force still on its way (0 without delay)", law.k_pending)?;
    field(
        "k_integral",
        "N/(m s): gain on the integrated position error (0 without integral action)",
        law.k_integral,
    )?;
    field("n", "N/m: precompensation gain on the set-point", law.n)?;
    field("setpoint_step", "m: largest change of the governed set-point in one tick", law.setpoint_step)?;
    writeln!(out, "    }}),")
}

fn write_observer(
    out: &mut String,
    observer: &Option<ObserverValues>,
    states: &[Meaning],
) -> core::fmt::Result {
    writeln!(out, "    // steady-state Kalman filter")?;
    let Some(observer) = observer else {
        return writeln!(out, "    observer: None,");
    };
    let name = |index: usize| states.get(index).map_or("", |state| state.name.as_str());
    writeln!(out, "    observer: Some(ObserverGains {{")?;
    writeln!(
        out,
        "        // one column per state now, one entry per state a tick later\n        ad: columns(["
    )?;
    for from in 0..states.len() {
        writeln!(out, "            // from {}\n            [", name(from))?;
        for (to, row) in observer.ad.iter().enumerate() {
            entry(out, 16, &format!("to {}", name(to)), row[from])?;
        }
        writeln!(out, "            ],")?;
    }
    writeln!(out, "        ]),\n        // per newton held for one tick\n        bd: columns([[")?;
    for (to, gain) in observer.bd.iter().enumerate() {
        entry(out, 12, &format!("to {}", name(to)), *gain)?;
    }
    writeln!(
        out,
        "        ]]),\n        // one column per sensor: what an innovation adds to each state\n        l: columns(["
    )?;
    for (sensor, &measured) in observer.measured.iter().enumerate() {
        writeln!(out, "            // from the sensor of {}\n            [", name(measured as usize))?;
        for (to, row) in observer.l.iter().enumerate() {
            entry(out, 16, &format!("to {}", name(to)), row[sensor])?;
        }
        writeln!(out, "            ],")?;
    }
    writeln!(out, "        ]),\n        // index of the state that each sensor measures")?;
    let measured: Vec<String> = observer.measured.iter().map(u32::to_string).collect();
    writeln!(out, "        measured: [{}],", measured.join(", "))?;
    writeln!(out, "        // m or rad per count\n        step: columns([[")?;
    for (&measured, &step) in observer.measured.iter().zip(&observer.step) {
        entry(out, 12, &format!("sensor of {}", name(measured as usize)), step)?;
    }
    writeln!(out, "        ]]),\n    }}),")
}

fn write_motor(out: &mut String, motor: &Option<MotorValues>) -> core::fmt::Result {
    writeln!(out, "    // motor, gear and pulley")?;
    let Some(motor) = motor else {
        return writeln!(out, "    motor: None,");
    };
    writeln!(out, "    motor: Some(MotorMap {{")?;
    let mut field = |name: &str, meaning: &str, value: f32| {
        writeln!(out, "        // {meaning}\n        {name}: {},", literal(value))
    };
    field("volts_per_newton", "V/N: voltage for a force at standstill", motor.volts_per_newton)?;
    field("volts_per_speed", "V s/m: back-EMF", motor.volts_per_speed)?;
    field("dead_zone_v", "V: below this the motor does not move", motor.dead_zone_v)?;
    field("slew_v_per_tick", "V: largest change in one tick", motor.slew_v_per_tick)?;
    field("supply_v", "V: supply", motor.supply_v)?;
    writeln!(out, "    }}),")
}

/// One value of an array under a comment that says what it is.
fn entry(out: &mut String, indent: usize, meaning: &str, value: f32) -> core::fmt::Result {
    writeln!(out, "{0:indent$}// {meaning}\n{0:indent$}{1},", "", literal(value))
}

/// What a state is, and the unit of a gain on it.
struct Meaning {
    name: String,
    gain_unit: &'static str,
}

fn state_meanings(rig: &Rig) -> Vec<Meaning> {
    match &rig.plant {
        PlantDescription::Chain(chain) => {
            let cart = [("cart position", "N/m"), ("cart speed", "N s/m")];
            let cart = cart.map(|(name, gain_unit)| Meaning { name: name.into(), gain_unit });
            let links = (1..=chain.links.len()).flat_map(|link| {
                [
                    Meaning { name: format!("angle of link {link}"), gain_unit: "N/rad" },
                    Meaning { name: format!("angular rate of link {link}"), gain_unit: "N s/rad" },
                ]
            });
            cart.into_iter().chain(links).collect()
        }
        PlantDescription::Model(model) => (0..model.b.len())
            .map(|i| Meaning { name: format!("state {i}"), gain_unit: "input/state" })
            .collect(),
    }
}

/// What each sensor measures.
fn measured_names<'a>(table: &TableValues, states: &'a [Meaning]) -> Vec<&'a str> {
    let of_chain = (0..table.sensors).map(|sensor| 2 * sensor).collect::<Vec<_>>();
    let measured = table.observer.as_ref();
    let measured =
        measured.map_or(of_chain, |observer| observer.measured.iter().map(|&state| state as usize).collect());
    measured.iter().map(|&state| states.get(state).map_or("", |state| state.name.as_str())).collect()
}

/// The shortest decimal that reads back as the same `f32`.
pub(super) fn literal(value: f32) -> String {
    format!("{value:?}")
}

fn hexadecimal(value: u64) -> String {
    let groups: Vec<String> = (0..4).rev().map(|i| format!("{:04x}", value >> (16 * i) & 0xffff)).collect();
    format!("0x{}", groups.join("_"))
}
