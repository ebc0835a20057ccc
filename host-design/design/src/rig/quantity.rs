//! What drives the plant and where it is, in words: the names and units that reports, figures and pages print.

use super::Rig;
use super::sections::chain::{CartInput, PlantDescription};

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

impl CartInput {
    /// What the drive imposes on a cart: a force, or an acceleration.
    pub fn quantity(self) -> Quantity {
        Quantity { name: self.name(), unit: self.unit() }
    }
}

impl Rig {
    /// What moves the plant.
    pub fn input_quantity(&self) -> Quantity {
        match &self.plant {
            PlantDescription::Chain(chain) => chain.input.quantity(),
            PlantDescription::Model(_) => Quantity::OF_MODEL,
        }
    }

    /// What follows the set-point.
    pub fn output_quantity(&self) -> Quantity {
        match &self.plant {
            PlantDescription::Chain(_) => Quantity { name: "position", unit: "m" },
            PlantDescription::Model(_) => Quantity { name: "output", unit: "" },
        }
    }
}
