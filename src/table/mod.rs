//! The gain table: everything the controller knows about the rig, and the check of the table.
//!
//! Only the data are here, each field declared once; [`control`](crate::control) and
//! [`supervision`](crate::supervision) use them. A gain table in another crate imports only this module.
//!
//! ```
//! # mod gains { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/gains.rs")); }
//! use gains::TABLE;
//! use upright::table::{Law, TableError};
//!
//! TABLE.check()?;
//! assert!(TABLE.law(Law::Lqr).is_some());
//! let mut damaged = TABLE;
//! damaged.tick_s *= 2.0;
//! assert_eq!(damaged.check(), Err(TableError::Crc));
//! # Ok::<(), TableError>(())
//! ```

mod chain_model;
pub mod checksum;
mod columns;
mod drive;
mod equilibrium;
mod error;
mod force;
mod format;
mod friction;
mod gain_table;
mod law;
mod limits;
mod motor;
mod observer;
mod part;
mod sensor;
mod steps;
mod stilling;
mod swing_up;
mod thresholds;
#[cfg(feature = "firmware")]
mod words;

pub use crate::numbers::{Number, Scalar};
pub use chain_model::{ChainModel, Turning};
pub use checksum::ChecksumScan;
pub use columns::columns;
pub use drive::DriveMap;
pub use equilibrium::Equilibrium;
pub use error::TableError;
pub use force::{ForceMap, Late};
pub use format::TABLE_FORMAT;
pub use friction::FrictionMap;
pub use gain_table::GainTable;
pub use law::{Law, LawGains, PerLaw};
pub use limits::{Limits, SETPOINT_MARGIN};
pub use motor::MotorMap;
pub use observer::ObserverGains;
#[cfg(test)]
pub(crate) use part::WordsMut;
pub use part::{Part, Reader, Resize, Shape, Variant, Words};
pub use sensor::{PartReading, ReadingMap, SensorKind, SensorRow, without_errors};
pub use steps::StepMap;
pub use stilling::{ImitatedBase, StillingGains};
#[cfg(feature = "firmware")]
pub use swing_up::FillTransitions;
pub use swing_up::{
    MOST_TRANSITIONS, MotionLimits, MotionTable, Motions, NoSwingUp, SwingUp, SwingUpTable, TransitionTable,
};
pub use thresholds::{MotorTest, Thresholds};
#[cfg(feature = "firmware")]
pub use words::{Fill, WordReader};

#[cfg(test)]
mod tests;
