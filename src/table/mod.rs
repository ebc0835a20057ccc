//! The gain table: everything the controller knows about the rig, and how it is checked.

pub mod checksum;
pub mod limits;

use nalgebra::{ArrayStorage, SMatrix};
use serde::{Deserialize, Serialize};

use crate::control::actuator::MotorMap;
use crate::control::observer::ObserverGains;
use crate::control::state_feedback::LawGains;
use crate::supervision::detection::Thresholds;
use crate::table::checksum::crc32;
use crate::table::limits::Limits;

/// Layout of [`GainTable`]; a table written for another layout is refused.
pub const TABLE_FORMAT: u32 = 3;

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
    /// What the supervisor enforces.
    pub limits: Limits<NY>,
    /// When encoders and motor are at fault.
    pub thresholds: Thresholds<NY>,
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
    /// CRC-32 (ISO-HDLC) of every field but `crc`, as little-endian words, see [`Reading`].
    pub fn checksum(&self) -> u32 {
        let mut reading = Reading::default();
        loop {
            if let Some(crc) = reading.next(self) {
                return crc;
            }
        }
    }

    /// A word of the table: which part, and where in it. Parts that are missing are empty.
    fn word(&self, part: u8, index: usize) -> Option<u32> {
        let number = |values: &[f32]| values.get(index).map(|value| value.to_bits());
        let integer = |values: &[i32]| values.get(index).map(|&value| value as u32);
        let law = |law: &Option<LawGains<NX>>| law.as_ref().and_then(|law| law.word(index));
        let observer = self.observer.as_ref();
        match part {
            0 => self.header().get(index).copied(),
            1 => law(&self.lqr),
            2 => law(&self.pole_placement),
            3 => observer.and_then(|observer| number(observer.ad.as_slice())),
            4 => observer.and_then(|observer| number(observer.bd.as_slice())),
            5 => observer.and_then(|observer| number(observer.l.as_slice())),
            6 => observer.and_then(|observer| number(observer.step.as_slice())),
            7 => observer.and_then(|observer| observer.measured.get(index).copied()),
            8 => self.motor.as_ref().and_then(|motor| number(&motor.values())),
            9 => self.limits.scalars().get(index).copied(),
            10 => integer(&self.limits.slow_counts),
            11 => integer(&self.limits.rest_counts),
            12 => integer(&self.limits.turn_counts),
            13 => integer(&self.limits.sign_counts),
            14 => number(&self.thresholds.innovation),
            15 => number(&self.thresholds.frozen),
            16 => number(&self.thresholds.motor.values()),
            _ => None,
        }
    }

    fn header(&self) -> [u32; 13] {
        [
            self.format,
            self.states,
            self.sensors,
            self.output,
            self.rig_hash as u32,
            (self.rig_hash >> 32) as u32,
            self.tick_s.to_bits(),
            self.delay_ticks,
            self.force_limit_n.to_bits(),
            u32::from(self.lqr.is_some()),
            u32::from(self.pole_placement.is_some()),
            u32::from(self.observer.is_some()),
            u32::from(self.motor.is_some()),
        ]
    }

    /// The gains of a law, if the table holds them.
    pub fn law(&self, law: Law) -> Option<&LawGains<NX>> {
        match law {
            Law::Lqr => self.lqr.as_ref(),
            Law::PolePlacement => self.pole_placement.as_ref(),
        }
    }

    /// Whether a tick with these gains depends on earlier ones beyond the estimate: by a force on its way or an integral.
    pub(crate) fn remembers(&self, gains: &LawGains<NX>) -> bool {
        self.delay_ticks == 1 || gains.k_pending != 0.0 || gains.k_integral != 0.0
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
            && self.limits.is_sound()
            && self.thresholds.is_sound()
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

/// A pass over a table that takes one word at a time, to be spread over many ticks.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reading {
    part: u8,
    index: usize,
    /// CRC of what was read.
    crc: u32,
}

impl Reading {
    const PARTS: u8 = 17;

    /// Reads the next word of `table`; at its end gives the CRC of all, and begins anew.
    pub fn next<const NX: usize, const NY: usize>(&mut self, table: &GainTable<NX, NY>) -> Option<u32> {
        if let Some(word) = table.word(self.part, self.index) {
            (self.crc, self.index) = (crc32(self.crc, &word.to_le_bytes()), self.index + 1);
            return None;
        }
        (self.part, self.index) = (self.part + 1, 0);
        if self.part < Self::PARTS {
            return None;
        }
        Some(core::mem::take(self).crc)
    }
}
