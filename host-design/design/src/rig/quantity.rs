//! What drives the plant and where it is, in words: the names and units that reports, figures and pages print.

/// A quantity with its unit. A model's quantities have units of their own, which are not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// Its name within a sentence.
    pub name: &'static str,
    /// Its unit; empty if it is not known.
    pub unit: &'static str,
}

impl Quantity {
    /// What moves the plant of a model.
    pub const OF_MODEL: Self = Self { name: "input", unit: "" };

    /// The title of an axis: `force (N)`.
    pub fn title(self) -> String {
        if self.unit.is_empty() { self.name.to_owned() } else { format!("{} ({})", self.name, self.unit) }
    }

    /// A number of it with its unit: `3.2 N`.
    pub fn of(self, number: &str) -> String {
        if self.unit.is_empty() { number.to_owned() } else { format!("{number} {}", self.unit) }
    }
}
