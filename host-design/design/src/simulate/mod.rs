//! The closed loop on the host: the firmware's own controller against the nonlinear plant.

mod bench;
mod closed_loop;
mod hand;
mod scenario;
mod session;
mod summary;
mod trace;

pub use bench::Bench;
pub use closed_loop::ticks;
pub use closed_loop::{SimulationError, run, simulate};
pub use hand::{Act, Hand, Seen};
pub use scenario::{Scenario, Sensing};
pub use session::{Interference, Session, Tick};
pub use summary::{Fall, FallKind, Summary};
pub use trace::{Sample, Trace};
