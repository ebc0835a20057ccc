//! The gain table: everything the controller knows about the rig, and the check of the table.
//!
//! Only the data are here, each field declared once; [`control`](crate::control) and
//! [`supervision`](crate::supervision) use them. A gain table in another crate imports only this module.

mod chain_model;
pub mod checksum;
mod equilibrium;
mod friction;
mod law;
mod limits;
mod motor;
mod observer;
mod part;
mod scalar;
mod swing_up;
mod thresholds;

use nalgebra::{ArrayStorage, SMatrix};

use crate::table::part::{is_finite, part};

pub use chain_model::ChainModel;
pub use checksum::ChecksumScan;
pub use equilibrium::Equilibrium;
pub use friction::FrictionMap;
pub use law::{Law, LawGains, PerLaw};
pub use limits::Limits;
pub use motor::MotorMap;
pub use observer::ObserverGains;
pub use part::{Part, Reader, Resize, Shape, Words, WordsMut};
pub use scalar::{Number, Scalar};
pub use swing_up::{MotionLimits, MotionTable, Motions, NoSwingUp, SwingUp, SwingUpTable, TransitionTable};
pub use thresholds::{MotorTest, Thresholds};

/// Version of the layout of [`GainTable`]; a table with another version is refused.
pub const TABLE_FORMAT: u32 = 8;

part! {
    /// The constants of a controller with `NX` states and `NY` sensors. `upright design` writes them to
    /// `src/gains.rs`.
    #[derive(Copy)]
    pub struct GainTable<NX to MX, NY to MY; T> {
        /// Layout of the table: `TABLE_FORMAT` of the writer.
        pub format: u32,
        /// Number of states; equal to `NX` in a sound table.
        pub states: u32,
        /// Number of sensors; equal to `NY` in a sound table.
        pub sensors: u32,
        /// Index of the state that follows the set-point.
        pub output: u32,
        /// Hash of the rig file's values.
        pub rig_hash: u64,
        /// Control period (s).
        pub tick_s: T,
        /// Delay between a measurement and the force computed from it: 0 or 1 (ticks).
        pub delay_ticks: u32,
        /// Largest force on the cart (N).
        pub force_limit_n: T,
        /// Gains of the control laws that are designed, at least one.
        pub laws: PerLaw<Option<LawGains<NX, T>>>,
        /// The observer, if designed: without it the controller needs the whole state.
        pub observer: Option<ObserverGains<NX, NY, T>>,
        /// Known Coulomb friction, if there is any: it is compensated.
        pub friction: Option<FrictionMap<NX, NY, T>>,
        /// The motor, if described: without it the controller gives a force.
        pub motor: Option<MotorMap<T>>,
        /// Limits that the supervisor enforces.
        pub limits: Limits<NY>,
        /// Thresholds at which the supervisor takes encoders and motor to be at fault.
        pub thresholds: Thresholds<NY>,
        sealed by
        /// CRC-32 (ISO-HDLC) of all fields above, see [`GainTable::checksum`].
        pub crc,
    }
}

/// A constant matrix, given column by column; usable in a `const`.
pub const fn columns<const R: usize, const C: usize>(entries: [[f32; R]; C]) -> SMatrix<f32, R, C> {
    SMatrix::from_array_storage(ArrayStorage(entries))
}

/// Reason for refusing a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableError {
    /// Written for another version of the layout.
    Format,
    /// The stored number of states or sensors differs from that of the type, or a state index is out of range.
    Dimensions,
    /// The checksum does not match the contents.
    Crc,
    /// The swing-up is that of another rig than the gains.
    RigHash,
    /// The swing-up is for another control period than the gains.
    Tick,
    /// A delay other than 0 or 1 tick.
    Delay,
    /// A value is not finite, or a limit, supply or step is not positive.
    Value,
    /// The table holds no control law.
    NoLaw,
}

impl core::fmt::Display for TableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            TableError::Format => "the table has another layout: run `upright design` of this version again",
            TableError::Dimensions => "the table's numbers of states and sensors are not those of this build",
            TableError::Crc => {
                "the table's checksum is wrong: it was changed or damaged, run `upright design` again"
            }
            TableError::RigHash => "the swing-up was designed for another rig than the gains",
            TableError::Tick => "the swing-up was designed for another control period than the gains",
            TableError::Delay => "the table's delay is neither 0 nor 1 tick",
            TableError::Value => {
                "the table holds a value that is not finite, or a limit that is not positive"
            }
            TableError::NoLaw => "the table holds no control law",
        })
    }
}

impl core::error::Error for TableError {}

impl<const NX: usize, const NY: usize> GainTable<NX, NY> {
    /// CRC-32 (ISO-HDLC) of every field except `crc`, as little-endian words in the order of declaration.
    pub fn checksum(&self) -> u32 {
        checksum::checksum(self)
    }

    /// Highest supply voltage of the power stage (V); no limit without motor data.
    #[inline]
    pub fn supply_max_v(&self) -> f32 {
        self.motor.as_ref().map_or(f32::INFINITY, MotorMap::supply_max_v)
    }

    /// Checks that the table is intact, plausible and of this version.
    ///
    /// # Errors
    /// The first [`TableError`] found.
    pub fn check(&self) -> Result<(), TableError> {
        if self.format != TABLE_FORMAT {
            return Err(TableError::Format);
        }
        if self.states as usize != NX || self.sensors as usize != NY {
            return Err(TableError::Dimensions);
        }
        if self.crc != self.checksum() {
            return Err(TableError::Crc);
        }
        if self.delay_ticks > 1 {
            return Err(TableError::Delay);
        }
        let mut measured = self.observer.iter().flat_map(|observer| &observer.measured);
        if self.output as usize >= NX || measured.any(|&state| state as usize >= NX) {
            return Err(TableError::Dimensions);
        }
        if self.laws.present().next().is_none() {
            return Err(TableError::NoLaw);
        }
        let is_sound = self.force_limit_n > 0.0
            && self.laws.present().all(|(_, law)| law.is_sound())
            && self.motor.iter().all(MotorMap::is_sound)
            && self.limits.is_sound()
            && self.thresholds.is_sound();
        if is_sound && is_finite(self) { Ok(()) } else { Err(TableError::Value) }
    }
}

impl<const NX: usize, const NY: usize, T: Scalar> GainTable<NX, NY, T> {
    /// The gains of a law, if they are in the table.
    pub fn law(&self, law: Law) -> Option<&LawGains<NX, T>> {
        self.laws[law].as_ref()
    }
}

#[cfg(test)]
mod tests;
