//! The SysTick timer (ARMv7-M reference manual, B3.3).

use crate::clock::{NEVER, Time};

/// The timer's registers, and the times behind its value.
#[derive(Debug, Clone)]
pub(crate) struct SysTick {
    control: u32,
    reload: u32,
    /// When it next reaches zero.
    zero_at: Time,
    /// Its value while it is disabled.
    stopped_at: u32,
    counted: bool,
    /// Time at which the debugger halted the core, if it has.
    frozen_at: Option<Time>,
}

impl SysTick {
    pub(crate) fn new() -> Self {
        Self { control: 4, reload: 0, zero_at: NEVER, stopped_at: 0, counted: false, frozen_at: None }
    }

    fn runs(&self) -> bool {
        self.control & 1 != 0
    }

    fn interrupts(&self) -> bool {
        self.control & 2 != 0
    }

    fn period(&self, hclk: Time) -> Time {
        if self.control & 4 != 0 { hclk } else { 8 * hclk }
    }

    fn value(&self, now: Time, hclk: Time) -> u32 {
        if !self.runs() {
            return self.stopped_at;
        }
        let left = self.zero_at.saturating_sub(now) / self.period(hclk);
        if left > Time::from(self.reload) { 0 } else { left as u32 }
    }

    fn start(&mut self, now: Time, hclk: Time) {
        let clocks = if self.stopped_at == 0 { Time::from(self.reload) + 1 } else { self.stopped_at.into() };
        self.zero_at = now + clocks * self.period(hclk);
    }

    /// When it next reaches zero.
    pub(crate) fn deadline(&self) -> Time {
        let counts = self.runs() && self.reload != 0;
        if counts && self.frozen_at.is_none() { self.zero_at } else { NEVER }
    }

    /// The debugger halts the core or resumes it.
    pub(crate) fn freeze(&mut self, halted: bool, now: Time) {
        if halted {
            self.frozen_at = Some(now);
        } else if let Some(since) = self.frozen_at.take().filter(|_| self.zero_at != NEVER) {
            self.zero_at += now - since;
        }
    }

    /// When it next interrupts; `None` if it does not.
    pub(crate) fn next_tick(&self) -> Option<Time> {
        Some(self.deadline()).filter(|&at| at != NEVER && self.interrupts())
    }

    /// Processes events that are due; returns whether there is one that interrupts.
    pub(crate) fn advance(&mut self, now: Time, hclk: Time) -> bool {
        let mut is_due = false;
        while self.deadline() <= now {
            (self.counted, is_due) = (true, true);
            self.zero_at += (Time::from(self.reload) + 1) * self.period(hclk);
        }
        is_due && self.interrupts()
    }

    /// The core clock changes from period `old` to `new`.
    pub(crate) fn change_clock(&mut self, now: Time, old: Time, new: Time) {
        if self.runs() {
            let left = self.zero_at.saturating_sub(now) / old;
            self.zero_at = now + left * new;
        }
    }

    /// Reads a register; the caller has processed the events that are due.
    pub(crate) fn read(&mut self, address: u32, now: Time, hclk: Time) -> Option<u32> {
        Some(match address {
            0xe000_e010 => self.control | u32::from(std::mem::take(&mut self.counted)) << 16,
            0xe000_e014 => self.reload,
            0xe000_e018 => self.value(now, hclk),
            0xe000_e01c => 0x4000_4650,
            _ => return None,
        })
    }

    /// Writes a register; returns whether there is one at this address.
    pub(crate) fn write(&mut self, address: u32, value: u32, now: Time, hclk: Time) -> bool {
        match address {
            0xe000_e010 => {
                self.stopped_at = self.value(now, hclk);
                self.control = value & 7;
                self.start(now, hclk);
            }
            0xe000_e014 => self.reload = value & 0xff_ffff,
            0xe000_e018 => {
                self.stopped_at = 0;
                self.counted = false;
                self.start(now, hclk);
            }
            _ => return false,
        }
        true
    }
}
