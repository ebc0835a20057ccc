//! The whole firmware in closed loop with the simulated rig, from power-up on.
//!
//! A firmware is a [`Target`]: it takes the pins of one tick and returns the output of that tick, and what it has sent
//! over its serial line. [`with_firmware`] runs the firmware's tasks in this process; an image in an emulator is
//! another target. Everything else is the same code for all targets, so that two runs of a scenario can be compared
//! bit by bit: a [`Session`] sends commands and collects telemetry, a [`Harness`] adds the rig and the person who
//! raises it, and [`record`] runs a scenario.
//!
//! No type here depends on the numbers of states and sensors, except the firmware itself.
//!
//! ```
//! use upright::table::Law;
//! use upright_design::design::design;
//! use upright_design::harness::{record, with_firmware};
//! use upright_design::rig::Rig;
//! use upright_design::simulate::Scenario;
//! use upright_design::table::{Gains, TableValues};
//!
//! let rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref())?;
//! let table = TableValues::of(&rig, &design(&rig)?, Gains::Sampled)?;
//! let mut scenario = Scenario::at_rest(&rig, Law::Lqr);
//! scenario.duration_s = 1.0;
//! let recording = with_firmware(&table, |firmware| record(&rig, &table, &scenario, firmware))??;
//! assert!(recording.fault.is_none() && recording.summary.survives());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod held_rig;
mod host;
mod in_process;
mod operator;
mod rail_ends;
mod record;
mod session;
mod start_up;
mod target;

pub use error::HarnessError;
pub use held_rig::HeldRig;
pub(crate) use host::Host;
pub use in_process::{endless_firmware, with_firmware, with_table};
pub use operator::{Operator, OperatorTick, Status};
pub use rail_ends::RailEnds;
pub use record::{FirmwareTick, Recording, goals, record};
pub use session::Session;
pub use start_up::Harness;
pub use target::{Pace, Pins, Target, healthy};
