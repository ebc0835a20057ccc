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

/// Starts the watchdog. Nothing can stop it (RM0090, 21.3).
pub(super) fn start(watchdog: &IWDG) {
    // SAFETY: keys, prescaler and reload value of RM0090, 21.4.
    unsafe {
        watchdog.kr().write(|w| w.bits(0xcccc));
        watchdog.kr().write(|w| w.bits(0x5555));
        watchdog.pr().write(|w| w.bits(0));
        watchdog.rlr().write(|w| w.bits(COUNTS.into()));
    }
    feed(watchdog);
}

/// Starts its count anew.
pub(super) fn feed(watchdog: &IWDG) {
    // SAFETY: the key for it.
    watchdog.kr().write(|w| unsafe { w.bits(0xaaaa) });
}
