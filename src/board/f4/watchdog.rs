//! The independent watchdog: a reset, motor off, when ticks stop.

use stm32f4xx_hal::pac::IWDG;
use upright::gains::TICK_S;

/// Counts of the watchdog, at 32 kHz / 4, in three ticks; its oscillator has 17 to 47 kHz, so two ticks at least, six at
/// most. (The motor's timer does not wait for it.)
const COUNTS: u16 = {
    let counts = (3.0 * TICK_S as f64 * 8_000.0) as u32 + 1;
    assert!(counts <= 0xfff, "tick.period_s: the watchdog cannot wait so long");
    counts as u16
};

/// The watchdog. It starts with the first healthy tick; before that, nothing has ever turned the motor on.
pub(super) struct Watchdog {
    registers: IWDG,
    running: bool,
}

impl Watchdog {
    /// Not yet running.
    pub(super) fn new(registers: IWDG) -> Self {
        Self { registers, running: false }
    }

    /// Starts its count anew. Nothing can stop it (RM0090, 21.3).
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
