//! The closed loop on the host: the firmware's own controller against the nonlinear plant.

mod closed_loop;
mod plot;
mod scenario;
mod summary;
mod trace;

pub use closed_loop::{SimulationError, simulate};
pub use plot::{PlotError, svg};
pub use scenario::Scenario;
pub use summary::{Fall, FallKind, Summary};
pub use trace::Trace;
