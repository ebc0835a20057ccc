//! Panic and exception handlers. They turn the motor off.

use core::arch::global_asm;
use core::panic::PanicInfo;

use super::stop;

#[panic_handler]
fn panicked(_: &PanicInfo) -> ! {
    crashed(core::ptr::null())
}

/// Turns the motor off for good. Disables interrupts first, so that the tick cannot turn it on again. `frame` is where
/// the processor has saved its registers at the entry of an exception; null after a panic.
extern "C" fn crashed(frame: *const u32) -> ! {
    cortex_m::interrupt::disable();
    stop(frame)
}

/// Turns the motor off for good because memory has changed. In the record of this crash, the address stands for the
/// program counter.
#[cold]
pub(crate) fn stop_for_memory(address: u32) -> ! {
    crashed([0, 0, 0, 0, 0, 0, address, 0].as_ptr())
}

// After a stack overflow the stack pointer is below the memory. Pushing a register would fault again and lock up the
// core, so the stack pointer is reset before the first push.
global_asm!(
    ".section .HardFault.entry, \"ax\"",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "mov r0, sp",
    "ldr r1, =_stack_start",
    "mov sp, r1",
    "b {crashed}",
    ".size HardFault, . - HardFault",
    // All exceptions that have no handler of their own.
    ".global DefaultHandler",
    ".thumb_set DefaultHandler, HardFault",
    crashed = sym crashed,
);
