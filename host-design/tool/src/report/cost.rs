//! Operations and memory of the controller, counted.

use super::number::number;
use upright_design::table::{LawValues, TableValues};

/// Counts, not measurements: operations of the firmware's equations on `f32`, and bytes of constants.
pub(super) struct LawCost {
    /// Multiplications, all but a few with an addition, per tick.
    pub(super) multiply_adds: usize,
    /// Of these, in the observer.
    pub(super) in_observer: usize,
    /// Multiplications and additions of `f32`; comparisons, as in limits, are not counted.
    pub(super) operations: usize,
    /// Bytes of the table's values in flash.
    table_bytes: usize,
    /// Ticks per second.
    rate_hz: f64,
}

impl LawCost {
    /// Cost of one law of the table.
    pub(super) fn of(table: &TableValues, law: &LawValues) -> Self {
        let (states, sensors) = (table.states(), table.sensors());
        let further = [law.k_pending, law.k_integral].iter().filter(|gain| **gain != 0.0).count();
        let has_integral = usize::from(law.k_integral != 0.0);
        // u = N r - K x - …, in two halves; z + T (x - r).
        let law = Operations {
            multiplications: states + 1 + further + has_integral,
            additions: states + 1 + further + 2 * has_integral,
        };
        // Counts to y, e = y - C x̂⁻, x̂ = x̂⁻ + L e, x̂⁻ = Bd u + Ad x̂.
        let observer = Operations {
            multiplications: sensors + states * sensors + states + states * states,
            additions: sensors + states * sensors + states * states,
        };
        // Voltage from force and speed, compensation of the dead zone, duty.
        let motor = Operations { multiplications: 4, additions: 4 };
        let parts =
            [(&law, true), (&observer, table.observer.is_some()), (&motor, table.drive.supply_v().is_some())];
        let used: Vec<&Operations> =
            parts.into_iter().filter(|(_, used)| *used).map(|(part, _)| part).collect();
        let multiply_adds = used.iter().map(|part| part.multiplications).sum();
        Self {
            multiply_adds,
            in_observer: if table.observer.is_some() { observer.multiplications } else { 0 },
            operations: multiply_adds + used.iter().map(|part| part.additions).sum::<usize>(),
            table_bytes: table.bytes(),
            rate_hz: 1.0 / f64::from(table.tick_s),
        }
    }

    /// Operations per second, as text.
    pub(super) fn per_second(&self) -> String {
        format!("{} million", number(1e-6 * self.operations as f64 * self.rate_hz))
    }

    /// Bytes of the table, as text.
    pub(super) fn bytes(&self) -> String {
        format!("{} bytes", self.table_bytes)
    }
}

struct Operations {
    multiplications: usize,
    additions: usize,
}
