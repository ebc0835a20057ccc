//! The gain table: everything the controller knows about the rig, and how it is checked.

use nalgebra::{ArrayStorage, SMatrix};
use serde::{Deserialize, Serialize};

use crate::actuator::MotorMap;
use crate::checksum::crc32;
use crate::observer::ObserverGains;
use crate::state_feedback::LawGains;

/// Layout of [`GainTable`]; a table written for another layout is refused.
pub const TABLE_FORMAT: u32 = 2;

/// The constants of a controller with `NX` states and `NY` sensors, as written by `upright design` into `src/gains.rs`.
#[derive(Debug, Clone, PartialEq)]
pub struct GainTable<const NX: usize, const NY: usize> {
    /// [`TABLE_FORMAT`] of the writer.
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
    pub tick_s: f32,
    /// Ticks between a measurement and the force computed from it: 0 or 1.
    pub delay_ticks: u32,
    /// Largest force on the cart (N).
    pub force_limit_n: f32,
    /// Gains of the linear quadratic regulator, if designed.
    pub lqr: Option<LawGains<NX>>,
    /// Gains of the pole placement, if designed.
    pub pole_placement: Option<LawGains<NX>>,
    /// The observer, if designed: without it the controller needs the whole state.
    pub observer: Option<ObserverGains<NX, NY>>,
    /// The motor, if described: without it the controller gives a force.
    pub motor: Option<MotorMap>,
    /// CRC-32 (ISO-HDLC) of all fields above, see [`GainTable::checksum`].
    pub crc: u32,
}

/// A matrix of constants, given column by column, usable in a `const`.
pub const fn columns<const R: usize, const C: usize>(entries: [[f32; R]; C]) -> SMatrix<f32, R, C> {
    SMatrix::from_array_storage(ArrayStorage(entries))
}

/// Which of the table's control laws is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Law {
    /// Linear quadratic regulator.
    Lqr,
    /// Pole placement.
    PolePlacement,
}

/// What the firmware was built for; a table must agree with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Build {
    /// Hash of the rig file's values.
    pub rig_hash: u64,
    /// Control period of the hardware timer (s).
    pub tick_s: f32,
}

/// Why a table is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableError {
    /// Written for another layout of the table.
    Format,
    /// The stored number of states or sensors is not that of the type, or a state is named that does not exist.
    Dimensions,
    /// The checksum does not fit the contents.
    Crc,
    /// Designed for another rig.
    RigHash,
    /// Designed for another control period.
    Tick,
    /// A delay other than 0 or 1 tick.
    Delay,
    /// A value that is not finite, or a limit, supply or step that is not positive.
    Value,
    /// No control law in the table.
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
            TableError::RigHash => "the table was designed for another rig",
            TableError::Tick => "the table was designed for another control period",
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
    /// CRC-32 (ISO-HDLC) of every field but `crc`, in order, as little-endian bytes; a missing part is one zero byte, a
    /// part that is there is preceded by a one.
    pub fn checksum(&self) -> u32 {
        let mut digest = Digest(0);
        for word in [self.format, self.states, self.sensors, self.output] {
            digest.update(&word.to_le_bytes());
        }
        digest.update(&self.rig_hash.to_le_bytes());
        update(&mut digest, [self.tick_s, self.force_limit_n]);
        digest.update(&self.delay_ticks.to_le_bytes());
        for law in [&self.lqr, &self.pole_placement] {
            digest.update(&[u8::from(law.is_some())]);
            update(&mut digest, law.iter().flat_map(LawGains::values));
        }
        digest.update(&[u8::from(self.observer.is_some())]);
        if let Some(observer) = &self.observer {
            update(&mut digest, observer.values());
            for state in observer.measured {
                digest.update(&state.to_le_bytes());
            }
        }
        digest.update(&[u8::from(self.motor.is_some())]);
        update(&mut digest, self.motor.iter().flat_map(MotorMap::values));
        digest.0
    }

    /// The gains of a law, if the table holds them.
    pub fn law(&self, law: Law) -> Option<&LawGains<NX>> {
        match law {
            Law::Lqr => self.lqr.as_ref(),
            Law::PolePlacement => self.pole_placement.as_ref(),
        }
    }

    /// Whether the table is sound and meant for this build.
    ///
    /// # Errors
    /// The first [`TableError`] found.
    pub fn check(&self, build: &Build) -> Result<(), TableError> {
        if self.format != TABLE_FORMAT {
            return Err(TableError::Format);
        }
        if self.states as usize != NX || self.sensors as usize != NY {
            return Err(TableError::Dimensions);
        }
        if self.crc != self.checksum() {
            return Err(TableError::Crc);
        }
        if self.rig_hash != build.rig_hash {
            return Err(TableError::RigHash);
        }
        if self.tick_s.to_bits() != build.tick_s.to_bits() {
            return Err(TableError::Tick);
        }
        if self.delay_ticks > 1 {
            return Err(TableError::Delay);
        }
        let states_exist =
            |mut indices: core::slice::Iter<'_, u32>| indices.all(|&index| (index as usize) < NX);
        if !states_exist([self.output].iter())
            || !self.observer.iter().all(|observer| states_exist(observer.measured.iter()))
        {
            return Err(TableError::Dimensions);
        }
        let mut laws = [&self.lqr, &self.pole_placement].into_iter().flatten().peekable();
        if laws.peek().is_none() {
            return Err(TableError::NoLaw);
        }
        let finite = |mut values: &mut dyn Iterator<Item = f32>| Iterator::all(&mut values, f32::is_finite);
        let limit_is_sound = self.force_limit_n > 0.0 && self.force_limit_n.is_finite();
        if !(limit_is_sound
            && laws.all(|law| law.setpoint_step > 0.0 && finite(&mut law.values()))
            && self.observer.iter().all(|observer| finite(&mut observer.values()))
            && self.motor.iter().all(|motor| {
                motor.volts_per_newton > 0.0
                    && motor.supply_v > 0.0
                    && finite(&mut motor.values().into_iter())
            }))
        {
            return Err(TableError::Value);
        }
        Ok(())
    }
}

/// The checksum so far.
struct Digest(u32);

impl Digest {
    fn update(&mut self, bytes: &[u8]) {
        self.0 = crc32(self.0, bytes);
    }
}

fn update(digest: &mut Digest, values: impl IntoIterator<Item = f32>) {
    for value in values {
        digest.update(&value.to_le_bytes());
    }
}
