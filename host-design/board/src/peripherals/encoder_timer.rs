//! Timers 2 to 5 and 8 in encoder mode (RM0090, 17.3.16, 18.3.12).

use super::Bits;
use crate::clock::Time;
use crate::error::Violation;

/// An encoder's shaft: its position (edges) changes linearly over a span of time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shaft {
    from: i64,
    to: i64,
    begin: Time,
    end: Time,
}

impl Shaft {
    /// Moves from its present position to `position` (edges), which it reaches at `end`.
    pub(crate) fn turn(&mut self, position: i64, begin: Time, end: Time) {
        *self = Self { from: self.position(begin), to: position, begin, end };
    }

    /// Position at a time (edges).
    pub(crate) fn position(&self, now: Time) -> i64 {
        if now >= self.end {
            return self.to;
        }
        if now <= self.begin {
            return self.from;
        }
        let (elapsed, span) = ((now - self.begin) as i128, (self.end - self.begin) as i128);
        self.from + (i128::from(self.to - self.from) * elapsed / span) as i64
    }

    /// Time between two edges; `None` at rest, and for a movement without duration.
    fn spacing(&self) -> Option<Time> {
        let edges = if self.end > self.begin { (self.to - self.from).unsigned_abs() } else { 0 };
        (self.end - self.begin).checked_div(edges)
    }
}

/// A timer in encoder mode.
#[derive(Debug, Clone)]
pub(crate) struct EncoderTimer {
    wide: bool,
    control: u32,
    slave: u32,
    inputs: u32,
    polarity: u32,
    reload: u32,
    count: u32,
    /// Position of the shaft up to which the timer has followed it.
    seen: i64,
    /// Number of edges that the filter has suppressed.
    pub(crate) lost: u64,
}

impl EncoderTimer {
    pub(crate) fn new(wide: bool) -> Self {
        let reload = if wide { u32::MAX } else { 0xffff };
        Self { wide, control: 0, slave: 0, inputs: 0, polarity: 0, reload, count: 0, seen: 0, lost: 0 }
    }

    fn mask(&self) -> u32 {
        if self.wide { u32::MAX } else { 0xffff }
    }

    pub(crate) fn bits(&self, offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 => Bits::writable(0x3ff),
            0x08 => Bits::writable(0xfff7),
            0x18 => Bits::writable(0xffff),
            0x20 => Bits::writable(0xbbbb),
            0x24 | 0x2c => Bits::writable(self.mask()),
            0x28 => Bits::writable(0xffff),
            0x14 => Bits::writable(0x5f),
            0x10 => Bits::writable(0x1e5f),
            _ => return None,
        })
    }

    pub(crate) fn read(&mut self, offset: u32, shaft: Option<&Shaft>, now: Time, tick: Time) -> u32 {
        match offset {
            0x00 => self.control,
            0x08 => self.slave,
            0x18 => self.inputs,
            0x20 => self.polarity,
            0x24 => {
                self.follow(shaft, now, tick);
                self.count
            }
            0x2c => self.reload,
            _ => 0,
        }
    }

    pub(crate) fn write(
        &mut self,
        offset: u32,
        value: u32,
        shaft: Option<&Shaft>,
        now: Time,
        tick: Time,
    ) -> Result<(), Violation> {
        self.follow(shaft, now, tick);
        match offset {
            0x00 if value & !0x381 == 0 => self.control = value,
            0x08 if value == 0 || value == 3 => self.slave = value,
            0x18 if value == 0 || value & 0x0303 == 0x0101 && value & 0x0c0c == 0 => self.inputs = value,
            0x20 if value & !0x22 == 0 => self.polarity = value,
            0x24 => self.count = value,
            0x2c => self.reload = value,
            _ if value == 0 => {}
            0x14 if value == 1 => self.count = 0,
            _ => return Err(Violation::NotModelled("this function of an encoder's timer")),
        }
        Ok(())
    }

    /// Clocks for which a level must last to pass the filter: samples times clocks between them (18.4.7, ICxF).
    fn filter_clocks(&self) -> Time {
        const CLOCKS: [Time; 16] = [1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 80, 96, 128, 160, 192, 256];
        CLOCKS[(self.inputs >> 4 & 15) as usize]
    }

    /// Counts the shaft's movement. Each input keeps its level for two edges, and that level must pass the filter.
    fn follow(&mut self, shaft: Option<&Shaft>, now: Time, tick: Time) {
        let Some(shaft) = shaft else { return };
        let delay = self.filter_clocks() * tick;
        let position = shaft.position(now.saturating_sub(delay));
        let moved = position - self.seen;
        self.seen = position;
        if self.control & 1 == 0 || self.slave != 3 || self.inputs == 0 || moved == 0 {
            return;
        }
        if shaft.spacing().is_some_and(|spacing| 2 * spacing < delay) {
            self.lost += moved.unsigned_abs();
            return;
        }
        let inverted = (self.polarity >> 1 ^ self.polarity >> 5) & 1 != 0;
        let modulus = i64::from(self.reload) + 1;
        let moved = if inverted { -moved } else { moved };
        self.count = (i64::from(self.count) + moved).rem_euclid(modulus) as u32;
    }
}
