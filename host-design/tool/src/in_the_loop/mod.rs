//! Where the whole firmware runs in closed loop with the simulated rig: on the host in this process, or as an image in
//! QEMU. The loop itself is [`upright_design::harness`].

mod place;
mod qemu;
mod relay;

pub use place::{Place, RunError, run};
pub use qemu::{Emulator, EmulatorError, Link};
pub use relay::{RelayError, serve};
