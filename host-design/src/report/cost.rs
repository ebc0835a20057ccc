//! What the controller costs per tick, counted.

use upright::table::GainTable;

use super::number::number;
use crate::table::{LawValues, TableValues, WithSize, with_size};

/// Counts, not measurements: operations of the firmware's equations on `f32`, and bytes of constants.
pub(super) struct Cost {
    /// Multiplications with an addition, per tick.
    pub(super) multiply_adds: usize,
    /// Of these, in the observer.
    pub(super) in_observer: usize,
    /// Operations on `f32` altogether: a multiplication and an addition are two.
    pub(super) operations: usize,
    /// Bytes of the table in flash; none if no firmware has types of this size.
    table_bytes: Option<usize>,
    /// Ticks per second.
    rate_hz: f64,
}

impl Cost {
    /// Of one law of the table.
    pub(super) fn of(table: &TableValues, law: &LawValues) -> Self {
        let (states, sensors) = (table.states, table.sensors);
        let further = [law.k_pending, law.k_integral].iter().filter(|gain| **gain != 0.0).count();
        let in_law = states + 1 + further + usize::from(law.k_integral != 0.0);
        // x̂ = x̂⁻ + L e and x̂⁻ = Ad x̂ + Bd u; counts to positions.
        let in_observer =
            if table.observer.is_some() { states * sensors + states * states + states + sensors } else { 0 };
        // The innovation subtracts only; a motor needs V = a F + b v and the duty.
        let differences = if table.observer.is_some() { sensors } else { 0 };
        let in_motor = if table.motor.is_some() { 4 } else { 0 };
        let multiply_adds = in_law + in_observer + in_motor;
        Self {
            multiply_adds,
            in_observer,
            operations: 2 * multiply_adds + differences,
            table_bytes: with_size(states, sensors, Bytes),
            rate_hz: 1.0 / f64::from(table.tick_s),
        }
    }

    /// Operations per second, for reading.
    pub(super) fn per_second(&self) -> String {
        format!("{} million", number(1e-6 * self.operations as f64 * self.rate_hz))
    }

    /// Bytes of the table, for reading.
    pub(super) fn bytes(&self) -> String {
        self.table_bytes.map_or("no table of this size".to_owned(), |bytes| format!("{bytes} bytes"))
    }
}

struct Bytes;

impl WithSize for Bytes {
    type Output = usize;

    fn run<const NX: usize, const NY: usize>(self) -> usize {
        size_of::<GainTable<NX, NY>>()
    }
}
