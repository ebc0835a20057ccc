//! The closed loop on the host: the firmware's own controller against the nonlinear plant.

mod bench;
mod closed_loop;
mod plot;
mod scenario;
mod summary;
mod trace;

pub use bench::Bench;
pub use closed_loop::{SimulationError, run, simulate};
pub use plot::svg;
pub use scenario::{Scenario, Sensing};
pub use summary::{Fall, FallKind, Summary};
pub use trace::{Sample, Trace};
