//! The independent watchdog: resets the microcontroller, which turns the motor off, when ticks stop.

use stm32f4xx_hal::pac::IWDG;
use upright::gains::TICK_S;

/// Watchdog counts in three ticks, at 32 kHz / 4. Its oscillator runs at 17 to 47 kHz, so the real time is two to six
/// ticks. (The motor's timer does not depend on it.)
const COUNTS: u16 = {
    let counts = (3.0 * TICK_S as f64 * 8_000.0) as u32 + 1;
    assert!(counts <= 0xfff, "tick.period_s: the watchdog cannot wait so long");
    counts as u16
};

/// The watchdog. It starts with the first healthy tick; until then, the motor has never been on.
pub(super) struct Watchdog {
    registers: IWDG,
    running: bool,
}

impl Watchdog {
    /// A watchdog that is not yet running.
    pub(super) fn new(registers: IWDG) -> Self {
        Self { registers, running: false }
    }

    /// Restarts the watchdog's count; starts the watchdog if necessary. Nothing can stop it afterwards (RM0090, 21.3).
    pub(super) fn feed(&mut self) {
        let watchdog = &self.registers;
        // SAFETY: keys, prescaler and reload value of RM0090, 21.4.
        unsafe {
            if !self.running {
                watchdog.kr().write(|w| w.bits(0xcccc));
                watchdog.kr().write(|w| w.bits(0x5555));
                watchdog.pr().write(|w| w.bits(0));
                watchdog.rlr().write(|w| w.bits(COUNTS.into()));
                self.running = true;
            }
            watchdog.kr().write(|w| w.bits(0xaaaa));
        }
    }
}
