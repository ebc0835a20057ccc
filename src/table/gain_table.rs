//! The gain table of a rig, and its check.

use crate::numbers::Scalar;
use crate::table::checksum;
use crate::table::drive::DriveMap;
use crate::table::equilibrium::Equilibrium;
use crate::table::error::TableError;
use crate::table::format::TABLE_FORMAT;
use crate::table::friction::FrictionMap;
use crate::table::law::{Law, LawGains, PerLaw};
use crate::table::limits::Limits;
use crate::table::observer::ObserverGains;
use crate::table::part::{is_finite, part};
use crate::table::sensor::SensorRow;
use crate::table::stilling::StillingGains;
use crate::table::thresholds::Thresholds;

part! {
    /// The constants of a controller with `NX` states and `NY` sensors. `upright design` writes them to
    /// `src/gains.rs`.
    #[derive(Copy)]
    pub struct GainTable<NX to MX, NY to MY; T> {
        /// Layout of the table: `TABLE_FORMAT` of the writer.
        pub format: u32,
        /// Numbers of states and sensors; equal to `NX` and `NY` in a sound table.
        pub dimensions: [u32; 2],
        /// Index of the state that follows the set-point.
        pub output: u32,
        /// Hash of the rig file's values.
        pub rig_hash: u64,
        /// Control period (s).
        pub tick_s: T,
        /// The sensors; the first one is the cart's.
        pub sensors: [SensorRow<T>; NY],
        /// The drive of the cart.
        pub drive: DriveMap<T>,
        /// Gains of the control laws that are designed, at least one.
        pub laws: PerLaw<Option<LawGains<NX, T>>>,
        /// The observer, if designed: without it the controller needs the whole state.
        pub observer: Option<ObserverGains<NX, NY, T>>,
        /// Known Coulomb friction, if there is any: it is compensated.
        pub friction: Option<FrictionMap<NX, NY, T>>,
        /// Limits that the supervisor enforces.
        pub limits: Limits,
        /// Thresholds at which the supervisor takes encoders and motor to be at fault.
        pub thresholds: Thresholds<NY>,
        /// How the motor stills the links; none for a `[model]`, and where no sensor measures that they hang.
        pub stilling: Option<StillingGains<NY>>,
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

    /// How far the sensor that shows what the motor does has to be moved when its sign is checked (counts); 0 without a
    /// cart.
    pub fn witness_sign_counts(&self) -> i32 {
        self.sensors.get(self.drive.witness()).map_or(0, |sensor| sensor.sign_counts)
    }

    /// `counts` with whole turns removed from each joint, so that it is within half a turn of 0.
    pub fn within_half_a_turn(&self, counts: &[i32; NY]) -> [i32; NY] {
        let mut wrapped = *counts;
        wrapped
            .iter_mut()
            .zip(&self.sensors)
            .for_each(|(count, sensor)| *count = sensor.within_half_a_turn(*count));
        wrapped
    }

    /// Distance of these counts from rest `at` an equilibrium, without whole turns of the joints.
    pub fn from_rest(&self, counts: &[i32; NY], at: Equilibrium) -> [i32; NY] {
        let mut away = *counts;
        for (number, (count, sensor)) in away.iter_mut().zip(&self.sensors).enumerate() {
            *count = sensor.within_half_a_turn(count.wrapping_sub(sensor.at_rest(number, at)));
        }
        away
    }

    /// These counts without whole turns of the joints, so that each is within half a turn of where it rests `at` an
    /// equilibrium.
    pub fn unwound(&self, counts: &[i32; NY], at: Equilibrium) -> [i32; NY] {
        let mut unwound = self.from_rest(counts, at);
        for (number, (count, sensor)) in unwound.iter_mut().zip(&self.sensors).enumerate() {
            *count = count.wrapping_add(sensor.at_rest(number, at));
        }
        unwound
    }

    /// Checks that the table is intact, plausible and of this version.
    ///
    /// # Errors
    /// The first [`TableError`] found.
    pub fn check(&self) -> Result<(), TableError> {
        if self.format != TABLE_FORMAT {
            return Err(TableError::Format);
        }
        if self.dimensions.map(|number| number as usize) != [NX, NY] {
            return Err(TableError::Dimensions);
        }
        if self.crc != self.checksum() {
            return Err(TableError::Crc);
        }
        if !self.drive.late().is_sound() {
            return Err(TableError::Delay);
        }
        if self.output as usize >= NX || self.sensors.iter().any(|sensor| sensor.state as usize >= NX) {
            return Err(TableError::Dimensions);
        }
        if self.laws.present().next().is_none() {
            return Err(TableError::NoLaw);
        }
        let is_sound = self.drive.is_sound()
            && self.laws.present().all(|(_, law)| law.is_sound())
            && self.limits.is_sound()
            && self.thresholds.is_sound()
            && self.stilling.iter().all(StillingGains::is_sound)
            && self.sensors.iter().all(SensorRow::is_sound);
        if is_sound && is_finite(self) { Ok(()) } else { Err(TableError::Value) }
    }
}

impl<const NX: usize, const NY: usize, T: Scalar> GainTable<NX, NY, T> {
    /// The gains of a law, if they are in the table.
    pub fn law(&self, law: Law) -> Option<&LawGains<NX, T>> {
        self.laws[law].as_ref()
    }
}
