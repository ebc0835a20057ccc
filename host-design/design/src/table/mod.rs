//! The gain table on the host: its values for any number of states, as a firmware table and as Rust source.

mod any_size;
mod contents;
mod error;
mod friction;
mod source;
mod supervision;
mod swing_up;
mod values;
mod write;

pub(crate) use any_size::widest;
pub use any_size::{MAX_MODEL_SENSORS, MAX_SENSORS, MAX_STATES, WithSize, with_firmware_size, with_size};
pub use error::NoTable;
pub use source::{gains_source, identity_differences};
pub use swing_up::{MotionValues, SwingUpValues};
pub use values::{Gains, LawValues, TableValues};
pub use write::{WriteError, write_atomically};
