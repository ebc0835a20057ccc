//! Guards against a stack overflow, a low supply of the microcontroller, and an image on the wrong chip.

use crate::pac::{DBGMCU, EXTI, PWR};
use cortex_m::peripheral::MPU;
use upright::boards::f4::F4Chip;

use super::chosen::BOARD;

/// Bit of the EXTI line to which the voltage detector is connected (RM0090, 12.2.5).
const DETECTOR: u32 = 1 << 16;

/// Identity of an STM32F2, which an STM32F405 or STM32F407 of revision A has, too (ES0182). No image gets as far as
/// this on an STM32F2: it has no floating-point unit.
const F2_OR_REVISION_A: u32 = 0x411;

/// Whether this is the chip that the image is for (RM0090, 38.6.1; RM0390, 33.6.1). Also makes the watchdog wait while
/// a debugger halts the processor.
pub(super) fn chip_is_right(debug: &DBGMCU) -> bool {
    debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    let identity = debug.idcode().read().bits() & 0xfff;
    identity == BOARD.chip.identity() || !matches!(BOARD.chip, F4Chip::F446) && identity == F2_OR_REVISION_A
}

/// Makes every access to the 64 KiB below the stack a fault: the stack is at the start of the SRAM, and without this,
/// writes to the reserved space before it may be ignored. (The factory data are in this range, too: read them first.)
pub(super) fn protect_stack(mpu: &MPU) {
    // SAFETY: nothing uses this space; all other memory stays as it is (PRIVDEFENA).
    unsafe {
        mpu.rbar.write(0x1fff_0000 | 1 << 4);
        // No access, not executable, 2^16 bytes.
        mpu.rasr.write(1 << 28 | 15 << 1 | 1);
        mpu.ctrl.write(1 << 2 | 1);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// Level of the voltage detector (RM0090, 5.4.1): 168 MHz needs 2.7 V. Level 5 reports a supply that falls below 2.84 V
/// (2.65 to 2.92 V), and on until it rises above 2.99 V at most, so a board that runs from 3.0 V has level 4: 2.66 V
/// (2.59 to 2.71 V; datasheet DS8626, embedded reset and power control block).
const LEVEL: u8 = if BOARD.reference_v < 3.2 { 4 } else { 5 };

/// Starts the voltage detector.
pub(super) fn watch_supply(power: &PWR, exti: &EXTI) {
    // Full voltage scaling, as after a reset; on.
    // SAFETY: values of the fields described there.
    power.cr().modify(|_, w| unsafe { w.pls().bits(LEVEL).pvde().set_bit() });
    exti.rtsr().modify(|_, w| w.tr16().set_bit());
    exti.imr().modify(|_, w| w.mr16().set_bit());
}

/// Whether the supply has been low since the last call.
pub(super) fn supply_was_low(power: &PWR, exti: &EXTI) -> bool {
    let was_low = exti.pr().read().bits() & DETECTOR != 0;
    if was_low {
        // Writing a one clears this bit and no other.
        // SAFETY: any combination of bits is allowed.
        exti.pr().write(|w| unsafe { w.bits(DETECTOR) });
    }
    // Without a branch: this is read in every tick.
    was_low | power.csr().read().pvdo().bit_is_set()
}
