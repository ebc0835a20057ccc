//! `src/gains.rs`: the table as Rust source, the same bytes for the same rig.
//!
//! Names, order and comments are those of the declaration in the firmware's `table`.

use core::fmt::Write;

use upright::table::{MotionTable, TABLE_FORMAT};

use super::contents::{Field, TableNode, TableNumber};
use super::values::TableValues;
use crate::rig::{PlantDescription, Rig};

/// The source of a `gains.rs` for `table`, designed from `rig`. It compiles in any crate that depends on `upright`, as
/// a module or included in one: therefore it begins with plain comments.
pub fn gains_source(rig: &Rig, table: &TableValues) -> String {
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write_source(&mut out, rig, table);
    out
}

/// The facts of a generated source that say what its table is for: what each is called, and the text before its value.
const IDENTITY: [(&str, &str); 4] = [
    ("format", "format: upright::table_format!("),
    ("rig", "pub const RIG: &str = "),
    ("tick (s)", "pub const TICK_S: f32 = "),
    ("rig hash", "pub const RIG_HASH: u64 = "),
];

/// The format, rig, tick and rig hash in which the generated source `found` differs from `wanted`: "rig "a", not "b"".
pub fn identity_differences(found: &str, wanted: &str) -> Vec<String> {
    let value = |source: &str, before: &str| {
        let line = source.lines().find_map(|line| line.trim_start().strip_prefix(before));
        line.map_or("unknown".to_owned(), |value| value.trim_end_matches([')', ',', ';']).to_owned())
    };
    let values = IDENTITY.map(|(name, before)| (name, value(found, before), value(wanted, before)));
    let differing = values.into_iter().filter(|(_, found, wanted)| found != wanted);
    differing.map(|(name, found, wanted)| format!("{name} {found}, not {wanted}")).collect()
}

fn write_source(out: &mut String, rig: &Rig, table: &TableValues) -> core::fmt::Result {
    let states = state_names(rig);
    let sensors: Vec<&str> = table.measured().into_iter().map(|state| states[state].as_str()).collect();
    writeln!(out, "// Gains of the rig `{}`, written by `upright design`; do not edit.", table.rig)?;
    writeln!(out, "//")?;
    writeln!(out, "// Every gain is the exact answer of its design problem, rounded once to f32.")?;
    writeln!(out, "//")?;
    writeln!(out, "// - states: {}", states.join(", "))?;
    writeln!(out, "// - sensors: {}\n", sensors.join(", "))?;
    writeln!(out, "use upright::table::*;\n")?;
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
    constant("Hash of the rig file's values.", "RIG_HASH", "u64", &hexadecimal(table.rig_hash, 4))?;
    constant("Control period (s).", "TICK_S", "f32", &literal(TableNumber::Float(table.tick_s)))?;
    constant("Number of states.", "STATES", "usize", &table.states().to_string())?;
    constant("Number of sensors.", "SENSORS", "usize", &table.sensors().to_string())?;
    let gains = (table.fields(), table.crc());
    let mut writer = Writer {
        out,
        reference: MotionTable::reference_columns(table.states()),
        filter: table.states() * table.sensors(),
        indent: 0,
    };
    writer.line("/// The gain table.")?;
    writer.table("TABLE: GainTable<STATES, SENSORS> = GainTable", gains)?;
    match table.swing_up_fields() {
        Some(swing_up) => {
            let links = table.sensors() - 1;
            writer.line("\n/// The swing-up's table has knots for as long as each motion lasts.")?;
            writer.line(&format!("pub type SwingUp = SwingUpTable<'static, SENSORS, {links}>;\n"))?;
            writer.line("/// The swing-up.")?;
            writer.table("SWING_UP: SwingUp = SwingUpTable", swing_up)
        }
        None => {
            writer.line("\n/// This table has no swing-up.\npub type SwingUp = NoSwingUp;\n")?;
            writer.line("/// The swing-up.\npub static SWING_UP: SwingUp = NoSwingUp;")
        }
    }
}

/// What the states of the rig are.
fn state_names(rig: &Rig) -> Vec<String> {
    match &rig.plant {
        PlantDescription::Chain(chain) => {
            let (noun, position, speed) = (chain.base.noun(), chain.base.position(), chain.base.speed());
            let cart = [("position", position), ("speed", speed)]
                .map(|(what, quantity)| format!("{noun} {what} ({})", quantity.unit));
            let links = (1..=chain.links.len()).flat_map(|link| {
                [format!("angle of link {link} (rad)"), format!("angular rate of link {link} (rad/s)")]
            });
            cart.into_iter().chain(links).collect()
        }
        PlantDescription::Model(model) => (0..model.b.len()).map(|state| format!("state {state}")).collect(),
    }
}

/// Writes fields with one column of a motion or matrix per line, without rustfmt's line breaks.
struct Writer<'a> {
    out: &'a mut String,
    /// Number of columns of the field `reference`, and of `filter`.
    reference: usize,
    filter: usize,
    indent: usize,
}

impl Writer<'_> {
    fn line(&mut self, text: &str) -> core::fmt::Result {
        writeln!(self.out, "{:1$}{text}", "", self.indent)
    }

    /// Writes `opening`, the lines one level deeper, and `closing`.
    fn block(
        &mut self,
        opening: &str,
        lines: impl FnOnce(&mut Self) -> core::fmt::Result,
        closing: &str,
    ) -> core::fmt::Result {
        self.line(opening)?;
        self.indent += 4;
        lines(self)?;
        self.indent -= 4;
        self.line(closing)
    }

    /// Writes a static with these fields and this checksum.
    fn table(&mut self, declaration: &str, (fields, crc): (Vec<Field>, u32)) -> core::fmt::Result {
        let contents = |writer: &mut Self| {
            writer.fields(&fields)?;
            writer.line("// CRC-32 of all values above.")?;
            writer.line(&format!("crc: {},", hexadecimal(crc.into(), 2)))
        };
        self.line("#[rustfmt::skip]")?;
        self.block(&format!("pub static {declaration} {{"), contents, "};")
    }

    fn fields(&mut self, fields: &[Field]) -> core::fmt::Result {
        for Field { name, documentation, value } in fields {
            for line in documentation {
                self.line(&format!("// {}", line.trim()))?;
            }
            self.value(name, value)?;
        }
        Ok(())
    }

    /// Writes an array of structs, each on one line, below the comments of their fields.
    fn rows(&mut self, name: &str, rows: &[TableNode]) -> core::fmt::Result {
        let lines = |writer: &mut Self| {
            if let Some(TableNode::Struct(_, fields)) = rows.first() {
                for Field { name, documentation, .. } in fields {
                    let documentation: Vec<&str> = documentation.iter().map(|line| line.trim()).collect();
                    writer.line(&format!("// - {name}: {}", documentation.join(" ")))?;
                }
            }
            rows.iter().try_for_each(|row| writer.line(&format!("{},", inline(row)?)))
        };
        self.block(&format!("{name}: ["), lines, "],")
    }

    fn value(&mut self, name: &str, value: &TableNode) -> core::fmt::Result {
        match value {
            TableNode::Value(number) => match name {
                "format" => self.line(&format!("format: upright::table_format!({TABLE_FORMAT}),")),
                "rig_hash" => self.line("rig_hash: RIG_HASH,"),
                "tick_s" => self.line("tick_s: TICK_S,"),
                name => self.line(&format!("{name}: {},", literal(*number))),
            },
            TableNode::List(numbers) => self.line(&format!("{name}: [{}],", row(numbers))),
            TableNode::Columns(columns) => match columns.as_slice() {
                [column] => self.line(&format!("{name}: columns([[{}]]),", row(column))),
                columns => {
                    let lines = |writer: &mut Self| {
                        columns.iter().try_for_each(|column| writer.line(&format!("[{}],", row(column))))
                    };
                    self.block(&format!("{name}: columns(["), lines, "]),")
                }
            },
            TableNode::Slice(numbers) => {
                let columns = match name {
                    "reference" => self.reference,
                    "filter" => self.filter,
                    _ => 1,
                };
                let knots = (numbers.len() / columns).max(1);
                let lines = |writer: &mut Self| {
                    numbers.chunks(knots).try_for_each(|numbers| writer.line(&format!("{},", row(numbers))))
                };
                self.block(&format!("{name}: &["), lines, "],")
            }
            TableNode::Struct(kind, fields) => {
                self.block(&format!("{name}: {kind} {{"), |writer| writer.fields(fields), "},")
            }
            TableNode::Variant(variant, None) => self.line(&format!("{name}: {},", variant.name)),
            TableNode::Variant(variant, Some(node)) => match &**node {
                TableNode::Struct(kind, fields) => {
                    let opening = format!("{name}: {}({kind} {{", variant.name);
                    self.block(&opening, |writer| writer.fields(fields), "}),")
                }
                _ => Err(core::fmt::Error),
            },
            TableNode::Rows(rows) => self.rows(name, rows),
            TableNode::Structs(nodes) if nodes.is_empty() => self.line(&format!("{name}: &[],")),
            TableNode::Structs(nodes) => {
                let lines = |writer: &mut Self| {
                    nodes.iter().try_for_each(|node| match node {
                        TableNode::Struct(kind, fields) => {
                            writer.block(&format!("{kind} {{"), |writer| writer.fields(fields), "},")
                        }
                        _ => Err(core::fmt::Error),
                    })
                };
                self.block(&format!("{name}: &["), lines, "],")
            }
        }
    }
}

/// A value on one line, without comments.
fn inline(value: &TableNode) -> Result<String, core::fmt::Error> {
    match value {
        TableNode::Value(number) => Ok(literal(*number)),
        TableNode::List(numbers) => Ok(format!("[{}]", row(numbers))),
        TableNode::Variant(variant, None) => Ok(variant.name.to_owned()),
        TableNode::Variant(variant, Some(node)) => Ok(format!("{}({})", variant.name, inline(node)?)),
        TableNode::Struct(kind, fields) => {
            let field = |field: &Field| Ok(format!("{}: {}", field.name, inline(&field.value)?));
            let fields: Result<Vec<String>, core::fmt::Error> = fields.iter().map(field).collect();
            Ok(format!("{kind} {{ {} }}", fields?.join(", ")))
        }
        _ => Err(core::fmt::Error),
    }
}

fn row(numbers: &[TableNumber]) -> String {
    numbers.iter().map(|&number| literal(number)).collect::<Vec<_>>().join(", ")
}

/// The shortest decimal that reads back as the same number.
fn literal(number: TableNumber) -> String {
    match number {
        TableNumber::Float(value) => format!("{value:?}"),
        TableNumber::Integer(value) => value.to_string(),
        TableNumber::Hash(value) => hexadecimal(value, 4),
    }
}

/// Hexadecimal, in groups of four digits.
fn hexadecimal(value: u64, groups: usize) -> String {
    let groups: Vec<String> =
        (0..groups).rev().map(|i| format!("{:04x}", value >> (16 * i) & 0xffff)).collect();
    format!("0x{}", groups.join("_"))
}
