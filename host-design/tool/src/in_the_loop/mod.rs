//! Where the whole firmware runs in closed loop with the simulated rig: on the host in this process, or as the image
//! that is flashed, on the virtual board. The loop itself is [`upright_closed_loop::harness`].
//!
//! ```
//! use upright::table::Law;
//! use upright_design::design::design;
//! use upright_design::rig::Rig;
//! use upright_design::simulate::Scenario;
//! use upright_design::table::{Gains, TableValues};
//! use upright_tool::in_the_loop::{RunPlace, run};
//!
//! let rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref())?;
//! let table = TableValues::of(&rig, &design(&rig)?, Gains::Sampled)?;
//! let scenario = Scenario { duration_s: 1.0, ..Scenario::at_rest(&rig, Law::Lqr) };
//! assert!(run(&rig, &table, &scenario, RunPlace::Host)?.fault.is_none());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod board;
mod error;
mod place;
mod relay;

pub use board::{
    Compared, Event, Events, PulseWatch, RULES, Span, TickCycles, TickFigures, TooLong, VirtualBoard, measure,
};
pub use error::RunError;
pub use place::{RunPlace, run, run_compared, run_shaken};
pub use relay::serve;
