//! Timer 1, channel 1 (RM0090, 17.4): PWM in one-pulse mode with repetition counter, break input, and one pin: that of
//! the channel or that of its complementary output.

use super::Bits;
use crate::clock::Time;
use crate::error::Violation;

const ENABLED: u32 = 1;
const UPDATE_DISABLED: u32 = 1 << 1;
const ONE_PULSE: u32 = 1 << 3;
const MAIN_OUTPUT: u32 = 1 << 15;
const BREAK_FLAG: u32 = 1 << 7;

/// Registers, their active copies, and the counter.
#[derive(Debug, Clone)]
pub(crate) struct PwmTimer {
    /// The pin in use is that of the complementary output.
    is_complementary: bool,
    control: u32,
    control2: u32,
    status: u32,
    mode: u32,
    outputs: u32,
    prescaler: u32,
    prescaler_active: u32,
    period: u32,
    period_active: u32,
    repetition: u32,
    repetitions_left: u32,
    compare: u32,
    compare_active: u32,
    protection: u32,
    protection_written: bool,
    count: u32,
    synced: Time,
    /// Level of the break input.
    break_level: bool,
    /// The break input is not connected: for the negative controls.
    pub(crate) break_ignored: bool,
    /// Time for which the output was high, since power-on.
    pub(crate) high: Time,
    /// When code last set whether the counter counts.
    pub(crate) started_at: Time,
    /// Changes of the pin's level, if they are recorded.
    pub(crate) edges: Option<Vec<(Time, bool)>>,
    was_high: bool,
}

impl PwmTimer {
    pub(crate) fn new(is_complementary: bool) -> Self {
        Self {
            is_complementary,
            control: 0,
            control2: 0,
            status: 0,
            mode: 0,
            outputs: 0,
            prescaler: 0,
            prescaler_active: 0,
            period: 0xffff,
            period_active: 0xffff,
            repetition: 0,
            repetitions_left: 0,
            compare: 0,
            compare_active: 0,
            protection: 0,
            protection_written: false,
            count: 0,
            synced: 0,
            break_level: false,
            break_ignored: false,
            high: 0,
            started_at: 0,
            edges: None,
            was_high: false,
        }
    }

    pub(crate) fn reset(&mut self, now: Time) {
        let old = self.clone();
        *self = Self::new(old.is_complementary);
        (self.high, self.synced, self.break_level) = (old.high, now, old.break_level);
        self.break_ignored = old.break_ignored;
        (self.edges, self.was_high) = (old.edges, old.was_high);
    }

    pub(crate) fn bits(&self, offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 => Bits::writable(0x3ff),
            0x04 => Bits::writable(0x7ffd),
            0x08 => Bits::writable(0xfff7),
            0x0c => Bits::writable(0x7fff),
            0x10 => Bits::writable(0x1eff),
            0x14 => Bits::writable(0xff),
            0x18 | 0x1c => Bits::writable(0xffff),
            0x20 => Bits::writable(0x3fff),
            0x24 | 0x28 | 0x2c | 0x34..=0x40 | 0x44 => Bits::writable(0xffff),
            0x30 => Bits::writable(0xff),
            _ => return None,
        })
    }

    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 => self.control,
            0x04 => self.control2,
            0x10 => self.status,
            0x18 => self.mode,
            0x20 => self.outputs,
            0x24 => self.count,
            0x28 => self.prescaler,
            0x2c => self.period,
            0x30 => self.repetition,
            0x34 => self.compare,
            0x44 => self.protection,
            _ => 0,
        }
    }

    /// Writes a register; the caller has advanced the timer to `now`.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Result<(), Violation> {
        match offset {
            0x00 => {
                if value & 0x70 != 0 {
                    return Err(Violation::NotModelled("TIM1 counting down or centred"));
                }
                self.started_at = now;
                self.control = value;
            }
            0x04 if value & !0x300 == 0 => {
                // LOCK level 1 keeps OIS1 and OIS1N (17.4.18).
                if self.protection >> 8 & 3 == 0 {
                    self.control2 = value;
                }
            }
            0x10 => {
                self.status &= value;
                if self.break_is_active() {
                    self.status |= BREAK_FLAG;
                }
            }
            0x14 if value & !1 == 0 => {
                if value & 1 != 0 {
                    self.count = 0;
                    self.update();
                }
            }
            0x18 if value & 0xff07 == 0 => {
                if !matches!(value >> 4 & 7, 0 | 4 | 5 | 6 | 7) {
                    return Err(Violation::NotModelled("this output mode of TIM1"));
                }
                self.mode = value;
            }
            // Only one of the two outputs: the influence of the other is not modelled.
            0x20 if value & !(3 * self.output()) == 0 => self.outputs = value,
            0x24 => self.count = value,
            0x28 => self.prescaler = value,
            0x2c => {
                self.period = value;
                if self.control & 1 << 7 == 0 {
                    self.period_active = value;
                }
            }
            0x30 => self.repetition = value,
            0x34 => {
                self.compare = value;
                if self.mode & 8 == 0 {
                    self.compare_active = value;
                }
            }
            0x44 => self.protect(value),
            // Registers that are not modelled may be written with zero.
            _ if value == 0 => {}
            _ => return Err(Violation::NotModelled("this function of TIM1")),
        }
        Ok(())
    }

    /// BDTR: the lock bits can be written once (17.4.18).
    fn protect(&mut self, value: u32) {
        let lock = self.protection >> 8 & 3;
        let kept = match lock {
            0 => 0,
            1 => 0x70ff,
            _ => 0x7cff,
        };
        let kept = kept | if self.protection_written { 0x300 } else { 0 };
        self.protection_written = true;
        self.protection = self.protection & kept | value & !kept;
        self.apply_break();
    }

    fn break_is_active(&self) -> bool {
        let enabled = self.protection & 1 << 12 != 0;
        let polarity = self.protection & 1 << 13 != 0;
        enabled && !self.break_ignored && self.break_level == polarity
    }

    fn apply_break(&mut self) {
        if self.break_is_active() {
            self.protection &= !MAIN_OUTPUT;
            self.status |= BREAK_FLAG;
        }
    }

    /// Sets the level of the pin BKIN; the caller has advanced the timer.
    pub(crate) fn break_input(&mut self, high: bool) {
        self.break_level = high;
        self.apply_break();
    }

    /// A failure found by the clock security system acts as a break too, if the break is enabled (17.3.12).
    pub(crate) fn clock_failure(&mut self) {
        if self.protection & 1 << 12 != 0 {
            self.protection &= !MAIN_OUTPUT;
            self.status |= BREAK_FLAG;
        }
    }

    /// An update event: preloaded values become active, and one-pulse mode stops (17.4.6, 17.4.1).
    fn update(&mut self) {
        if self.control & UPDATE_DISABLED != 0 {
            return;
        }
        self.prescaler_active = self.prescaler;
        self.period_active = self.period;
        self.compare_active = self.compare;
        self.repetitions_left = self.repetition;
        self.status |= 1;
        if self.control & ONE_PULSE != 0 {
            self.control &= !ENABLED;
        }
    }

    /// Reference level of the channel at a counter value (17.3.9).
    fn reference(&self, count: u32) -> bool {
        match self.mode >> 4 & 7 {
            6 => count < self.compare_active,
            7 => count >= self.compare_active,
            5 => true,
            _ => false,
        }
    }

    /// The bit that enables the output, CC1E or CC1NE; the next higher bit inverts it. If only the complementary
    /// output is enabled, it has the reference's level, not its complement (17.4.9).
    fn output(&self) -> u32 {
        if self.is_complementary { 1 << 2 } else { 1 }
    }

    fn is_inverted(&self) -> bool {
        self.outputs & (2 * self.output()) != 0
    }

    /// Whether the pin follows the reference level, inverted or not.
    fn driven(&self) -> bool {
        self.protection & MAIN_OUTPUT != 0 && self.outputs & self.output() != 0
    }

    fn level_at(&self, count: u32) -> bool {
        if self.driven() {
            self.reference(count) != self.is_inverted()
        } else {
            // Idle level, if OSSI drives it; else the resistor to ground.
            self.protection & MAIN_OUTPUT == 0
                && self.protection & 1 << 10 != 0
                && self.outputs & self.output() != 0
                && self.control2 & if self.is_complementary { 1 << 9 } else { 1 << 8 } != 0
        }
    }

    /// Level of the pin.
    pub(crate) fn level(&self) -> bool {
        self.level_at(self.count)
    }

    /// Whether the main output is on.
    pub(crate) fn main_output(&self) -> bool {
        self.protection & MAIN_OUTPUT != 0
    }

    /// Whether the counter counts.
    pub(crate) fn runs(&self) -> bool {
        self.control & ENABLED != 0
    }

    /// Timer clocks per period for which the pin is high.
    pub(crate) fn active_clocks(&self) -> u32 {
        self.high_clocks(0, self.period_active + 1)
    }

    /// PWM period in timer clocks.
    pub(crate) fn period_clocks(&self) -> u32 {
        self.period_active + 1
    }

    /// Advances to `now` without counting: the pin keeps its level.
    pub(crate) fn stand_still(&mut self, now: Time) {
        self.record(self.synced, self.count);
        self.high += if self.level() { now - self.synced } else { 0 };
        self.synced = now;
    }

    /// Advances the counter to `now`; `tick` is the period of the timer's clock.
    pub(crate) fn advance(&mut self, now: Time, tick: Time) {
        while self.synced < now {
            if self.control & ENABLED == 0 {
                return self.stand_still(now);
            }
            let tick = tick * (Time::from(self.prescaler_active) + 1);
            let due = (now - self.synced) / tick;
            if due == 0 {
                return;
            }
            // The counter may have been written beyond its end: it then wraps at its width.
            let end = if self.count > self.period_active { 0xffff } else { self.period_active };
            let clocks = due.min(Time::from(end - self.count) + 1) as u32;
            self.record(self.synced, self.count);
            if (self.count + 1..self.count + clocks).contains(&self.compare_active) {
                let until = Time::from(self.compare_active - self.count);
                self.record(self.synced + tick * until, self.compare_active);
            }
            self.high += tick * Time::from(self.high_clocks(self.count, self.count + clocks));
            self.synced += tick * Time::from(clocks);
            self.count += clocks;
            if self.count > end {
                self.count = 0;
                if self.repetitions_left == 0 { self.update() } else { self.repetitions_left -= 1 }
            }
        }
    }

    /// Records that the pin has the level of a counter value at a time.
    fn record(&mut self, at: Time, count: u32) {
        if self.edges.is_none() {
            return;
        }
        let is_high = self.level_at(count);
        if is_high != std::mem::replace(&mut self.was_high, is_high)
            && let Some(edges) = &mut self.edges
        {
            edges.push((at, is_high));
        }
    }

    /// Number of clocks from one counter value to another during which the pin is high.
    fn high_clocks(&self, from: u32, to: u32) -> u32 {
        if !self.driven() {
            return if self.level_at(from) { to - from } else { 0 };
        }
        let split = self.compare_active.clamp(from, to);
        let (before, after) = (split - from, to - split);
        let high = match self.mode >> 4 & 7 {
            6 => before,
            7 => after,
            5 => to - from,
            _ => 0,
        };
        if self.is_inverted() { to - from - high } else { high }
    }
}
