//! A table's names and values as a tree: the common source of everything that writes a table.

use serde::ser::{Serialize, SerializeMap, Serializer};
use upright::table::checksum::crc32;
use upright::table::{Part, Reader, Shape, Variant, Words};

use super::any_size::{MAX_SENSORS, MAX_STATES, WidestTable};

/// A value of the tree.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum TableNode {
    /// A number.
    Value(TableNumber),
    /// An array.
    List(Vec<TableNumber>),
    /// A list whose length is not part of its type.
    Slice(Vec<TableNumber>),
    /// A matrix, column by column.
    Columns(Vec<Vec<TableNumber>>),
    /// A struct.
    Struct(&'static str, Vec<Field>),
    /// A variant of an enum, as it is written in Rust, with what it holds.
    Variant(Variant, Option<Box<TableNode>>),
    /// An array of structs.
    Rows(Vec<TableNode>),
    /// A list of structs whose length is not part of its type.
    Structs(Vec<TableNode>),
}

/// A field of a struct.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) documentation: Vec<&'static str>,
    pub(super) value: TableNode,
}

/// A number of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TableNumber {
    Float(f32),
    Integer(i64),
    Hash(u64),
}

/// The fields of a table, in the order of their declaration.
pub(super) fn fields(table: &impl Part) -> Vec<Field> {
    let mut builder = Builder::default();
    table.read(&mut builder);
    builder.fields()
}

/// As [`fields`], without the entries of states and sensors that the table does not have.
///
/// Nothing else in a table has as many entries as there are states or sensors at most, so that its length in the widest
/// table tells what a list or a matrix has entries for.
pub(super) fn in_use(widest: &WidestTable, states: usize, sensors: usize) -> Vec<Field> {
    let length = |widest: usize| match widest {
        MAX_STATES => states,
        MAX_SENSORS => sensors,
        other => other,
    };
    let mut fields = fields(widest);
    fields.iter_mut().for_each(|field| trim(&mut field.value, &length));
    fields
}

fn trim(node: &mut TableNode, length: &dyn Fn(usize) -> usize) {
    match node {
        TableNode::List(numbers) => numbers.truncate(length(numbers.len())),
        TableNode::Columns(columns) => {
            columns.truncate(length(columns.len()));
            columns.iter_mut().for_each(|column| column.truncate(length(column.len())));
        }
        TableNode::Struct(_, fields) => fields.iter_mut().for_each(|field| trim(&mut field.value, length)),
        TableNode::Variant(_, node) => node.iter_mut().for_each(|node| trim(node, length)),
        TableNode::Rows(rows) => rows.truncate(length(rows.len())),
        TableNode::Structs(nodes) => nodes.iter_mut().for_each(|node| trim(node, length)),
        TableNode::Value(_) | TableNode::Slice(_) => {}
    }
}

/// The checksum of a table with these fields: that of its words, as the firmware computes it.
pub(super) fn checksum(fields: &[Field]) -> u32 {
    crc32(0, &all_bytes(fields))
}

/// Bytes of the words of these fields.
pub(super) fn bytes(fields: &[Field]) -> usize {
    all_bytes(fields).len()
}

/// The words of these fields in the order of declaration.
pub(super) fn words(fields: &[Field]) -> Vec<u32> {
    all_bytes(fields).as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// The same, the low byte first.
fn all_bytes(fields: &[Field]) -> Vec<u8> {
    fields.iter().flat_map(|field| bytes_of(&field.value)).collect()
}

/// The words of `node`. A variant is one word, its number, and the words of what it holds.
fn bytes_of(node: &TableNode) -> Vec<u8> {
    let of = |numbers: &[TableNumber]| numbers.iter().flat_map(TableNumber::bytes).collect();
    match node {
        TableNode::Value(number) => number.bytes(),
        TableNode::List(numbers) | TableNode::Slice(numbers) => of(numbers),
        TableNode::Columns(columns) => of(&columns.concat()),
        TableNode::Struct(_, fields) => all_bytes(fields),
        TableNode::Variant(Variant { number, .. }, node) => {
            number.to_le_bytes().into_iter().chain(node.iter().flat_map(|node| bytes_of(node))).collect()
        }
        TableNode::Rows(nodes) | TableNode::Structs(nodes) => nodes.iter().flat_map(bytes_of).collect(),
    }
}

#[derive(Default)]
struct Builder {
    /// Open structs, innermost last.
    open: Vec<(&'static str, Vec<Field>)>,
    /// Fields still without a value, each with its variant if that holds the value; innermost last.
    waiting: Vec<(&'static str, Vec<&'static str>, Option<Variant>)>,
    /// Open lists of structs, innermost last: the number of structs that are open around the list, the number of its
    /// structs that are still missing, those that are complete, and what the list is.
    lists: Vec<(usize, usize, Vec<TableNode>, Shape)>,
    done: Option<TableNode>,
}

impl Builder {
    fn fields(self) -> Vec<Field> {
        match self.done {
            Some(TableNode::Struct(_, fields)) => fields,
            _ => Vec::new(),
        }
    }

    fn value(&mut self, node: TableNode) {
        if let Some((depth, missing, nodes, _)) = self.lists.last_mut()
            && *depth == self.open.len()
            && *missing > 0
        {
            nodes.push(node);
            *missing -= 1;
            self.complete_list();
            return;
        }
        let (Some((_, fields)), Some((name, documentation, variant))) =
            (self.open.last_mut(), self.waiting.pop())
        else {
            self.done = Some(node);
            return;
        };
        let value = match variant {
            Some(variant) => TableNode::Variant(variant, Some(Box::new(node))),
            None => node,
        };
        fields.push(Field { name, documentation, value });
    }

    /// Passes the innermost list on as the value of its field, once all of its structs are there.
    fn complete_list(&mut self) {
        if let Some((_, _, nodes, shape)) = self.lists.pop_if(|(_, missing, ..)| *missing == 0) {
            let is_array = shape == Shape::List;
            self.value(if is_array { TableNode::Rows(nodes) } else { TableNode::Structs(nodes) });
        }
    }
}

impl Reader for Builder {
    fn begin(&mut self, name: &'static str) {
        self.open.push((name, Vec::new()));
    }

    fn field(&mut self, name: &'static str, documentation: &[&'static str]) {
        self.waiting.push((name, documentation.to_vec(), None));
    }

    fn words(&mut self, words: Words<'_>, shape: Shape) {
        let numbers: Vec<TableNumber> = match words {
            Words::F32(values) => values.iter().map(|&value| TableNumber::Float(value)).collect(),
            Words::U32(values) => values.iter().map(|&value| TableNumber::Integer(value.into())).collect(),
            Words::I32(values) => values.iter().map(|&value| TableNumber::Integer(value.into())).collect(),
            Words::I16(values) => values.iter().map(|&value| TableNumber::Integer(value.into())).collect(),
            Words::U64(value) => vec![TableNumber::Hash(*value)],
        };
        self.value(match shape {
            Shape::Value => TableNode::Value(numbers[0]),
            Shape::List => TableNode::List(numbers),
            Shape::Slice => TableNode::Slice(numbers),
            Shape::Columns { rows } => TableNode::Columns(numbers.chunks(rows).map(<[_]>::to_vec).collect()),
        });
    }

    fn variant(&mut self, variant: Variant) {
        match self.waiting.last_mut() {
            Some((_, _, waiting)) if variant.has_value => *waiting = Some(variant),
            _ => self.value(TableNode::Variant(variant, None)),
        }
    }

    fn list(&mut self, length: usize, shape: Shape) {
        self.lists.push((self.open.len(), length, Vec::new(), shape));
        self.complete_list();
    }

    fn end(&mut self) {
        if let Some((name, fields)) = self.open.pop() {
            self.value(TableNode::Struct(name, fields));
        }
    }
}

impl TableNumber {
    /// Its words, the low byte first.
    fn bytes(&self) -> Vec<u8> {
        match *self {
            TableNumber::Float(value) => value.to_le_bytes().to_vec(),
            TableNumber::Integer(value) => (value as u32).to_le_bytes().to_vec(),
            TableNumber::Hash(value) => value.to_le_bytes().to_vec(),
        }
    }
}

/// As JSON: a vector is an array, a matrix is an array of its rows, a missing struct is null, and a variant is its
/// name, or an object of its name and what it holds.
impl Serialize for TableNode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            TableNode::Value(number) => number.serialize(serializer),
            TableNode::List(numbers) | TableNode::Slice(numbers) => serializer.collect_seq(numbers),
            TableNode::Columns(columns) => match columns.as_slice() {
                [column] => serializer.collect_seq(column),
                columns => {
                    let rows = columns.first().map_or(0, Vec::len);
                    let row = |row: usize| columns.iter().map(|column| column[row]).collect::<Vec<_>>();
                    serializer.collect_seq((0..rows).map(row))
                }
            },
            TableNode::Struct(_, fields) => object(fields.iter(), serializer),
            TableNode::Variant(Variant { name: "Some" | "None", .. }, node) => node.serialize(serializer),
            TableNode::Variant(variant, None) => serializer.serialize_str(variant.last_name()),
            TableNode::Variant(variant, Some(node)) => serializer.collect_map([(variant.last_name(), node)]),
            TableNode::Rows(nodes) | TableNode::Structs(nodes) => serializer.collect_seq(nodes),
        }
    }
}

impl Serialize for TableNumber {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            TableNumber::Float(value) => serializer.serialize_f32(value),
            TableNumber::Integer(value) => serializer.serialize_i64(value),
            TableNumber::Hash(value) => serializer.collect_str(&format_args!("{value:016x}")),
        }
    }
}

/// The fields as a JSON object; the laws are entries beside the other fields.
pub(super) fn object<'a, S: Serializer>(
    fields: impl Iterator<Item = &'a Field>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut object = serializer.serialize_map(None)?;
    for field in fields {
        match &field.value {
            TableNode::Struct("PerLaw", laws) => {
                for law in laws {
                    object.serialize_entry(law.name, &law.value)?;
                }
            }
            value => object.serialize_entry(field.name, value)?,
        }
    }
    object.end()
}
