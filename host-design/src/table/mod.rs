//! The gain table on the host: its values for any number of states, as a firmware table and as Rust source.

mod any_size;
mod source;
mod write;

use serde::Serialize;
use upright::table::{Build, GainTable, LawGains, TABLE_FORMAT, column};

use crate::design::{Feedback, Laws};
use crate::rig::Rig;

pub use any_size::{MAX_STATES, WithStates, with_states};
pub use source::gains_source;
pub use write::{WriteError, write_atomically};

/// What goes into the table, with the number of states not yet in the type.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TableValues {
    /// Name of the rig.
    #[serde(skip)]
    pub rig: String,
    /// Hash of the rig file's values.
    #[serde(skip)]
    pub rig_hash: u64,
    /// Control period (s).
    pub tick_s: f32,
    /// 0 or 1.
    pub delay_ticks: u32,
    /// Largest force (N).
    pub force_limit_n: f32,
    /// LQR gains.
    pub lqr: Option<LawValues>,
    /// Pole placement gains.
    pub pole_placement: Option<LawValues>,
}

/// Gains of one law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawValues {
    /// K, one per state.
    pub k: Vec<f32>,
    /// Gain on the force on its way.
    pub k_pending: f32,
    /// N; 0 if no constant force can hold the output away from 0.
    pub n: f32,
}

/// A design that does not make a table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoTable {
    /// The rig file asks for no control law.
    #[error("the rig file asks for no control law: add [lqr] or [pole_placement]")]
    NoLaw,
    /// A value is outside the range of single precision.
    #[error("{what} = {value:e} does not fit into single precision: choose units in which it does")]
    Range {
        /// Which value.
        what: &'static str,
        /// Its `f32`.
        value: f32,
    },
    /// More states than the firmware's types are made for.
    #[error("{states} states are more than the {MAX_STATES} a gain table can hold")]
    TooManyStates {
        /// States of the rig.
        states: usize,
    },
}

impl TableValues {
    /// The table of a rig with these gains, each already rounded once to `f32`.
    ///
    /// # Errors
    /// [`NoTable`] if there is no law, a value does not fit, or there are too many states.
    pub fn of(rig: &Rig, laws: &Laws<f32>) -> Result<Self, NoTable> {
        let states = rig.states();
        if states > MAX_STATES {
            return Err(NoTable::TooManyStates { states });
        }
        let law = |feedback: &Option<Feedback<f32>>| {
            feedback.as_ref().map(|law| LawValues::of(law, states)).transpose()
        };
        let values = Self {
            rig: rig.name.clone(),
            rig_hash: rig.hash(),
            tick_s: single("tick.period_s", rig.tick.period_s as f32)?,
            delay_ticks: u32::from(rig.tick.delay_ticks),
            force_limit_n: rig
                .force_limit_n()
                .map_or(Ok(f32::MAX), |limit| single("actuator.force_limit_n", limit as f32))?,
            lqr: law(&laws.lqr)?,
            pole_placement: law(&laws.pole_placement)?,
        };
        if values.lqr.is_none() && values.pole_placement.is_none() {
            return Err(NoTable::NoLaw);
        }
        Ok(values)
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        [&self.lqr, &self.pole_placement].into_iter().flatten().map(|law| law.k.len()).next().unwrap_or(0)
    }

    /// The firmware's table, sealed with its checksum.
    ///
    /// # Panics
    /// If `NX` is not [`states`](Self::states).
    pub fn table<const NX: usize>(&self) -> GainTable<NX> {
        let law = |law: &Option<LawValues>| {
            law.as_ref().map(|law| {
                assert_eq!(law.k.len(), NX, "states of the table");
                LawGains { k: column(core::array::from_fn(|i| law.k[i])), k_pending: law.k_pending, n: law.n }
            })
        };
        let mut table = GainTable {
            format: TABLE_FORMAT,
            states: NX as u32,
            rig_hash: self.rig_hash,
            tick_s: self.tick_s,
            delay_ticks: self.delay_ticks,
            force_limit_n: self.force_limit_n,
            lqr: law(&self.lqr),
            pole_placement: law(&self.pole_placement),
            crc: 0,
        };
        table.crc = table.checksum();
        table
    }

    /// The checksum the firmware expects.
    pub fn crc(&self) -> u32 {
        struct Checksum<'a>(&'a TableValues);
        impl WithStates for Checksum<'_> {
            type Output = u32;
            fn run<const NX: usize>(self) -> u32 {
                self.0.table::<NX>().crc
            }
        }
        // Values are only made for a number of states that fits.
        with_states(self.states(), Checksum(self)).unwrap_or(0)
    }

    /// What a firmware image for this table is built for.
    pub fn build(&self) -> Build {
        Build { rig_hash: self.rig_hash, tick_s: self.tick_s }
    }
}

impl LawValues {
    fn of(law: &Feedback<f32>, states: usize) -> Result<Self, NoTable> {
        let entries: Vec<f32> =
            law.k.entries().iter().map(|&gain| single("a gain", gain)).collect::<Result<_, _>>()?;
        let (k, pending) = entries.split_at(states);
        Ok(Self {
            k: k.to_vec(),
            k_pending: pending.first().copied().unwrap_or(0.0),
            n: single("the precompensation gain", law.n.unwrap_or(0.0))?,
        })
    }
}

fn single(what: &'static str, value: f32) -> Result<f32, NoTable> {
    if value.is_finite() { Ok(value) } else { Err(NoTable::Range { what, value }) }
}
