//! The gain table on the host: its values for any number of states, as a firmware table and as Rust source.
//!
//! ```
//! use upright_design::design::design;
//! use upright_design::rig::Rig;
//! use upright_design::table::{Gains, TableValues, gains_source};
//!
//! let rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref())?;
//! let table = TableValues::of(&rig, &design(&rig)?, Gains::Sampled)?;
//! assert_eq!((table.states(), table.sensors()), (4, 2));
//! assert!(gains_source(&rig, &table).contains("pub const STATES: usize = 4;"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod any_size;
mod class;
mod contents;
mod error;
mod friction;
mod image;
mod source;
mod stilling;
mod supervision;
mod swing_up;
mod values;
#[cfg(not(target_family = "wasm"))]
mod write;

pub use any_size::widest;
pub use any_size::{MAX_MODEL_SENSORS, MAX_SENSORS, MAX_STATES, WithSize, with_firmware_size, with_size};
pub use class::class_source;
pub use error::NoTable;
pub use image::image_tables;
pub use source::{gains_source, identity_differences};
pub use supervision::sensor_rows;
pub use swing_up::{MotionValues, SwingUpValues};
pub use values::{Gains, LawValues, TableValues, step_map};
#[cfg(not(target_family = "wasm"))]
pub use write::{WriteError, write_atomically};
