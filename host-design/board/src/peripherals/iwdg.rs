//! The independent watchdog (RM0090, 21.4), on an oscillator of 17 to 47 kHz.

use super::Bits;
use crate::clock::{NEVER, Time, period};
use crate::error::Violation;

/// Periods of the oscillator until a new prescaler or reload value takes effect (21.4.4).
const UPDATE_PERIODS: Time = 5;

/// The watchdog.
#[derive(Debug, Clone)]
pub(crate) struct Iwdg {
    lsi: Time,
    unlocked: bool,
    running: bool,
    prescaler: u32,
    reload: u32,
    /// Prescaler that has taken effect; likewise the reload value below.
    prescaler_seen: u32,
    reload_seen: u32,
    prescaler_at: Time,
    reload_at: Time,
    expires_at: Time,
    /// Time at which the debugger froze it, if it has.
    frozen_at: Option<Time>,
    /// It can be started but resets nothing: for negative controls.
    pub(crate) ignored: bool,
}

impl Iwdg {
    pub(crate) fn new(lsi_hz: u32) -> Self {
        Self {
            lsi: period(lsi_hz),
            unlocked: false,
            running: false,
            prescaler: 0,
            reload: 0xfff,
            prescaler_seen: 0,
            reload_seen: 0xfff,
            prescaler_at: NEVER,
            reload_at: NEVER,
            expires_at: NEVER,
            frozen_at: None,
            ignored: false,
        }
    }

    pub(crate) fn reset(&mut self) {
        let ignored = self.ignored;
        *self = Self { lsi: self.lsi, ..Self::new(32_000) };
        self.ignored = ignored;
    }

    pub(crate) fn bits(offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 => Bits::writable(0xffff),
            0x04 => Bits::writable(7),
            0x08 => Bits::writable(0xfff),
            0x0c => Bits::writable(0).with_read_only(3),
            _ => return None,
        })
    }

    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x04 => self.prescaler,
            0x08 => self.reload,
            0x0c => u32::from(self.prescaler_at != NEVER) | u32::from(self.reload_at != NEVER) << 1,
            _ => 0,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Result<(), Violation> {
        self.advance(now);
        match (offset, value) {
            (0x00, 0x5555) => self.unlocked = true,
            (0x00, key) => {
                self.unlocked = false;
                match key {
                    0xaaaa if self.running => self.restart(now),
                    0xaaaa => {}
                    0xcccc if !self.running => {
                        self.running = true;
                        self.restart(now);
                    }
                    0xcccc => {}
                    _ => return Err(Violation::Forbidden("a key that the watchdog does not have (21.4.1)")),
                }
            }
            _ if !self.unlocked => {
                return Err(Violation::Forbidden("the watchdog's registers are locked (21.3.2)"));
            }
            (0x04, _) if self.prescaler_at != NEVER => {
                return Err(Violation::Forbidden(
                    "the watchdog's prescaler is written while PVU is set (21.4.4)",
                ));
            }
            (0x04, value) => {
                self.prescaler = value;
                self.prescaler_at = now + UPDATE_PERIODS * self.lsi;
            }
            (_, _) if self.reload_at != NEVER => {
                return Err(Violation::Forbidden(
                    "the watchdog's reload is written while RVU is set (21.4.4)",
                ));
            }
            (_, value) => {
                self.reload = value;
                self.reload_at = now + UPDATE_PERIODS * self.lsi;
            }
        }
        Ok(())
    }

    fn count(&self) -> Time {
        self.lsi * (4 << self.prescaler_seen.min(6))
    }

    /// Reloads the counter with the reload value that has taken effect.
    fn restart(&mut self, now: Time) {
        self.expires_at = now + (Time::from(self.reload_seen) + 1) * self.count();
    }

    /// The debugger halts the core with DBG_IWDG_STOP set, or resumes it.
    pub(crate) fn freeze(&mut self, frozen: bool, now: Time) {
        if frozen {
            self.frozen_at = Some(now);
        } else if let Some(since) = self.frozen_at.take().filter(|_| self.expires_at != NEVER) {
            self.expires_at += now - since;
        }
    }

    pub(crate) fn deadline(&self) -> Time {
        if self.frozen_at.is_some() {
            return NEVER;
        }
        self.prescaler_at.min(self.reload_at).min(self.expires_at)
    }

    /// Processes what is due; returns whether the watchdog resets the chip now.
    pub(crate) fn advance(&mut self, now: Time) -> bool {
        if self.frozen_at.is_some() {
            return false;
        }
        if self.prescaler_at <= now {
            let left = self.expires_at.saturating_sub(self.prescaler_at) / self.count();
            self.prescaler_seen = self.prescaler;
            if self.running {
                self.expires_at = self.prescaler_at + left * self.count();
            }
            self.prescaler_at = NEVER;
        }
        if self.reload_at <= now {
            self.reload_seen = self.reload;
            self.reload_at = NEVER;
        }
        if self.expires_at > now {
            return false;
        }
        if self.ignored {
            self.expires_at = NEVER;
        }
        !self.ignored
    }
}
