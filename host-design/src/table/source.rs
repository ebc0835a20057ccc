//! `src/gains.rs`: the table as Rust source, in rustfmt's format, the same bytes for the same rig.

use core::fmt::Write;

use super::{LawValues, TableValues};
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
    writeln!(out, "//! Every value is the exact answer of the design problem, rounded once to f32.\n")?;
    writeln!(out, "use crate::table::{{GainTable, LawGains, TABLE_FORMAT, column}};\n")?;
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
    constant("Number of states.", "STATES", "usize", &table.states().to_string())?;
    writeln!(out, "/// The gain table.\npub static TABLE: GainTable<STATES> = GainTable {{")?;
    writeln!(out, "    format: TABLE_FORMAT,")?;
    writeln!(out, "    states: {},", table.states())?;
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
    writeln!(
        out,
        "    // CRC-32 of all values above\n    crc: 0x{:04x}_{:04x},\n}};",
        crc >> 16,
        crc & 0xffff
    )
}

fn write_law(out: &mut String, name: &str, law: &Option<LawValues>, states: &[Meaning]) -> core::fmt::Result {
    let Some(law) = law else {
        return writeln!(out, "    {name}: None,");
    };
    writeln!(out, "    {name}: Some(LawGains {{\n        k: column([")?;
    for (gain, state) in law.k.iter().zip(states) {
        writeln!(out, "            // {}: {}\n            {},", state.gain_unit, state.name, literal(*gain))?;
    }
    writeln!(out, "        ]),")?;
    writeln!(out, "        // 1: gain on the force still on its way (0 without delay)")?;
    writeln!(out, "        k_pending: {},", literal(law.k_pending))?;
    writeln!(
        out,
        "        // {}: precompensation gain on the set-point",
        states.first().map_or("1", |_| "N/m")
    )?;
    writeln!(out, "        n: {},\n    }}),", literal(law.n))
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

/// The shortest decimal that reads back as the same `f32`.
fn literal(value: f32) -> String {
    format!("{value:?}")
}

fn hexadecimal(value: u64) -> String {
    let groups: Vec<String> = (0..4).rev().map(|i| format!("{:04x}", value >> (16 * i) & 0xffff)).collect();
    format!("0x{}", groups.join("_"))
}
