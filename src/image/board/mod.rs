//! The board of this image: the only code that accesses registers, and the only code with `unsafe`.
//!
//! A family of boards is a folder such as `f4`. Another one would provide the same names: `set_up` makes
//! a [`Hardware`] for the control task and a [`SerialLine`] for the background task, with a [`Buffer`] for its bytes,
//! and a [`MemoryCheck`] that finds memory that has changed; `tables` are those of the rig; `start_ticks` starts the
//! interrupt of the control task, and `sleep` waits for an interrupt; `stop` turns the motor off for good;
//! `CLOCK_HZ` is the core clock, `TICK_US` the range of ticks.

#![allow(unsafe_code)]

use cortex_m::register::control::{self, Fpca};

mod f4;
mod handlers;

use f4::sleep;
pub(crate) use f4::{
    CLOCK_HZ, DmaBuffer as Buffer, DmaLine as SerialLine, F4Hardware as Hardware, MemoryCheck, TICK_US,
    set_up, start_ticks, stop, tables,
};
pub(crate) use handlers::stop_for_memory;

/// Waits for the next interrupt.
///
/// The floating-point registers are marked as unused before: the background task uses them only between two waits, so
/// an interrupt does not have to save them, and begins and ends 17 cycles sooner (ARM DDI 0403, B1.5.7).
// Not inlined: a caller keeps nothing across a call in the registers that the interrupt then leaves unsaved.
#[inline(never)]
pub(crate) fn wait_for_interrupt() {
    let mut control = control::read();
    control.set_fpca(Fpca::NotActive);
    // SAFETY: only the bit that says whether floating-point registers are in use is changed.
    unsafe { control::write(control) };
    sleep();
}
