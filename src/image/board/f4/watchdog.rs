//! The independent watchdog: resets the microcontroller, which turns the motor off, when ticks stop.

use crate::pac::IWDG;
use upright::boards::f4::TICK_US;

use super::clock::Clock;

/// Watchdog counts in three ticks of `tick_s`, at 32 kHz / 4. Its oscillator runs at 17 to 47 kHz, so the real time is
/// two to six ticks. (The motor's timer does not depend on it.)
const fn counts(tick_s: f32) -> u32 {
    (3.0 * tick_s as f64 * 8_000.0) as u32 + 1
}
const _: () = assert!(counts(TICK_US[1] as f32 / 1e6) <= 0xfff, "the watchdog waits for the longest tick");

/// Iterations of the loop that waits for the new values: at least 2 ms at 168 MHz. They take effect within five
/// periods of the watchdog's oscillator, 0.3 ms, once it has started.
const PATIENCE: u32 = 100_000;

/// The watchdog. Once it runs, nothing can stop it (RM0090, 21.3).
pub(super) struct Watchdog {
    registers: IWDG,
    counts: u16,
}

impl Watchdog {
    /// The watchdog, not yet started, for ticks of `tick_s`.
    pub(super) fn new(registers: IWDG, tick_s: f32) -> Self {
        Self { registers, counts: counts(tick_s) as u16 }
    }

    /// Starts the watchdog and waits until the new values have taken effect: until then, a restart would use the reset
    /// value, 512 ms (21.4.4). On the internal oscillator, ticks are 10.5 times as long; the watchdog then counts 16
    /// times as slowly.
    pub(super) fn start(&self, clock: Clock) {
        let registers = &self.registers;
        let prescaler = if clock == Clock::Full { 0 } else { 4 };
        // SAFETY: keys, prescaler and reload value of RM0090, 21.4.
        unsafe {
            registers.kr().write(|w| w.bits(0xcccc));
            registers.kr().write(|w| w.bits(0x5555));
            registers.pr().write(|w| w.bits(prescaler));
            registers.rlr().write(|w| w.bits(self.counts));
        }
        // If they do not take effect in time, the watchdog starts at 512 ms; the motor's timer does not need it.
        let _ = (0..PATIENCE).any(|_| registers.sr().read().bits() == 0);
        self.feed();
    }

    /// Restarts the watchdog's count.
    pub(super) fn feed(&self) {
        // SAFETY: a key of RM0090, 21.4.
        self.registers.kr().write(|w| unsafe { w.bits(0xaaaa) });
    }
}
