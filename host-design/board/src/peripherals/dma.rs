//! DMA1 (RM0090, 10.5): bytes from and to the USART of the serial line.

use super::Bits;
use crate::error::Violation;

const ENABLED: u32 = 1;
const CIRCULAR: u32 = 1 << 8;
const COMPLETE: u32 = 1 << 5;
const TRANSFER_ERROR: u32 = 1 << 3;
const HALF: u32 = 1 << 4;

/// Registers of a stream, and the length with which it was started.
#[derive(Debug, Clone, Copy, Default)]
struct DmaStream {
    control: u32,
    left: u32,
    length: u32,
    peripheral: u32,
    memory: u32,
    fifo: u32,
}

/// Streams 0 to 7 and their flags.
#[derive(Debug, Clone)]
pub(crate) struct Dma {
    streams: [DmaStream; 8],
    flags: [u32; 2],
    requests: Requests,
}

/// Streams that serve a USART's requests, all on channel 4 (10.3.3), and the address of its data register.
#[derive(Debug, Clone, Copy)]
struct Requests {
    receive: usize,
    transmit: usize,
    data: u32,
}

const USART2: Requests = Requests { receive: 5, transmit: 6, data: 0x4000_4404 };
const USART3: Requests = Requests { receive: 1, transmit: 3, data: 0x4000_4804 };
const CHANNEL: u32 = 4;
/// Interrupt of stream 0; those of streams 1 to 6 follow (12.2).
const FIRST_INTERRUPT: usize = 11;

/// Position of a stream's flags in LISR or HISR.
fn place(stream: usize) -> (usize, u32) {
    (stream / 4, [0, 6, 16, 22][stream % 4])
}

impl Dma {
    /// After a reset, for the USART of this number.
    pub(crate) fn of_usart(number: u8) -> Self {
        let requests = if number == 3 { USART3 } else { USART2 };
        Self { streams: Default::default(), flags: [0; 2], requests }
    }

    /// The streams that receive and transmit.
    pub(crate) fn serial(&self) -> (usize, usize) {
        (self.requests.receive, self.requests.transmit)
    }

    pub(crate) fn bits(offset: u32) -> Option<Bits> {
        let flags = 0x0f7d_0f7d;
        Some(match offset {
            0x00 | 0x04 => Bits::writable(0).with_read_only(flags),
            0x08 | 0x0c => Bits::writable(flags),
            0x10..=0xcc => match (offset - 0x10) % 0x18 {
                0x00 => Bits::writable(0x0fff_ffff & !(1 << 20)),
                0x04 => Bits::writable(0xffff),
                0x14 => Bits::writable(0x87).with_read_only(0x38),
                _ => Bits::writable(u32::MAX),
            },
            _ => return None,
        })
    }

    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 | 0x04 => self.flags[offset as usize / 4],
            0x10..=0xcc => {
                let stream = &self.streams[(offset as usize - 0x10) / 0x18];
                match (offset - 0x10) % 0x18 {
                    0x00 => stream.control,
                    0x04 => stream.left,
                    0x08 => stream.peripheral,
                    0x0c => stream.memory,
                    0x14 => stream.fifo,
                    _ => 0,
                }
            }
            _ => 0,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Violation> {
        if let 0x08 | 0x0c = offset {
            self.flags[(offset as usize - 8) / 4] &= !value;
            return Ok(());
        }
        let number = (offset as usize - 0x10) / 0x18;
        let flags = place(number);
        let stream = &mut self.streams[number];
        let runs = stream.control & ENABLED != 0;
        match (offset - 0x10) % 0x18 {
            0x00 => {
                if runs && value & ENABLED != 0 && (value ^ stream.control) & !0x1e != 0 {
                    return Err(Violation::Forbidden("a running stream is configured (10.5.5)"));
                }
                if !runs && value & ENABLED != 0 {
                    if self.flags[flags.0] >> flags.1 & 0x3d != 0 {
                        return Err(Violation::Forbidden("a stream starts with flags still set (10.3.17)"));
                    }
                    stream.check(self.requests, number, value)?;
                    stream.length = stream.left;
                }
                stream.control = value;
            }
            _ if runs => return Err(Violation::Forbidden("a running stream is configured (10.5.6)")),
            0x04 => stream.left = value,
            0x08 => stream.peripheral = value,
            0x0c => stream.memory = value,
            0x14 if value & 4 != 0 => return Err(Violation::NotModelled("the FIFO of a DMA stream")),
            0x14 => stream.fifo = value,
            _ => return Err(Violation::NotModelled("the second buffer of a DMA stream")),
        }
        Ok(())
    }

    /// Memory address of the next byte, if the stream is enabled.
    pub(crate) fn next(&self, number: usize) -> Option<u32> {
        let stream = &self.streams[number];
        let position =
            if stream.control & 1 << 10 != 0 { stream.length.wrapping_sub(stream.left) } else { 0 };
        (stream.control & ENABLED != 0 && stream.left > 0).then(|| stream.memory.wrapping_add(position))
    }

    /// Counts a byte that was transferred, and sets the flags.
    pub(crate) fn moved(&mut self, number: usize) {
        let (word, at) = place(number);
        let stream = &mut self.streams[number];
        stream.left -= 1;
        if stream.left == stream.length / 2 {
            self.flags[word] |= HALF << at;
        }
        if stream.left == 0 {
            self.flags[word] |= COMPLETE << at;
            if stream.control & CIRCULAR != 0 {
                stream.left = stream.length;
            } else {
                stream.control &= !ENABLED;
            }
        }
    }

    /// Ends a stream with a transfer error (10.3.18).
    pub(crate) fn fail(&mut self, number: usize) {
        let (word, at) = place(number);
        self.flags[word] |= TRANSFER_ERROR << at;
        self.streams[number].control &= !ENABLED;
    }

    /// Numbers of both streams' interrupts, and whether each line is high.
    pub(crate) fn interrupts(&self) -> [(usize, bool); 2] {
        [self.requests.receive, self.requests.transmit]
            .map(|stream| (FIRST_INTERRUPT + stream, self.interrupt(stream)))
    }

    fn interrupt(&self, number: usize) -> bool {
        let (word, at) = place(number);
        let flags = self.flags[word] >> at;
        let control = self.streams[number].control;
        (control & 1 << 4 != 0 && flags & COMPLETE != 0) || (control & 1 << 3 != 0 && flags & HALF != 0)
    }
}

impl DmaStream {
    /// Checks the settings of a stream that is enabled: bytes between the USART and memory, in the right direction.
    fn check(&self, requests: Requests, number: usize, control: u32) -> Result<(), Violation> {
        let direction = control >> 6 & 3;
        let expected = if number == requests.receive {
            0
        } else if number == requests.transmit {
            1
        } else {
            return Err(Violation::NotModelled("this DMA stream"));
        };
        if control >> 25 & 7 != CHANNEL || direction != expected || self.peripheral != requests.data {
            return Err(Violation::NotModelled("this DMA request"));
        }
        if control & 0x7800 != 0 || control & (1 << 18 | 1 << 9 | 1 << 5) != 0 {
            return Err(Violation::NotModelled("this kind of DMA transfer"));
        }
        if self.left == 0 {
            return Err(Violation::Forbidden("a stream starts without length (10.3.17)"));
        }
        Ok(())
    }
}
