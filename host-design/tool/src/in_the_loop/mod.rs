//! Where the whole firmware runs in closed loop with the simulated rig: on the host in this process, as an image in
//! QEMU, or as the image that is flashed, on the virtual board. The loop itself is [`upright_design::harness`].

mod board;
mod error;
mod place;
mod qemu;
mod relay;

pub use board::{
    Compared, Event, Events, RULES, Span, TickCycles, TickFigures, TooLong, VirtualBoard, measure,
};
pub use error::RunError;
pub use place::{RunPlace, run, run_compared, run_shaken};
pub use qemu::{Emulator, EmulatorError, PinLink};
pub use relay::serve;
