//! The gain table of a rig, and its check.

use crate::numbers::Scalar;
use crate::table::absolute::AbsoluteZeros;
use crate::table::checksum;
use crate::table::drive::DriveMap;
use crate::table::error::TableError;
use crate::table::format::TABLE_FORMAT;
use crate::table::friction::FrictionMap;
use crate::table::law::{Law, LawGains, PerLaw};
use crate::table::limits::Limits;
use crate::table::observer::ObserverGains;
use crate::table::part::{is_finite, part};
use crate::table::thresholds::Thresholds;

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
        /// The drive of the cart.
        pub drive: DriveMap<T>,
        /// Gains of the control laws that are designed, at least one.
        pub laws: PerLaw<Option<LawGains<NX, T>>>,
        /// The observer, if designed: without it the controller needs the whole state.
        pub observer: Option<ObserverGains<NX, NY, T>>,
        /// Known Coulomb friction, if there is any: it is compensated.
        pub friction: Option<FrictionMap<NX, NY, T>>,
        /// Limits that the supervisor enforces.
        pub limits: Limits<NY>,
        /// Thresholds at which the supervisor takes encoders and motor to be at fault.
        pub thresholds: Thresholds<NY>,
        /// Absolute sensors.
        pub absolute: AbsoluteZeros<NY>,
        sealed by
        /// CRC-32 (ISO-HDLC) of all fields above, see [`GainTable::checksum`].
        pub crc,
    }
}

impl<const NX: usize, const NY: usize> GainTable<NX, NY> {
    /// CRC-32 (ISO-HDLC) of every field except `crc`, as little-endian words in the order of declaration.
    pub fn checksum(&self) -> u32 {
        checksum::checksum(self)
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
        if !self.drive.late().is_sound() {
            return Err(TableError::Delay);
        }
        let mut measured = self.observer.iter().flat_map(|observer| &observer.measured);
        if self.output as usize >= NX || measured.any(|&state| state as usize >= NX) {
            return Err(TableError::Dimensions);
        }
        if self.laws.present().next().is_none() {
            return Err(TableError::NoLaw);
        }
        let is_sound = self.drive.is_sound()
            && self.laws.present().all(|(_, law)| law.is_sound())
            && self.limits.is_sound()
            && self.thresholds.is_sound()
            && self
                .observer
                .iter()
                .all(|observer| observer.delay_s.data.0[0].iter().all(|&delay_s| delay_s >= 0.0));
        if is_sound && is_finite(self) { Ok(()) } else { Err(TableError::Value) }
    }
}

impl<const NX: usize, const NY: usize, T: Scalar> GainTable<NX, NY, T> {
    /// The gains of a law, if they are in the table.
    pub fn law(&self, law: Law) -> Option<&LawGains<NX, T>> {
        self.laws[law].as_ref()
    }
}
