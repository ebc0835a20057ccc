//! The closed loop on the host: the firmware's own controller against the nonlinear plant.
//!
//! ```
//! use upright::table::Law;
//! use upright_design::design::design;
//! use upright_design::rig::Rig;
//! use upright_design::simulate::{Scenario, simulate};
//! use upright_design::table::{Gains, TableValues};
//!
//! let rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref())?;
//! let table = TableValues::of(&rig, &design(&rig)?, Gains::Sampled)?;
//! let mut scenario = Scenario::at_rest(&rig, Law::Lqr);
//! scenario.start[2] = 0.02;
//! let (_, summary) = simulate(&rig, &table, &scenario)?;
//! assert!(summary.survives());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod any_controller;
mod bench;
mod closed_loop;
mod disturbance;
mod drive;
mod driven_cart;
mod error;
mod hand_push;
mod lockstep;
mod motion;
mod scenario;
mod sensor;
mod servo;
mod summary;
mod trace;

pub use bench::Bench;
pub use closed_loop::{run, simulate, ticks};
pub use disturbance::Disturbance;
pub use drive::StepDefect;
pub use error::SimulationError;
pub use hand_push::HandPush;
pub use lockstep::{Job, run_all};
pub use motion::{Extremes, follow};
pub use scenario::{Begin, Goal, Scenario, Sensing};
pub use summary::{Fall, FallKind, Summary};
pub use trace::{Sample, Trace};
