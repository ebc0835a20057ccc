//! The values of a TOML document, each with its full key and its place, so that an error can name both.

use std::ops::Range;
use std::path::Path;

use toml_edit::{ArrayOfTables, Document, Item, TableLike, Value};

use super::base::Base;
use super::error::{Place, RigError, RigErrorKind};
use super::key::{Key, Section};
use super::rule::Rule;

/// A rig file's text and name.
#[derive(Debug, Clone, Copy)]
pub(super) struct RigSource<'a> {
    /// Name of the file, as printed in errors.
    pub(super) file: &'a Path,
    /// Its text.
    pub(super) text: &'a str,
    /// What carries the links of its machine, after which keys and messages are named.
    pub(super) base: Base,
}

impl<'a> RigSource<'a> {
    /// An error at a byte offset.
    pub(super) fn error(&self, offset: usize, key: Option<String>, kind: RigErrorKind) -> RigError {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        let line_start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |newline| newline + 1);
        let place = Place {
            line: before.iter().filter(|&&byte| byte == b'\n').count() + 1,
            column: String::from_utf8_lossy(&before[line_start..]).chars().count() + 1,
        };
        let kind = Box::new(kind.worded(&|text| self.base.words(text)));
        RigError { file: self.file.to_owned(), place: Some(place), key, kind }
    }

    /// Parses the document; an error says where it stops being TOML.
    pub(super) fn document(&self) -> Result<Document<&'a str>, RigError> {
        Document::parse(self.text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            if error.message().starts_with("duplicate key") {
                let key = self.text.get(span.clone()).map(excerpt);
                return self.error(span.start, key, RigErrorKind::Duplicate);
            }
            if let Some(format) = other_format(self.text) {
                return self.error(0, None, RigErrorKind::OtherFormat { format });
            }
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            self.error(span.start, self.key_before(span.start), RigErrorKind::NotToml { message })
        })
    }

    /// The key that precedes a byte offset on its line, if there is one.
    fn key_before(&self, offset: usize) -> Option<String> {
        let (key, _) = self.text.get(..offset)?.rsplit('\n').next()?.split_once('=')?;
        let key = key.trim();
        let is_bare = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        (!key.is_empty() && key.chars().all(is_bare)).then(|| excerpt(key))
    }
}

/// The format of a text that other programs describe machines in.
fn other_format(text: &str) -> Option<&'static str> {
    let formats = [("<robot", "URDF"), ("<sdf", "SDF"), ("<mujoco", "MJCF")];
    match text.trim_start_matches('\u{feff}').trim_start().chars().next()? {
        '<' => Some(formats.iter().find(|(tag, _)| text.contains(tag)).map_or("XML", |&(_, format)| format)),
        '{' => Some("JSON"),
        _ => None,
    }
}

/// A piece of the user's text, short and on one line.
pub(super) fn excerpt(text: &str) -> String {
    const LONGEST: usize = 40;
    let escape = |part: &str| part.escape_debug().to_string().replace("\\\"", "\"").replace("\\'", "'");
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", escape(&text[..end])),
        None => escape(text),
    }
}

/// What a key holds.
#[derive(Clone, Copy)]
enum RigItem<'a> {
    Table(&'a dyn TableLike),
    Tables(&'a ArrayOfTables),
    Value(&'a Value),
}

/// A value with its key and place.
#[derive(Clone)]
pub(super) struct Node<'a> {
    source: &'a RigSource<'a>,
    /// Full key, such as `link[2].mass_kg`.
    pub(super) key: String,
    span: Range<usize>,
    found: RigItem<'a>,
}

impl<'a> Node<'a> {
    /// An error about this value.
    pub(super) fn error(&self, kind: RigErrorKind) -> RigError {
        self.source.error(self.span.start, Some(self.key.clone()), kind)
    }

    /// The value as written in the file.
    pub(super) fn as_written(&self) -> String {
        match self.found {
            RigItem::Table(_) => "a table".to_owned(),
            RigItem::Tables(_) => "a list of tables".to_owned(),
            RigItem::Value(value) => {
                let text = excerpt(self.source.text.get(self.span.clone()).unwrap_or_default());
                format!("{text} ({})", value.type_name())
            }
        }
    }

    /// An error saying that this value is of another type.
    pub(super) fn wrong_type(&self, accepts: &str, remedy: &str) -> RigError {
        self.error(RigErrorKind::WrongType {
            found: self.as_written(),
            accepts: accepts.to_owned(),
            remedy: remedy.to_owned(),
        })
    }

    /// An error saying that this value is outside what is accepted.
    pub(super) fn out_of_range(&self, accepts: &str, remedy: &str) -> RigError {
        let found = self.source.text.get(self.span.clone()).map(excerpt).unwrap_or_default();
        self.error(RigErrorKind::OutOfRange { found, accepts: accepts.to_owned(), remedy: remedy.to_owned() })
    }

    /// A number, integers included. `meaning` completes "give ...".
    pub(super) fn number(&self, rule: Rule, meaning: &str) -> Result<f64, RigError> {
        let remedy = format!("give {meaning}");
        let value = match self.found {
            // Rounds beyond 2^53, which the bound below rejects anyway.
            RigItem::Value(Value::Integer(integer)) => *integer.value() as f64,
            RigItem::Value(Value::Float(float)) => *float.value(),
            _ => return Err(self.wrong_type(rule.accepts, &remedy)),
        };
        if !value.is_finite() {
            let found = self.source.text.get(self.span.clone()).map(excerpt).unwrap_or_default();
            return Err(self.error(RigErrorKind::NotFinite { found, remedy }));
        }
        if !Rule::SANE.admits(&[value]) {
            return Err(self.out_of_range(Rule::SANE.accepts, &remedy));
        }
        if !rule.admits(&[value]) {
            return Err(self.out_of_range(rule.accepts, &remedy));
        }
        // Adding zero turns -0.0 into 0.0: the two are equal and must have the same hash.
        Ok(value + 0.0)
    }

    /// An integer from 0 to `last`.
    pub(super) fn index(&self, last: usize, accepts: &str, meaning: &str) -> Result<usize, RigError> {
        let remedy = format!("give {meaning}");
        let RigItem::Value(Value::Integer(integer)) = self.found else {
            return Err(self.wrong_type(accepts, &remedy));
        };
        usize::try_from(*integer.value())
            .ok()
            .filter(|&index| index <= last)
            .ok_or_else(|| self.out_of_range(accepts, &remedy))
    }

    /// A string.
    pub(super) fn text(&self, accepts: &str, meaning: &str) -> Result<&'a str, RigError> {
        match self.found {
            RigItem::Value(Value::String(text)) => Ok(text.value()),
            _ => Err(self.wrong_type(accepts, &format!("give {meaning}"))),
        }
    }

    /// The index of the string among those accepted.
    pub(super) fn one_of(&self, accepted: [&str; 2], meaning: &str) -> Result<usize, RigError> {
        let accepts = accepted.map(|word| format!("\"{word}\"")).join(" or ");
        let text = self.text(&accepts, meaning)?;
        let index = accepted.iter().position(|&word| word == text);
        index.ok_or_else(|| self.out_of_range(&accepts, &format!("give {meaning}")))
    }

    /// Whether the value is a list of values.
    pub(super) fn is_list(&self) -> bool {
        matches!(self.found, RigItem::Value(Value::Array(_)))
    }

    /// The entries of a list, keyed `key[1]`, `key[2]`, ...
    pub(super) fn list(&self, accepts: &str, meaning: &str) -> Result<Vec<Node<'a>>, RigError> {
        let entry = |(index, span, found): (usize, Option<Range<usize>>, RigItem<'a>)| Node {
            source: self.source,
            key: format!("{}[{}]", self.key, index + 1),
            span: span.unwrap_or_else(|| self.span.clone()),
            found,
        };
        match self.found {
            RigItem::Tables(tables) => Ok(tables
                .iter()
                .enumerate()
                .map(|(index, table)| entry((index, table.span(), RigItem::Table(table))))
                .collect()),
            RigItem::Value(Value::Array(array)) => Ok(array
                .iter()
                .enumerate()
                .map(|(index, value)| entry((index, value.span(), of_value(value))))
                .collect()),
            _ => Err(self.wrong_type(accepts, &format!("give {meaning}"))),
        }
    }

    /// A list of exactly `length` numbers.
    pub(super) fn numbers(&self, length: usize, rule: Rule, meaning: &str) -> Result<Vec<f64>, RigError> {
        let entries = self.list(&format!("a list of {length} numbers"), meaning)?;
        if entries.len() != length {
            return Err(self.wrong_length(entries.len(), &format!("{length}"), meaning));
        }
        entries.iter().map(|entry| entry.number(rule, meaning)).collect()
    }

    /// An error saying that this list has the wrong number of entries.
    pub(super) fn wrong_length(&self, found: usize, accepts: &str, meaning: &str) -> RigError {
        self.error(RigErrorKind::WrongLength {
            found,
            accepts: accepts.to_owned(),
            remedy: format!("give {meaning}"),
        })
    }

    /// A table that holds keys of `section` only.
    pub(super) fn table(&self, section: &'static Section) -> Result<Table<'a>, RigError> {
        let RigItem::Table(table) = self.found else {
            let remedy = format!("write it as [{0}] with its keys below", self.key);
            return Err(self.wrong_type("a table", &remedy));
        };
        let table =
            Table { source: self.source, section, key: self.key.clone(), start: self.span.start, table };
        table.only(&table.keys().map(|key| key.name).collect::<Vec<_>>())?;
        Ok(table)
    }
}

fn of_value(value: &Value) -> RigItem<'_> {
    match value {
        Value::InlineTable(table) => RigItem::Table(table),
        other => RigItem::Value(other),
    }
}

/// A table of the file with its key and place.
pub(super) struct Table<'a> {
    source: &'a RigSource<'a>,
    pub(super) section: &'static Section,
    key: String,
    start: usize,
    table: &'a dyn TableLike,
}

impl<'a> Table<'a> {
    /// The document itself, with the keys of `section` and the sections of these names.
    pub(super) fn root(
        source: &'a RigSource<'a>,
        document: &'a Document<&'a str>,
        section: &'static Section,
        sections: &[&str],
    ) -> Result<Self, RigError> {
        let root = Table { source, section, key: String::new(), start: 0, table: document.as_table() };
        let sections = sections.iter().map(|name| source.base.name(section.name, name));
        let keys: Vec<_> = section.keys().map(|key| key.name).chain(sections).collect();
        root.only(&keys)?;
        Ok(root)
    }

    /// Rejects keys that are not known. Called first, so that a misspelt key is not reported as a missing one.
    fn only(&self, known: &[&str]) -> Result<(), RigError> {
        let Some((name, _)) = self.table.iter().find(|(name, _)| !known.contains(name)) else {
            return Ok(());
        };
        let closeness = |candidate: &str| strsim::jaro_winkler(candidate, name);
        let suggestion = known
            .iter()
            .filter(|candidate| name.len() <= 64 && closeness(candidate) >= 0.8)
            .max_by(|a, b| closeness(a).total_cmp(&closeness(b)))
            .map(|candidate| (*candidate).to_owned());
        let start = self.table.key(name).and_then(|key| key.span()).map_or(self.start, |span| span.start);
        let kind = RigErrorKind::UnknownKey { suggestion, accepts: known.join(", ") };
        Err(self.source.error(start, Some(self.full_key(&excerpt(name))), kind))
    }

    fn full_key(&self, name: &str) -> String {
        if self.key.is_empty() { name.to_owned() } else { format!("{}.{name}", self.key) }
    }

    /// The keys that a file with its base has in this section.
    fn keys(&self) -> impl Iterator<Item = Key> {
        let (base, section) = (self.source.base, self.section);
        let own = section.keys().filter(move |key| base.has(section, key.name));
        own.map(move |key| base.key(section, key.name))
    }

    /// What carries the links of this file's machine.
    pub(super) fn base(&self) -> Base {
        self.source.base
    }

    /// The row of a key, for the base of this file.
    pub(super) fn key(&self, name: &str) -> Key {
        self.source.base.key(self.section, name)
    }

    /// The value of a key, if given. Keys are called as in a file with a cart.
    pub(super) fn get(&self, name: &str) -> Option<Node<'a>> {
        let name = self.source.base.name(self.section.name, name);
        let (key, item) = self.table.get_key_value(name)?;
        let found = match item {
            Item::Table(table) => RigItem::Table(table),
            Item::ArrayOfTables(tables) => RigItem::Tables(tables),
            Item::Value(value) => of_value(value),
            Item::None => return None,
        };
        // Tables that only dotted keys imply have no place of their own.
        let span = item.span().or_else(|| key.span()).unwrap_or(self.start..self.start);
        Some(Node { source: self.source, key: self.full_key(name), span, found })
    }

    /// An error saying that a key is missing. `remedy` completes "add".
    pub(super) fn missing(&self, name: &str, remedy: &str) -> RigError {
        let (remedy, name) = (remedy.to_owned(), self.source.base.name(self.section.name, name));
        self.source.error(self.start, Some(self.full_key(name)), RigErrorKind::MissingKey { remedy })
    }

    /// What to give for a key: completes "give" and "add".
    pub(super) fn asks_for(&self, name: &str) -> String {
        self.section.asks_for(&self.key(name))
    }

    /// The value of a key or section that must be given. `remedy` completes "add".
    pub(super) fn need(&self, name: &str, remedy: &str) -> Result<Node<'a>, RigError> {
        self.get(name).ok_or_else(|| self.missing(name, remedy))
    }

    /// The value of a required key, of any type.
    pub(super) fn required(&self, name: &str) -> Result<Node<'a>, RigError> {
        self.need(name, &self.asks_for(name))
    }

    /// A list of exactly `length` numbers that must be given.
    pub(super) fn numbers(&self, name: &str, length: usize, entries: Rule) -> Result<Vec<f64>, RigError> {
        self.required(name)?.numbers(length, entries, &self.asks_for(name))
    }

    /// Rejects two keys that exclude each other; the error points to the second.
    pub(super) fn not_both(&self, first: &str, second: &str, remedy: &str) -> Result<(), RigError> {
        match (self.get(first), self.get(second)) {
            (Some(first), Some(second)) => {
                Err(second.error(RigErrorKind::Conflict { other: first.key, remedy: remedy.to_owned() }))
            }
            _ => Ok(()),
        }
    }
}
