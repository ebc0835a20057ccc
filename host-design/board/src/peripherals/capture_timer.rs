//! Timer 11, channel 1, which captures HSE divided for the RTC (RM0090, 19.5) to measure the crystal against HSI.

use super::Bits;
use crate::clock::Time;
use crate::error::Violation;

const CAPTURED: u32 = 1 << 1;
const CAPTURED_AGAIN: u32 = 1 << 9;

/// The timer.
#[derive(Debug, Clone, Default)]
pub(crate) struct CaptureTimer {
    control: u32,
    status: u32,
    inputs: u32,
    enabled: u32,
    option: u32,
    prescaler: u32,
    reload: u32,
    captured: u32,
    started: Time,
    /// Time up to which edges of the input have been processed.
    edges_seen: Time,
}

impl CaptureTimer {
    pub(crate) fn new() -> Self {
        Self { reload: 0xffff, ..Self::default() }
    }

    pub(crate) fn bits(offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 => Bits::writable(0x387),
            0x0c => Bits::writable(3),
            0x10 => Bits::writable(0x203),
            0x14 => Bits::writable(3),
            0x18 => Bits::writable(0xff),
            0x20 => Bits::writable(0xb),
            0x24 | 0x28 | 0x2c | 0x34 => Bits::writable(0xffff),
            0x50 => Bits::writable(3),
            _ => return None,
        })
    }

    fn count(&self, now: Time, tick: Time) -> u32 {
        if self.control & 1 == 0 {
            return 0;
        }
        let clocks = (now - self.started) / (tick * (Time::from(self.prescaler) + 1));
        (clocks % (Time::from(self.reload) + 1)) as u32
    }

    /// Captures every rising edge, or every second, fourth or eighth; `input` is the period of the input.
    pub(crate) fn advance(&mut self, now: Time, tick: Time, input: Option<Time>) {
        let Some(period) = input.filter(|_| self.captures()) else {
            self.edges_seen = now;
            return;
        };
        let period = period << (self.inputs >> 2 & 3);
        let edges = now / period;
        let seen = self.edges_seen / period;
        if edges > seen {
            self.captured = self.count(edges * period, tick);
            let again = edges - seen > 1 || self.status & CAPTURED != 0;
            self.status |= CAPTURED | if again { CAPTURED_AGAIN } else { 0 };
        }
        self.edges_seen = now;
    }

    /// Counts from 0; what an edge before would capture is lost.
    fn start(&mut self, now: Time) {
        (self.started, self.edges_seen) = (now, now);
    }

    fn captures(&self) -> bool {
        self.control & 1 != 0 && self.enabled & 1 != 0 && self.inputs & 3 == 1 && self.option & 3 == 2
    }

    /// When the next edge is captured.
    pub(crate) fn deadline(&self, now: Time, input: Option<Time>) -> Time {
        match input.filter(|_| self.captures()) {
            Some(period) => {
                let period = period << (self.inputs >> 2 & 3);
                (now / period + 1) * period
            }
            None => crate::clock::NEVER,
        }
    }

    pub(crate) fn read(&mut self, offset: u32, now: Time, tick: Time) -> u32 {
        match offset {
            0x00 => self.control,
            0x10 => self.status,
            0x18 => self.inputs,
            0x20 => self.enabled,
            0x24 => self.count(now, tick),
            0x28 => self.prescaler,
            0x2c => self.reload,
            0x34 => {
                self.status &= !CAPTURED;
                self.captured
            }
            0x50 => self.option,
            _ => 0,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Result<(), Violation> {
        match offset {
            0x00 => {
                if value & 1 != 0 && self.control & 1 == 0 {
                    self.start(now);
                }
                self.control = value;
            }
            0x0c if value != 0 => return Err(Violation::NotModelled("interrupts of TIM11")),
            0x0c => {}
            0x10 => self.status &= value,
            0x14 => self.start(now),
            0x18 if value & 0xf0 != 0 || value & 3 > 1 => {
                return Err(Violation::NotModelled("this input mode of TIM11"));
            }
            0x18 => self.inputs = value,
            0x20 => self.enabled = value,
            0x28 => self.prescaler = value,
            0x2c => self.reload = value,
            0x50 => self.option = value,
            _ => return Err(Violation::NotModelled("this function of TIM11")),
        }
        Ok(())
    }
}
