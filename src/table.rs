//! The gain table: everything the controller knows about the rig, and how it is checked.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use nalgebra::{ArrayStorage, SVector};

/// Layout of [`GainTable`]; a table written for another layout is refused.
pub const TABLE_FORMAT: u32 = 1;

/// Without a lookup table: a few cycles per byte slower, a kilobyte of flash smaller.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// The constants of a controller with `NX` states, as written by `upright design` into `src/gains.rs`.
#[derive(Debug, Clone, PartialEq)]
pub struct GainTable<const NX: usize> {
    /// [`TABLE_FORMAT`] of the writer.
    pub format: u32,
    /// Number of states; equal to `NX` in a sound table.
    pub states: u32,
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
    /// CRC-32 (ISO-HDLC) of all fields above, see [`GainTable::checksum`].
    pub crc: u32,
}

/// Gains of one control law `u = N r - K x - k_pending u_pending`.
#[derive(Debug, Clone, PartialEq)]
pub struct LawGains<const NX: usize> {
    /// K: one gain per state (N/m, N·s/m, N/rad, N·s/rad …).
    pub k: SVector<f32, NX>,
    /// Gain on the force still on its way to the motor (1); 0 without delay.
    pub k_pending: f32,
    /// N: precompensation gain (N/m).
    pub n: f32,
}

/// A column of constants, usable in a `const`.
pub const fn column<const N: usize>(entries: [f32; N]) -> SVector<f32, N> {
    SVector::from_array_storage(ArrayStorage([entries]))
}

/// Which of the table's control laws is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
    /// The stored number of states is not that of the type.
    States,
    /// The checksum does not fit the contents.
    Crc,
    /// Designed for another rig.
    RigHash,
    /// Designed for another control period.
    Tick,
    /// A delay other than 0 or 1 tick.
    Delay,
    /// A gain or limit that is not finite, or a force limit that is not positive.
    Value,
    /// No control law in the table.
    NoLaw,
}

impl core::fmt::Display for TableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            TableError::Format => "the table has another layout: run `upright design` of this version again",
            TableError::States => "the table's number of states is not that of this build",
            TableError::Crc => {
                "the table's checksum is wrong: it was changed or damaged, run `upright design` again"
            }
            TableError::RigHash => "the table was designed for another rig",
            TableError::Tick => "the table was designed for another control period",
            TableError::Delay => "the table's delay is neither 0 nor 1 tick",
            TableError::Value => {
                "the table holds a value that is not finite or a force limit that is not positive"
            }
            TableError::NoLaw => "the table holds no control law",
        })
    }
}

impl core::error::Error for TableError {}

impl<const NX: usize> GainTable<NX> {
    /// CRC-32 (ISO-HDLC) of every field but `crc`, in order, as little-endian bytes.
    pub fn checksum(&self) -> u32 {
        let mut digest = CRC.digest();
        digest.update(&self.format.to_le_bytes());
        digest.update(&self.states.to_le_bytes());
        digest.update(&self.rig_hash.to_le_bytes());
        digest.update(&self.tick_s.to_le_bytes());
        digest.update(&self.delay_ticks.to_le_bytes());
        digest.update(&self.force_limit_n.to_le_bytes());
        for law in [&self.lqr, &self.pole_placement] {
            digest.update(&[u8::from(law.is_some())]);
            if let Some(law) = law {
                for value in law.values() {
                    digest.update(&value.to_le_bytes());
                }
            }
        }
        digest.finalize()
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
        if self.states as usize != NX {
            return Err(TableError::States);
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
        let mut laws = [&self.lqr, &self.pole_placement].into_iter().flatten().peekable();
        if laws.peek().is_none() {
            return Err(TableError::NoLaw);
        }
        if !(self.force_limit_n > 0.0 && self.force_limit_n.is_finite())
            || laws.any(|law| law.values().any(|value| !value.is_finite()))
        {
            return Err(TableError::Value);
        }
        Ok(())
    }
}

impl<const NX: usize> LawGains<NX> {
    fn values(&self) -> impl Iterator<Item = f32> {
        self.k.iter().copied().chain([self.k_pending, self.n])
    }
}
