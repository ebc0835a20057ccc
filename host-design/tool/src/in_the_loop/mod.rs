//! The whole firmware in closed loop with the nonlinear plant: on the host in this process, or as an image in QEMU.
//!
//! Both are a [`Target`]: they take the pins of one tick and give the output of that tick, and what has come over the
//! serial line. Everything else (homing, arming, scenario, record) is the same code for both, so that two runs of a
//! scenario can be compared bit by bit.

mod in_process;
mod qemu;
mod relay;
mod run;
mod session;
mod stage;
mod target;

pub use in_process::{InProcess, Queues};
pub use qemu::{Emulator, Link};
pub use relay::{RelayError, serve};
pub use run::{Recording, RunError, Tick, Where, run};
pub use session::{Session, SessionError};
pub use stage::Stage;
pub use target::{Target, TargetError};
