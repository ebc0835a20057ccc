//! The clock tree: 168 MHz from the crystal. Every wait is bounded.
//!
//! | clock | frequency | for |
//! |---|---|---|
//! | SYSCLK, HCLK | 168 MHz | core, SysTick |
//! | PCLK1 | 42 MHz | USART2; timers 2 to 5 at 84 MHz |
//! | PCLK2 | 84 MHz | ADC at 21 MHz; timers 1 and 8 at 168 MHz |
//!
//! If a wait times out, the core stays on the internal 16 MHz oscillator: slow, but able to report the fault. The
//! voltage scaling for 168 MHz is the one after a reset (RM0090, 5.4.1; RM0390, 5.4.1).

use stm32f4xx_hal::pac::{FLASH, RCC};
use upright::protocol::message::Reset;

/// Core clock (Hz).
pub(crate) const CLOCK_HZ: u32 = 168_000_000;

/// Iterations of a waiting loop: at 16 MHz and at least 4 cycles each, 50 ms or more. A crystal starts within 10 ms.
const PATIENCE: u32 = 200_000;

/// The clock that the core uses after the set-up.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Clock {
    /// PLL and crystal: [`CLOCK_HZ`].
    Full,
    /// The internal 16 MHz oscillator: the crystal or the PLL did not start.
    Fallback,
}

impl Clock {
    /// Frequency of the bus of USART2 (Hz).
    pub(super) fn usart2_bus_hz(self) -> u32 {
        match self {
            Clock::Full => CLOCK_HZ / 4,
            Clock::Fallback => 16_000_000,
        }
    }
}

/// Starts the crystal and the PLL. If both start, switches the core to them.
pub(super) fn set_up(rcc: &RCC, flash: &FLASH) -> Clock {
    match try_set_up(rcc, flash) {
        Some(()) => Clock::Full,
        None => Clock::Fallback,
    }
}

fn try_set_up(rcc: &RCC, flash: &FLASH) -> Option<()> {
    // A Nucleo's debugger supplies 8 MHz; the other boards have an 8 MHz crystal.
    rcc.cr().modify(|_, w| w.hsebyp().bit(cfg!(feature = "stm32f446")).hseon().set_bit());
    wait(|| rcc.cr().read().hserdy().bit_is_set())?;
    // 8 MHz / 4 × 168 / 2 = 168 MHz (RM0090, 7.3.2); the PLL's input is at 2 MHz, where its jitter is lowest.
    // SAFETY: factors within the limits given there: 2 to 63, 50 to 432, 0 for a division by 2, 2 to 15.
    rcc.pllcfgr().modify(|_, w| unsafe {
        w.pllsrc().set_bit().pllm().bits(4).plln().bits(168).pllp().bits(0).pllq().bits(7)
    });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    // Five wait states above 150 MHz at 3.3 V (RM0090, 3.5.1; the same for F446: RM0390, 3.4.1).
    // SAFETY: a value of this table.
    flash.acr().write(|w| unsafe { w.bits(5 | 1 << 8 | 1 << 9 | 1 << 10) });
    wait(|| flash.acr().read().bits() & 15 == 5)?;
    // Buses before the core, so that they never run too fast: HCLK / 4 and / 2 (RM0090, 7.3.3).
    // SAFETY: divisors of this register.
    rcc.cfgr().modify(|_, w| unsafe { w.hpre().bits(0).ppre1().bits(0b101).ppre2().bits(0b100) });
    wait(|| rcc.cr().read().pllrdy().bit_is_set())?;
    // SAFETY: 2 is the PLL.
    rcc.cfgr().modify(|_, w| unsafe { w.sw().bits(2) });
    wait(|| rcc.cfgr().read().sws().bits() == 2)?;
    // If the crystal stops later, the hardware switches the motor timer's output off and raises the non-maskable
    // interrupt (RM0090, 7.2.7).
    rcc.cr().modify(|_, w| w.csson().set_bit());
    Some(())
}

/// Waits for a flag, for at most [`PATIENCE`] iterations.
fn wait(ready: impl Fn() -> bool) -> Option<()> {
    (0..PATIENCE).any(|_| ready()).then_some(())
}

/// Reason for the last reset (RM0090, 7.3.21); clears the flags.
pub(super) fn reset_reason(rcc: &RCC, crashed: bool) -> Reset {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    // Every reset also sets the reset pin's flag, and power-on sets that of the brown-out detector, so the rarer flags
    // come first.
    if flags.porrstf().bit_is_set() {
        Reset::Power
    } else if crashed || flags.sftrstf().bit_is_set() {
        Reset::Software
    } else if flags.wdgrstf().bit_is_set() {
        Reset::Watchdog
    } else {
        Reset::Power
    }
}
