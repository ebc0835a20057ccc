//! USART2 or USART3 (RM0090, 30.6): bytes at their baud rate, both ways.

use std::collections::VecDeque;

use super::Bits;
use crate::clock::{NEVER, Time};
use crate::error::Violation;

const FRAMING: u32 = 1 << 1;
const OVERRUN: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RECEIVED: u32 = 1 << 5;
const COMPLETE: u32 = 1 << 6;
const EMPTY: u32 = 1 << 7;

/// A byte on the serial line, with its timing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineByte {
    /// The eight data bits.
    pub value: u8,
    /// Time at which its stop bit ends.
    pub end: Time,
    /// Duration of one bit.
    pub bit: Time,
}

/// The peripheral and both directions of the line.
#[derive(Debug, Clone)]
pub(crate) struct Usart {
    status: u32,
    baud: u32,
    control: [u32; 3],
    guard: u32,
    data: u8,
    status_was_read: bool,
    /// The byte that is shifted out, and the one that waits for it.
    shifting: Option<LineByte>,
    waiting: Option<u8>,
    /// Bytes to be received, in order; the first may be in transit.
    pub(crate) incoming: VecDeque<LineByte>,
    /// Bytes that have been transmitted.
    pub(crate) sent: VecDeque<LineByte>,
    /// Number of bytes lost because the one before had not been read.
    pub(crate) overruns: u64,
    idle_at: Time,
}

impl Usart {
    pub(crate) fn new() -> Self {
        Self {
            status: EMPTY | COMPLETE,
            baud: 0,
            control: [0; 3],
            guard: 0,
            data: 0,
            status_was_read: false,
            shifting: None,
            waiting: None,
            incoming: VecDeque::new(),
            sent: VecDeque::new(),
            overruns: 0,
            idle_at: NEVER,
        }
    }

    pub(crate) fn reset(&mut self) {
        let (incoming, sent) = (std::mem::take(&mut self.incoming), std::mem::take(&mut self.sent));
        *self = Self { incoming, sent, overruns: self.overruns, ..Self::new() };
    }

    pub(crate) fn bits(offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 => Bits::writable(0x360).with_read_only(0x9f),
            0x04 => Bits::writable(0x1ff),
            0x08 => Bits::writable(0xffff),
            0x0c => Bits::writable(0xbfff),
            0x10 => Bits::writable(0x7f6f),
            0x14 => Bits::writable(0x0fff),
            0x18 => Bits::writable(0xffff),
            _ => return None,
        })
    }

    pub(crate) fn read(&mut self, offset: u32) -> u32 {
        match offset {
            0x00 => {
                self.status_was_read = true;
                self.status
            }
            0x04 => {
                self.status &= !RECEIVED;
                if self.status_was_read {
                    self.status &= !(OVERRUN | FRAMING | IDLE);
                }
                self.status_was_read = false;
                self.data.into()
            }
            0x08 => self.baud,
            0x0c..=0x14 => self.control[(offset as usize - 0xc) / 4],
            _ => self.guard,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time, pclk: Time) -> Result<(), Violation> {
        match offset {
            0x00 => self.status &= value | !0x360,
            0x04 => self.transmit(value as u8, now, pclk),
            0x08 if value < 16 => return Err(Violation::Forbidden("a divisor below 1 (30.3.4)")),
            0x08 => self.baud = value,
            0x0c if value & 0x9603 != 0 => return Err(Violation::NotModelled("this frame format")),
            0x10 | 0x18 if value != 0 => return Err(Violation::NotModelled("this mode of the USART")),
            0x14 if value & !0xc1 != 0 => return Err(Violation::NotModelled("this mode of the USART")),
            0x0c..=0x14 => self.control[(offset as usize - 0xc) / 4] = value,
            _ => {}
        }
        Ok(())
    }

    /// Duration of a bit: sixteen samples of the divided clock (30.3.4).
    fn bit(&self, pclk: Time) -> Time {
        pclk * Time::from(self.baud)
    }

    fn transmits(&self) -> bool {
        self.control[0] & (1 << 13 | 1 << 3) == 1 << 13 | 1 << 3
    }

    fn receives(&self) -> bool {
        self.control[0] & (1 << 13 | 1 << 2) == 1 << 13 | 1 << 2
    }

    /// Writes a byte to the transmitter; it replaces one that is still waiting.
    pub(crate) fn transmit(&mut self, value: u8, now: Time, pclk: Time) {
        if !self.transmits() {
            return;
        }
        self.status &= !COMPLETE;
        if self.shifting.is_none() {
            let bit = self.bit(pclk);
            self.shifting = Some(LineByte { value, end: now + 10 * bit, bit });
        } else {
            self.waiting = Some(value);
            self.status &= !EMPTY;
        }
    }

    pub(crate) fn deadline(&self) -> Time {
        let sending = self.shifting.map_or(NEVER, |byte| byte.end);
        let coming = self.incoming.front().map_or(NEVER, |byte| byte.end);
        sending.min(coming).min(self.idle_at)
    }

    /// Processes what is due; `connected`: whether TX and RX are routed to pins.
    pub(crate) fn advance(&mut self, now: Time, pclk: Time, connected: (bool, bool)) {
        while let Some(byte) = self.shifting.filter(|byte| byte.end <= now) {
            if connected.0 {
                self.sent.push_back(byte);
            }
            self.status |= EMPTY;
            self.shifting = self.waiting.take().map(|value| {
                let bit = self.bit(pclk);
                LineByte { value, end: byte.end + 10 * bit, bit }
            });
            if self.shifting.is_none() {
                self.status |= COMPLETE;
            }
        }
        while let Some(byte) = self.incoming.front().copied().filter(|byte| byte.end <= now) {
            self.incoming.pop_front();
            if self.receives() && connected.1 {
                self.receive(byte, pclk);
            }
        }
        if self.idle_at <= now {
            self.status |= IDLE;
            self.idle_at = NEVER;
        }
    }

    fn receive(&mut self, byte: LineByte, pclk: Time) {
        // Bits are sampled in their middle: a baud rate that is 5 % off is half a bit off after ten bits (30.3.5).
        let own = self.bit(pclk);
        let fits = byte.bit.abs_diff(own) * 20 <= own;
        // While the overrun is not cleared, by reading the status and then the data register, nothing is received; the
        // DMA reads the data register only.
        if self.status & (RECEIVED | OVERRUN) != 0 {
            self.overrun();
            return;
        }
        self.status |= RECEIVED;
        self.data = if fits { byte.value } else { byte.value.rotate_left(3) ^ 0x55 };
        if !fits {
            self.status |= FRAMING;
        }
        self.idle_at = byte.end + 10 * own;
        if self.incoming.front().is_some_and(|next| next.end <= self.idle_at + own) {
            self.idle_at = NEVER;
        }
    }

    /// A received byte is lost because the one before has not been fetched.
    pub(crate) fn overrun(&mut self) {
        self.status |= OVERRUN;
        self.overruns += 1;
    }

    /// Whether the interrupt's line is high.
    pub(crate) fn interrupt(&self) -> bool {
        let control = self.control[0];
        let asked = |enable: u32, flags: u32| control & enable != 0 && self.status & flags != 0;
        asked(1 << 5, RECEIVED | OVERRUN)
            || asked(1 << 7, EMPTY)
            || asked(1 << 6, COMPLETE)
            || asked(1 << 4, IDLE)
            || (self.control[2] & 1 != 0
                && self.control[2] & 1 << 6 != 0
                && self.status & (OVERRUN | FRAMING) != 0)
    }

    /// Whether it requests the DMA to fetch a received byte.
    pub(crate) fn wants_fetch(&self) -> bool {
        self.control[2] & 1 << 6 != 0 && self.status & RECEIVED != 0
    }

    /// Whether it requests a byte to transmit from the DMA.
    pub(crate) fn wants_byte(&self) -> bool {
        self.control[2] & 1 << 7 != 0 && self.status & EMPTY != 0 && self.transmits()
    }

    /// The data register, read by the DMA.
    pub(crate) fn fetch(&mut self) -> u8 {
        self.status &= !RECEIVED;
        self.data
    }
}
