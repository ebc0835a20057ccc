//! The closed loop on the host: the firmware's own controller against the nonlinear plant.

mod any_controller;
mod bench;
mod closed_loop;
mod error;
mod lockstep;
mod motion;
mod scenario;
mod summary;
mod trace;

pub use bench::Bench;
pub use closed_loop::{run, simulate, ticks};
pub use error::SimulationError;
pub use lockstep::{Job, run_all};
pub(crate) use motion::{Extremes, follow};
pub use scenario::{Begin, Goal, Scenario, Sensing};
pub use summary::{Fall, FallKind, Summary};
pub use trace::{Sample, Trace};
