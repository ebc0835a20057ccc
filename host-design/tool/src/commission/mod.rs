//! From a wired rig to a balancing one, step by step.
//!
//! A [`MachineAtHand`] is a rig with its firmware and the person beside it: the real ones, or simulated ones. The guide
//! tells the person what to do ([`PersonTask`]), watches the telemetry, and stops at the first [`CommissionStep`] in
//! which the machine is not as it has to be. Everything goes into a [`CommissionRecord`].
//!
//! - [`AtPort`]: the real machine behind a port, and the person at the terminal.
//! - [`Simulated`]: a machine that differs from its file, with a person who does what is asked; [`Planted`] defects.
//! - [`Commissioning`]: the steps.
//!
//! ```
//! use upright_tool::commission::{CommissionStep, Planted};
//!
//! let reversed: Planted = "motor-reversed".parse()?;
//! assert_eq!(reversed.found_in(1), CommissionStep::Motor);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod at_port;
mod balance;
mod commissioning;
mod contacts;
mod designing;
mod guide;
mod homing;
mod machine;
mod motor;
mod plan;
mod planted;
mod record;
mod shaking;
mod signs;
mod simulated;
mod step;
mod task;
mod zeros;

pub use at_port::AtPort;
pub use commissioning::Commissioning;
pub use designing::Designed;
pub use machine::{MachineAtHand, Stop};
pub use plan::CommissionPlan;
pub use planted::{NoSuchDefect, Planted};
pub use record::{CommissionOutcome, CommissionRecord, Journal, StepRecord};
pub use simulated::Simulated;
pub use step::CommissionStep;
pub use task::{End, PersonTask};
pub use zeros::measured_zeros;
