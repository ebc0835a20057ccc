//! RISC-V: the first instructions, calls of the emulator, and the counter of cycles as a clock.

use core::arch::{asm, global_asm};

global_asm!(
    ".section .start, \"ax\"",
    ".global start",
    "start:",
    "la sp, stack_top",
    "call {main}",
    main = sym crate::main,
);

/// A call of the emulator with a block of parameters.
pub(crate) fn call(number: usize, parameters: &[usize; 3]) -> usize {
    call_with(number, parameters.as_ptr() as usize)
}

/// A call of the emulator with one parameter.
pub(crate) fn call_with(number: usize, parameter: usize) -> usize {
    let answer;
    // SAFETY: the emulator reads or writes what the caller's parameters name. It knows a call by the three
    // instructions, which must not be compressed and lie in one page.
    unsafe {
        asm!(
            ".balign 16",
            ".option push",
            ".option norvc",
            "slli x0, x0, 0x1f",
            "ebreak",
            "srai x0, x0, 7",
            ".option pop",
            inout("a0") number => answer,
            in("a1") parameter,
        )
    };
    answer
}

/// The counter runs from the start.
pub(crate) fn start_clock() {}

/// Now, in nanoseconds of the emulator.
pub(crate) fn time() -> u32 {
    let now;
    // SAFETY: reading it has no side effect.
    unsafe { asm!("csrr {}, mcycle", out(reg) now) };
    now
}

/// Nanoseconds since then.
pub(crate) fn elapsed(begin: u32) -> u32 {
    time().wrapping_sub(begin)
}

/// There is no floating-point unit: nothing to set.
pub(crate) fn flush_subnormals() {}
