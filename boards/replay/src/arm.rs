//! Cortex-M: the first instructions, calls of the emulator, and SysTick as a clock.

use core::arch::{asm, global_asm};

global_asm!(
    ".section .start, \"ax\"",
    ".word stack_top",
    ".word start",
    ".global start",
    ".type start, %function",
    ".thumb_func",
    "start:",
    "ldr r0, =0xe000ed88", // CPACR: the floating-point unit, if there is one
    "ldr r1, =0x00f00000",
    "str r1, [r0]",
    "dsb",
    "isb",
    "bl {main}",
    main = sym crate::main,
);

// The arithmetic of the image for a Raspberry Pi Pico, so that it is compared with the host's, too.
#[cfg(armv6m)]
global_asm!(include_str!("../../rp2040/src/board/arithmetic.s"), options(raw));

const CONTROL: *mut u32 = 0xe000_e010 as *mut u32;
const RELOAD: *mut u32 = 0xe000_e014 as *mut u32;
const CURRENT: *mut u32 = 0xe000_e018 as *mut u32;

/// A call of the emulator with a block of parameters.
pub(crate) fn call(number: usize, parameters: &[usize; 3]) -> usize {
    call_with(number, parameters.as_ptr() as usize)
}

/// A call of the emulator with one parameter.
pub(crate) fn call_with(number: usize, parameter: usize) -> usize {
    let answer;
    // SAFETY: the emulator reads or writes what the caller's parameters name.
    unsafe { asm!("bkpt 0xab", inout("r0") number => answer, in("r1") parameter) };
    answer
}

/// Starts the clock.
pub(crate) fn start_clock() {
    // SAFETY: the registers of SysTick, whose interrupt stays off.
    unsafe {
        RELOAD.write_volatile(0x00ff_ffff);
        CURRENT.write_volatile(0);
        CONTROL.write_volatile(0b101);
    }
}

/// Now, in clocks of the machine.
pub(crate) fn time() -> u32 {
    // SAFETY: reading it has no side effect.
    unsafe { CURRENT.read_volatile() }
}

/// Clocks since then; SysTick counts down, with 24 bits.
pub(crate) fn elapsed(begin: u32) -> u32 {
    begin.wrapping_sub(time()) & 0x00ff_ffff
}

/// Sets FZ of the floating-point unit.
pub(crate) fn flush_subnormals() {
    #[cfg(target_abi = "eabihf")]
    // SAFETY: only this bit is changed, and only to show that it matters.
    unsafe {
        asm!("vmrs {0}, fpscr", "orr {0}, {0}, #0x01000000", "vmsr fpscr, {0}", out(reg) _)
    };
}
