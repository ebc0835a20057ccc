//! The clock tree: 168 MHz from the crystal. Every wait is bounded.
//!
//! | clock | frequency | for |
//! |---|---|---|
//! | SYSCLK, HCLK | 168 MHz | core, SysTick |
//! | PCLK1 | 42 MHz | the USART; timers 2 to 5 at 84 MHz |
//! | PCLK2 | 84 MHz | ADC at 21 MHz; timers 1 and 8 at 168 MHz |
//!
//! The crystal is measured against the internal oscillator before it is used. If its frequency is wrong, or if
//! anything does not start, the core stays on the internal 16 MHz oscillator with all buses undivided: slow, but able
//! to report the fault. The voltage scaling for 168 MHz is the default after a reset (RM0090, 5.4.1; RM0390, 5.4.1).

use crate::pac::{FLASH, RCC, TIM11};
use upright::boards::f4::HseSource;
use upright::protocol::message::Reset;

use super::chosen::BOARD;
use super::serial;

/// Core clock (Hz).
pub(crate) const CLOCK_HZ: u32 = 168_000_000;

/// Frequency of the internal oscillator (Hz), within 1 % at room temperature.
const INTERNAL_HZ: u32 = 16_000_000;

/// Frequency of the crystal, or of the external clock in its place (Hz).
const CRYSTAL_HZ: u32 = BOARD.crystal_hz;
/// Input divider of the PLL: to 2 MHz, where its jitter is lowest, or to 1 MHz (RM0090, 7.3.2).
const PLL_M: u32 =
    if CRYSTAL_HZ.is_multiple_of(2_000_000) { CRYSTAL_HZ / 2_000_000 } else { CRYSTAL_HZ / 1_000_000 };
/// Multiplier of the PLL: to twice the core clock.
const PLL_N: u32 = 2 * CLOCK_HZ / (CRYSTAL_HZ / PLL_M);
const _: () = assert!(
    CRYSTAL_HZ / PLL_M * PLL_N == 2 * CLOCK_HZ && PLL_M >= 2 && PLL_M <= 26,
    "the board's crystal_hz: the PLL cannot make the core clock from it"
);

/// Iterations of a waiting loop: at 16 MHz and 4 to 24 cycles each, 12 to 75 ms. A crystal starts within 10 ms.
const PATIENCE: u32 = 50_000;

/// Bits of RCC_CR that code may write; the others belong to the hardware or are reserved (RM0090, 7.3.1).
const CONTROL_BITS: u32 = 0x050d_00f9;

/// The clock that the core uses after the set-up.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Clock {
    /// PLL and crystal: [`CLOCK_HZ`].
    Full,
    /// The internal oscillator: the crystal or the PLL did not start, or the crystal has another frequency.
    Fallback,
}

impl Clock {
    /// Frequency of the bus of USART2 and USART3 (Hz).
    pub(super) fn usart_bus_hz(self) -> u32 {
        match self {
            Clock::Full => CLOCK_HZ / 4,
            Clock::Fallback => INTERNAL_HZ,
        }
    }
}

/// Enables the clocks of all peripherals in use.
pub(super) fn enable_peripherals(rcc: &RCC) {
    rcc.ahb1enr().modify(|_, w| {
        w.gpioaen().set_bit().gpioben().set_bit().gpiocen().set_bit().gpioden().set_bit().dma1en().set_bit()
    });
    rcc.apb1enr().modify(|_, w| {
        w.tim2en().set_bit().tim3en().set_bit().tim4en().set_bit().tim5en().set_bit();
        w.usart2en().bit(serial::NUMBER == 2).usart3en().bit(serial::NUMBER == 3).pwren().set_bit()
    });
    rcc.apb2enr().modify(|_, w| {
        w.tim1en().set_bit().tim8en().set_bit().tim11en().set_bit().adc1en().set_bit().syscfgen().set_bit()
    });
    // A write to a peripheral may be lost during the first two bus cycles after its clock was enabled (ES0182 2.1.13,
    // ES0298 2.1.6). The barrier waits for the write to the enable register, the delay for those cycles.
    cortex_m::asm::dsb();
    cortex_m::asm::delay(16);
}

/// Starts the crystal and the PLL. If both start and the crystal has the right frequency, switches the core to the
/// PLL.
pub(super) fn set_up(rcc: &RCC, flash: &FLASH, timer: &TIM11) -> Clock {
    match start_crystal(rcc).and_then(|()| measure_crystal(rcc, timer)).and_then(|()| start_pll(rcc, flash)) {
        Some(()) => Clock::Full,
        None => {
            // The internal oscillator, nothing divided.
            rcc.cfgr().reset();
            Clock::Fallback
        }
    }
}

/// Sets bits of RCC_CR.
fn set(rcc: &RCC, bits: u32) {
    // SAFETY: only bits that code may write.
    rcc.cr().modify(|r, w| unsafe { w.bits((r.bits() | bits) & CONTROL_BITS) });
}

/// Clears bits of RCC_CR.
fn clear(rcc: &RCC, bits: u32) {
    // SAFETY: only bits that code may write.
    rcc.cr().modify(|r, w| unsafe { w.bits(r.bits() & CONTROL_BITS & !bits) });
}

const HSEON: u32 = 1 << 16;
const HSEBYP: u32 = 1 << 18;
const CSSON: u32 = 1 << 19;
const PLLON: u32 = 1 << 24;

fn start_crystal(rcc: &RCC) -> Option<()> {
    BOARD.sources.iter().find_map(|&source| {
        // The bypass can be changed only while the oscillator is off.
        clear(rcc, HSEON);
        clear(rcc, HSEBYP);
        set(rcc, if source == HseSource::Clock { HSEBYP } else { 0 });
        set(rcc, HSEON);
        wait(|| rcc.cr().read().hserdy().bit_is_set())
    })
}

/// Divider of the crystal's clock for the measurement.
const DIVISOR: u32 = 25;
/// Number of captures after the first one; the timer captures every eighth edge of the divided clock.
const CAPTURES: u32 = 16;
/// Largest accepted deviation of the crystal from its frequency (%): the tolerance of the internal oscillator, with a
/// margin.
const DEVIATION_PERCENT: u32 = 3;

/// Measures the crystal: timer 11 counts the internal oscillator between edges of the crystal (RM0090, 19.5.11:
/// TI1_RMP = 10). `None` if the frequency is not [`CRYSTAL_HZ`].
fn measure_crystal(rcc: &RCC, timer: &TIM11) -> Option<()> {
    // SAFETY, here and below: values within the fields described there.
    rcc.cfgr().write(|w| unsafe { w.rtcpre().bits(DIVISOR as u8) });
    timer.or().write(|w| unsafe { w.bits(0b10) });
    timer.ccmr1_input().write(|w| unsafe { w.bits(0b11 << 2 | 0b01) });
    timer.ccer().write(|w| w.cc1e().set_bit());
    timer.cr1().write(|w| w.cen().set_bit());
    let capture = || {
        wait(|| timer.sr().read().cc1if().bit_is_set())?;
        Some(timer.ccr1().read().bits() as u16)
    };
    let first = capture()?;
    let last = (0..CAPTURES).try_fold(first, |_, _| capture())?;
    timer.cr1().write(|w| w.cen().clear_bit());
    // The counter wraps at 16 bits. With a crystal of 1 MHz or more, it counts less than one whole range between the
    // first edge and the last.
    let counted = u32::from(last.wrapping_sub(first));
    const EXPECTED: u32 = (INTERNAL_HZ as u64 * (8 * DIVISOR * CAPTURES) as u64 / CRYSTAL_HZ as u64) as u32;
    const { assert!(EXPECTED < 32_768, "the crystal is too slow for this measurement") };
    (counted.abs_diff(EXPECTED) <= EXPECTED * DEVIATION_PERCENT / 100).then_some(())
}

fn start_pll(rcc: &RCC, flash: &FLASH) -> Option<()> {
    // SAFETY: factors within the limits of RM0090, 7.3.2: 2 to 63, 50 to 432, 0 for a division by 2, 2 to 15.
    rcc.pllcfgr().modify(|_, w| unsafe {
        w.pllsrc().set_bit().pllm().bits(PLL_M as u8).plln().bits(PLL_N as u16);
        w.pllp().bits(0).pllq().bits(7)
    });
    set(rcc, PLLON);
    // Five wait states above 150 MHz at 3.3 V (RM0090, 3.5.1; the same for F446: RM0390, 3.4.1).
    // SAFETY: a value of this table.
    flash.acr().write(|w| unsafe { w.bits(5 | 1 << 8 | 1 << 9 | 1 << 10) });
    wait(|| flash.acr().read().bits() & 15 == 5)?;
    wait(|| rcc.cr().read().pllrdy().bit_is_set())?;
    // The buses are divided before the core is switched, so that they never run too fast: HCLK / 4 and / 2 (RM0090,
    // 7.3.3).
    // SAFETY: valid dividers; source 2 is the PLL.
    rcc.cfgr().write(|w| unsafe { w.ppre1().bits(0b101).ppre2().bits(0b100) });
    rcc.cfgr().write(|w| unsafe { w.ppre1().bits(0b101).ppre2().bits(0b100).sw().bits(2) });
    wait(|| rcc.cfgr().read().sws().bits() == 2)?;
    // If the crystal stops later, the hardware switches the motor timer's output off and raises the non-maskable
    // interrupt (RM0090, 7.2.7).
    set(rcc, CSSON);
    Some(())
}

/// Waits for a flag, for at most [`PATIENCE`] iterations.
fn wait(ready: impl Fn() -> bool) -> Option<()> {
    (0..PATIENCE).any(|_| ready()).then_some(())
}

/// Reason for the last reset (RM0090, 7.3.21); clears the flags.
pub(super) fn reset_reason(rcc: &RCC, crashed: bool) -> Reset {
    let flags = rcc.csr().read();
    // SAFETY: RMVF; the other bits are the hardware's.
    rcc.csr().write(|w| unsafe { w.bits(1 << 24) });
    // Every reset also sets the reset pin's flag, and power-on sets that of the brown-out detector, so the rarer flags
    // come first. The flag of a reset by software comes from a debugger: this firmware never requests one.
    if flags.porrstf().bit_is_set() {
        Reset::Power
    } else if crashed {
        Reset::Software
    } else if flags.wdgrstf().bit_is_set() {
        Reset::Watchdog
    } else {
        Reset::Power
    }
}
