//! `src/gains.rs`: the table as Rust source, in rustfmt's format, the same bytes for the same rig.
//!
//! Names, order and comments are those of the declaration in the firmware's `table`.

use core::fmt::Write;

use upright::table::MotionTable;

use super::TableValues;
use super::contents::{Field, Node, Number};
use crate::rig::{PlantDescription, Rig};

/// The source of a `gains.rs` for `table`, designed from `rig`. It compiles in any crate that depends on `upright`.
pub fn gains_source(rig: &Rig, table: &TableValues) -> String {
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write_source(&mut out, rig, table);
    out
}

fn write_source(out: &mut String, rig: &Rig, table: &TableValues) -> core::fmt::Result {
    writeln!(out, "//! Gains of the rig `{}`, written by `upright design`; do not edit.", table.rig)?;
    writeln!(out, "//!")?;
    writeln!(out, "//! Every gain is the exact answer of its design problem, rounded once to f32.\n")?;
    write_imports(out, table)?;
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
    constant("Control period (s).", "TICK_S", "f32", &literal(Number::Float(table.tick_s)))?;
    constant("Number of states.", "STATES", "usize", &table.states().to_string())?;
    constant("Number of sensors.", "SENSORS", "usize", &table.sensors().to_string())?;
    writeln!(out, "/// The gain table.\npub static TABLE: GainTable<STATES, SENSORS> = GainTable {{")?;
    let mut writer = Writer { out, meanings: Meanings::of(rig, table), indent: 4 };
    for field in table.fields() {
        writer.field(&field)?;
    }
    let crc = hexadecimal(table.crc().into(), 2);
    writeln!(out, "    // CRC-32 of all values above.\n    crc: {crc},\n}};\n")?;
    match table.swing_up_fields() {
        Some((fields, crc)) => write_swing_up(out, table, &fields, crc),
        None => {
            writeln!(out, "/// This table has no swing-up.\npub type SwingUp = NoSwingUp;\n")?;
            writeln!(out, "/// The swing-up.\npub static SWING_UP: SwingUp = NoSwingUp;")
        }
    }
}

/// Writes the table of the swing-up, column by column, without rustfmt's line breaks.
fn write_swing_up(out: &mut String, table: &TableValues, fields: &[Field], crc: u32) -> core::fmt::Result {
    let links = table.sensors() - 1;
    writeln!(out, "/// The swing-up's table has knots for as long as each motion lasts.")?;
    writeln!(out, "pub type SwingUp = SwingUpTable<'static, SENSORS, {links}>;\n")?;
    writeln!(out, "/// The swing-up.\n#[rustfmt::skip]\npub static SWING_UP: SwingUp = SwingUpTable {{")?;
    let reference = MotionTable::reference_columns(table.states());
    let mut writer = Columns { out, reference, filter: table.states() * table.sensors(), indent: 4 };
    for field in fields {
        writer.field(field)?;
    }
    let crc = hexadecimal(crc.into(), 2);
    writeln!(out, "    // CRC-32 of all values above.\n    crc: {crc},\n}};")
}

/// Writes fields with one column of a motion or matrix per line.
struct Columns<'a> {
    out: &'a mut String,
    /// Number of columns of the field `reference`, and of `filter`.
    reference: usize,
    filter: usize,
    indent: usize,
}

impl Columns<'_> {
    fn line(&mut self, text: &str) -> core::fmt::Result {
        writeln!(self.out, "{:1$}{text}", "", self.indent)
    }

    fn body(&mut self, opening: &str, fields: &[Field]) -> core::fmt::Result {
        self.line(opening)?;
        self.indent += 4;
        fields.iter().try_for_each(|field| self.field(field))?;
        self.indent -= 4;
        self.line("},")
    }

    fn field(&mut self, field: &Field) -> core::fmt::Result {
        let Field { name, documentation, value } = field;
        for line in documentation {
            self.line(&format!("// {}", line.trim()))?;
        }
        let row = |numbers: &[Number]| -> String {
            numbers.iter().map(|&number| literal(number)).collect::<Vec<_>>().join(", ")
        };
        match value {
            Node::Value(number) => match *name {
                "format" => self.line("format: TABLE_FORMAT,"),
                "rig_hash" => self.line("rig_hash: RIG_HASH,"),
                "tick_s" => self.line("tick_s: TICK_S,"),
                name => self.line(&format!("{name}: {},", literal(*number))),
            },
            Node::List(numbers) => self.line(&format!("{name}: [{}],", row(numbers))),
            Node::Columns(columns) => {
                let columns: Vec<String> =
                    columns.iter().map(|column| format!("[{}]", row(column))).collect();
                self.line(&format!("{name}: columns([{}]),", columns.join(", ")))
            }
            Node::Slice(numbers) => {
                let columns = match *name {
                    "reference" => self.reference,
                    "filter" => self.filter,
                    _ => 1,
                };
                let knots = (numbers.len() / columns).max(1);
                self.line(&format!("{name}: &["))?;
                self.indent += 4;
                numbers.chunks(knots).try_for_each(|numbers| self.line(&format!("{},", row(numbers))))?;
                self.indent -= 4;
                self.line("],")
            }
            Node::Struct(kind, fields) => self.body(&format!("{name}: {kind} {{"), fields),
            Node::Structs(nodes) if nodes.is_empty() => self.line(&format!("{name}: &[],")),
            Node::Structs(nodes) => {
                self.line(&format!("{name}: &["))?;
                self.indent += 4;
                for node in nodes {
                    let Node::Struct(kind, fields) = node else { return Err(core::fmt::Error) };
                    self.body(&format!("{kind} {{"), fields)?;
                }
                self.indent -= 4;
                self.line("],")
            }
            Node::Optional(_) => Err(core::fmt::Error),
        }
    }
}

/// Writes the imports of the table, with rustfmt's order and line breaks.
fn write_imports(out: &mut String, table: &TableValues) -> core::fmt::Result {
    let names = [
        ("ChainModel", table.swing_up.is_some()),
        ("FrictionMap", table.friction.is_some()),
        ("GainTable", true),
        ("LawGains", true),
        ("Limits", true),
        ("MotionLimits", table.swing_up.is_some()),
        ("MotionTable", table.swing_up.is_some()),
        ("MotorMap", table.motor.is_some()),
        ("MotorTest", true),
        ("NoSwingUp", table.swing_up.is_none()),
        ("ObserverGains", table.observer.is_some()),
        ("PerLaw", true),
        ("SwingUpTable", table.swing_up.is_some()),
        ("TABLE_FORMAT", true),
        ("Thresholds", true),
        ("TransitionTable", table.swing_up.as_ref().is_some_and(|swing_up| !swing_up.others.is_empty())),
        ("columns", table.observer.is_some() || table.laws.present().next().is_some()),
    ];
    let used: Vec<&str> = names.into_iter().filter(|(_, used)| *used).map(|(name, _)| name).collect();
    let names = used.join(", ");
    let line = format!("use upright::table::{{{names}}};");
    if line.len() <= WIDTH {
        writeln!(out, "{line}\n")
    } else {
        writeln!(out, "use upright::table::{{\n{}\n}};\n", filled(&used))
    }
}

/// The names, as many per line as fit.
fn filled(names: &[&str]) -> String {
    let mut lines = vec!["   ".to_owned()];
    for name in names {
        match lines.last_mut() {
            Some(line) if line.len() + name.len() + 2 <= WIDTH => *line += &format!(" {name},"),
            _ => lines.push(format!("    {name},")),
        }
    }
    lines.join("\n")
}

/// rustfmt's longest line.
const WIDTH: usize = 110;

struct Writer<'a> {
    out: &'a mut String,
    meanings: Meanings,
    indent: usize,
}

impl Writer<'_> {
    fn line(&mut self, text: &str) -> core::fmt::Result {
        writeln!(self.out, "{:1$}{text}", "", self.indent)
    }

    /// Writes `lines` one level deeper.
    fn inside(&mut self, lines: impl FnOnce(&mut Self) -> core::fmt::Result) -> core::fmt::Result {
        self.indent += 4;
        lines(self)?;
        self.indent -= 4;
        Ok(())
    }

    fn field(&mut self, field: &Field) -> core::fmt::Result {
        let Field { name, documentation, value } = field;
        for line in documentation {
            self.line(&format!("// {}", line.trim()))?;
        }
        match value {
            Node::Value(number) => match *name {
                "format" => self.line("format: TABLE_FORMAT,"),
                "rig_hash" => self.line("rig_hash: RIG_HASH,"),
                "tick_s" => self.line("tick_s: TICK_S,"),
                name => self.line(&format!("{name}: {},", literal(*number))),
            },
            Node::List(numbers) if self.meanings.entry(name, 0).is_none() => {
                let numbers: Vec<String> = numbers.iter().map(|&number| literal(number)).collect();
                self.line(&format!("{name}: [{}],", numbers.join(", ")))
            }
            Node::List(numbers) => {
                self.line(&format!("{name}: ["))?;
                self.inside(|writer| writer.entries(name, numbers))?;
                self.line("],")
            }
            Node::Columns(columns) => self.columns(name, columns),
            // A gain table has none.
            Node::Slice(_) | Node::Structs(_) => Err(core::fmt::Error),
            Node::Struct(kind, fields) => self.body(name, &format!("{kind} {{"), fields, "},"),
            Node::Optional(None) => self.line(&format!("{name}: None,")),
            Node::Optional(Some(node)) => match &**node {
                Node::Struct(kind, fields) => self.body(name, &format!("Some({kind} {{"), fields, "}),"),
                _ => Err(core::fmt::Error),
            },
        }
    }

    fn body(&mut self, name: &str, opening: &str, fields: &[Field], closing: &str) -> core::fmt::Result {
        self.line(&format!("{name}: {opening}"))?;
        self.inside(|writer| fields.iter().try_for_each(|field| writer.field(field)))?;
        self.line(closing)
    }

    fn columns(&mut self, name: &str, columns: &[Vec<Number>]) -> core::fmt::Result {
        if !self.meanings.has_columns(name) {
            self.line(&format!("{name}: columns([["))?;
            self.inside(|writer| columns.iter().try_for_each(|column| writer.entries(name, column)))?;
            return self.line("]]),");
        }
        self.line(&format!("{name}: columns(["))?;
        self.inside(|writer| {
            for (index, column) in columns.iter().enumerate() {
                let meaning = writer.meanings.column(name, index);
                writer.line(&format!("// {meaning}"))?;
                writer.line("[")?;
                writer.inside(|writer| writer.entries(name, column))?;
                writer.line("],")?;
            }
            Ok(())
        })?;
        self.line("]),")
    }

    /// Writes an array with one value per line, under a comment that says what it is.
    fn entries(&mut self, name: &str, numbers: &[Number]) -> core::fmt::Result {
        for (index, &number) in numbers.iter().enumerate() {
            let meaning = self.meanings.entry(name, index).unwrap_or_default();
            self.line(&format!("// {meaning}"))?;
            self.line(&format!("{},", literal(number)))?;
        }
        Ok(())
    }
}

/// Meanings of the entries of vectors and matrices.
struct Meanings {
    /// Each state, and the unit of a gain on it.
    states: Vec<(String, &'static str)>,
    /// Which state each sensor measures.
    measured: Vec<usize>,
}

impl Meanings {
    fn of(rig: &Rig, table: &TableValues) -> Self {
        let states = match &rig.plant {
            PlantDescription::Chain(chain) => {
                let cart = [("cart position".to_owned(), "N/m"), ("cart speed".to_owned(), "N s/m")];
                let links = (1..=chain.links.len()).flat_map(|link| {
                    [
                        (format!("angle of link {link}"), "N/rad"),
                        (format!("angular rate of link {link}"), "N s/rad"),
                    ]
                });
                cart.into_iter().chain(links).collect()
            }
            PlantDescription::Model(model) => {
                (0..model.b.len()).map(|state| (format!("state {state}"), "input/state")).collect()
            }
        };
        Self { states, measured: table.measured() }
    }

    fn state(&self, index: usize) -> &str {
        self.states.get(index).map_or("", |(name, _)| name)
    }

    fn sensor(&self, index: usize) -> &str {
        self.measured.get(index).map_or("", |&state| self.state(state))
    }

    /// What an entry of the field means; none for a field whose documentation already says it.
    fn entry(&self, field: &str, index: usize) -> Option<String> {
        const ERROR: [&str; 4] =
            ["position from position", "position from speed", "speed from position", "speed from speed"];
        const FRICTION: [&str; 4] =
            ["largest", "per rate", "force with the LQR", "force with pole placement"];
        Some(match field {
            "rail_m" | "travel_counts" | "measured" | "b" => return None,
            "k" => self.states.get(index).map_or(String::new(), |(name, unit)| format!("{unit}: {name}")),
            "ad" | "bd" | "l" | "effect" => format!("to {}", self.state(index)),
            "axes" => FRICTION.get(index).copied().unwrap_or_default().to_owned(),
            "a" => ERROR.get(index).copied().unwrap_or_default().to_owned(),
            "step" => format!("sensor of {}", self.sensor(index)),
            _ => self.sensor(index).to_owned(),
        })
    }

    /// Whether the field is a matrix.
    fn has_columns(&self, field: &str) -> bool {
        matches!(field, "ad" | "l" | "effect" | "axes")
    }

    fn column(&self, field: &str, index: usize) -> String {
        match field {
            "l" => format!("from the sensor of {}", self.sensor(index)),
            "effect" | "axes" => format!("friction in {}", self.sensor(index)),
            _ => format!("from {}", self.state(index)),
        }
    }
}

/// The shortest decimal that reads back as the same number.
fn literal(number: Number) -> String {
    match number {
        Number::Float(value) => format!("{value:?}"),
        Number::Integer(value) => value.to_string(),
        Number::Hash(value) => hexadecimal(value, 4),
    }
}

/// Hexadecimal, in groups of four digits.
fn hexadecimal(value: u64, groups: usize) -> String {
    let groups: Vec<String> =
        (0..groups).rev().map(|i| format!("{:04x}", value >> (16 * i) & 0xffff)).collect();
    format!("0x{}", groups.join("_"))
}
