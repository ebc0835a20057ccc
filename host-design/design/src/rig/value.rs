//! The types that keys of a rig file fill, and the structures of scalar keys.

use super::error::RigError;
use super::key::{Absent, Key};
use super::node::{Node, Table};
use super::rule::Rule;

/// A type that one key of a rig file fills: `f64`, `Option<f64>`, `u8`, or a pair.
pub(super) trait Value: Sized {
    /// Reads the value, or says why it is not accepted. `asks_for` completes "give".
    fn read(node: &Node<'_>, rule: Rule, asks_for: &str) -> Result<Self, RigError>;

    /// The value of a key that the file leaves out; none if it is required.
    fn when_absent(absent: Absent) -> Option<Self>;

    /// The numbers of the value: none for one that was left out.
    fn numbers(&self) -> Vec<f64>;
}

impl Value for f64 {
    fn read(node: &Node<'_>, rule: Rule, asks_for: &str) -> Result<Self, RigError> {
        node.number(rule, asks_for)
    }

    fn when_absent(absent: Absent) -> Option<Self> {
        match absent {
            Absent::Numbers(&[number]) => Some(number),
            _ => None,
        }
    }

    fn numbers(&self) -> Vec<f64> {
        vec![*self]
    }
}

impl Value for Option<f64> {
    fn read(node: &Node<'_>, rule: Rule, asks_for: &str) -> Result<Self, RigError> {
        node.number(rule, asks_for).map(Some)
    }

    fn when_absent(_: Absent) -> Option<Self> {
        Some(None)
    }

    fn numbers(&self) -> Vec<f64> {
        self.iter().copied().collect()
    }
}

impl Value for u8 {
    fn read(node: &Node<'_>, rule: Rule, asks_for: &str) -> Result<Self, RigError> {
        let whole = node.index(usize::from(u8::MAX), rule.accepts, asks_for)?;
        let admitted = u8::try_from(whole).ok().filter(|&whole| rule.admits(&[f64::from(whole)]));
        admitted.ok_or_else(|| node.out_of_range(rule.accepts, &format!("give {asks_for}")))
    }

    fn when_absent(absent: Absent) -> Option<Self> {
        f64::when_absent(absent).map(|number| number as u8)
    }

    fn numbers(&self) -> Vec<f64> {
        vec![f64::from(*self)]
    }
}

/// A quantity of the joints: one number shared by all of them, or one number per joint.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PerJoint(Vec<f64>);

impl PerJoint {
    /// The same number for every joint.
    pub fn all(number: f64) -> Self {
        Self(vec![number])
    }

    /// One number per joint, from the cart outwards.
    pub fn each(numbers: Vec<f64>) -> Self {
        Self(numbers)
    }

    /// The number of joint `joint`, counted from 0.
    pub fn of_joint(&self, joint: usize) -> f64 {
        self.0.get(joint).or(self.0.first()).copied().unwrap_or_default()
    }

    /// Every number with `more` added.
    pub fn plus(&self, more: f64) -> Self {
        Self(self.0.iter().map(|number| number + more).collect())
    }

    /// Whether any joint has a number other than 0.
    pub fn is_any(&self) -> bool {
        self.0.iter().any(|&number| number != 0.0)
    }
}

impl Value for PerJoint {
    fn read(node: &Node<'_>, rule: Rule, asks_for: &str) -> Result<Self, RigError> {
        if !node.is_list() {
            return Ok(Self::all(node.number(rule, asks_for)?));
        }
        let entries = node.list(rule.accepts, asks_for)?;
        entries.iter().map(|entry| entry.number(rule, asks_for)).collect::<Result<_, _>>().map(Self)
    }

    fn when_absent(absent: Absent) -> Option<Self> {
        f64::when_absent(absent).map(Self::all)
    }

    fn numbers(&self) -> Vec<f64> {
        self.0.clone()
    }
}

impl Value for [f64; 2] {
    fn read(node: &Node<'_>, rule: Rule, asks_for: &str) -> Result<Self, RigError> {
        match node.numbers(2, Rule::ANY, asks_for)?[..] {
            [first, second] if rule.admits(&[first, second]) => Ok([first, second]),
            _ => Err(node.out_of_range(rule.accepts, &format!("give {asks_for}"))),
        }
    }

    fn when_absent(absent: Absent) -> Option<Self> {
        match absent {
            Absent::Numbers(&[first, second]) => Some([first, second]),
            _ => None,
        }
    }

    fn numbers(&self) -> Vec<f64> {
        self.to_vec()
    }
}

impl Table<'_> {
    /// The value of a key, read according to its row.
    pub(super) fn value<V: Value>(&self, name: &str) -> Result<V, RigError> {
        let key = self.key(name);
        match self.get(name) {
            Some(node) => V::read(&node, key.rule, &self.section.asks_for(&key)),
            None => {
                V::when_absent(key.absent).ok_or_else(|| self.missing(name, &self.section.asks_for(&key)))
            }
        }
    }
}

/// A structure whose fields are the keys of a section; `keys!` implements it.
pub(super) trait Keys: Sized {
    /// A row per field.
    const KEYS: &'static [Key];

    /// Reads all fields from a table of the file.
    fn read(table: &Table<'_>) -> Result<Self, RigError>;

    /// The values if the section is left out; none if one of them is required.
    fn when_absent() -> Option<Self>;

    /// The numbers of each field, in the order of [`Keys::KEYS`].
    fn values(&self) -> Vec<Vec<f64>>;
}

/// Declares a structure of scalar keys. A row states field, type, unit, rule, meaning and the default.
///
/// The row is all that reading, `upright check` and the documentation need. Fields serialise in the order of the rows,
/// and the rig's hash depends on it.
macro_rules! keys {
    (
        $(#[$attribute:meta])*
        pub struct $name:ident {
            $(
                $(#[$of_field:meta])*
                $field:ident: $type:ty, $unit:literal, $rule:expr, $meaning:literal, $absent:expr;
            )+
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize)]
        pub struct $name {
            $(
                #[doc = concat!("The ", $meaning, ".")]
                $(#[$of_field])*
                pub $field: $type,
            )+
        }

        impl $crate::rig::value::Keys for $name {
            const KEYS: &'static [$crate::rig::key::Key] = &[$(
                $crate::rig::key::Key {
                    name: stringify!($field),
                    unit: $unit,
                    rule: $rule,
                    meaning: $meaning,
                    absent: $absent,
                },
            )+];

            fn read(table: &$crate::rig::node::Table<'_>) -> Result<Self, $crate::rig::error::RigError> {
                Ok(Self { $( $field: table.value(stringify!($field))?, )+ })
            }

            fn when_absent() -> Option<Self> {
                Some(Self { $( $field: $crate::rig::value::Value::when_absent($absent)?, )+ })
            }

            fn values(&self) -> Vec<Vec<f64>> {
                vec![$( $crate::rig::value::Value::numbers(&self.$field), )+]
            }
        }
    };
}

pub(super) use keys;
