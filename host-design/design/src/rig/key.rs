//! The keys of a rig file, one row each. Reading, `upright check`, the documentation and its test all use these rows.

use std::fmt;

use super::rule::Rule;

/// One key of a rig file.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// The name in the file, which ends in the unit: `arm_rate_rad_per_s`.
    pub name: &'static str,
    /// The unit as usually written, `rad/s`; empty if there is none.
    pub unit: &'static str,
    /// What is accepted.
    pub rule: Rule,
    /// What the key means: completes "give the …" and opens a row of the documentation.
    pub meaning: &'static str,
    /// What applies if the file leaves the key out.
    pub absent: Absent,
}

/// What applies if the file leaves out a key or a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Absent {
    /// It is required.
    Required,
    /// It is required under a condition, such as "unless poles are given".
    RequiredIf(&'static str),
    /// The default numbers: one, or both of a pair.
    Numbers(&'static [f64]),
    /// A default that follows from other values, in words.
    Follows(&'static str),
}

/// A section of a rig file: `[limits]`, `[[link]]`.
#[derive(Debug)]
pub struct Section {
    /// The name without brackets; empty for the top of the file.
    pub name: &'static str,
    /// The section as written in the file, with brackets.
    pub title: &'static str,
    /// What the section is about.
    pub meaning: &'static str,
    /// What applies without the section.
    pub absent: Absent,
    /// Its keys in groups, one per `keys!` structure.
    pub keys: &'static [&'static [Key]],
}

impl Key {
    /// The words of the name without its unit: `arm rate`. Empty if the name is only a unit.
    pub(super) fn label(&self) -> String {
        let words = self.name.strip_suffix(&unit_in_names(self.unit)).unwrap_or(self.name);
        words.trim_end_matches('_').replace('_', " ")
    }
}

/// A unit as key names write it: `rad_per_s` for `rad/s`.
pub fn unit_in_names(unit: &str) -> String {
    let words = [
        ("(", ""),
        (")", ""),
        ("·", "_"),
        ("/", "_per_"),
        ("²", "2"),
        ("³", "3"),
        ("Ω", "ohm"),
        ("%", "percent"),
        ("°", "deg"),
    ];
    words.iter().fold(unit.to_lowercase(), |name, (symbol, word)| name.replace(&symbol.to_lowercase(), word))
}

impl Section {
    /// All keys, in the order of the documentation.
    pub fn keys(&self) -> impl Iterator<Item = &'static Key> + use<> {
        self.keys.iter().copied().flatten()
    }

    /// The row of the key `name`.
    ///
    /// # Panics
    ///
    /// If the section has no such key, which is a bug in the calling code.
    pub(super) fn key(&self, name: &str) -> &'static Key {
        let key = self.keys().find(|key| key.name == name);
        key.unwrap_or_else(|| panic!("{} has no row for the key {name}", self.title))
    }

    /// What to give for a key, and the alternative: completes "give" and "add".
    pub(super) fn asks_for(&self, key: &Key) -> String {
        let unit = if key.unit.is_empty() { String::new() } else { format!(", in {}", key.unit) };
        let otherwise = match (key.absent, self.absent) {
            (Absent::Required, Absent::Numbers(_) | Absent::Follows(_)) => {
                format!(", or leave {} out", self.title)
            }
            (Absent::Required, _) => String::new(),
            (Absent::RequiredIf(_), _) => format!(" ({})", key.absent),
            (Absent::Numbers(_) | Absent::Follows(_), _) => format!(", or leave it out for {}", key.absent),
        };
        format!("the {}{unit}{otherwise}", key.meaning)
    }
}

impl fmt::Display for Absent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Absent::Required => f.write_str("required"),
            Absent::RequiredIf(condition) => write!(f, "required {condition}"),
            Absent::Numbers([number]) => write!(f, "{number}"),
            Absent::Numbers(numbers) => {
                let all: Vec<_> = numbers.iter().map(f64::to_string).collect();
                write!(f, "[{}]", all.join(", "))
            }
            Absent::Follows(words) => f.write_str(words),
        }
    }
}
