//! The serial line: USART2 or USART3, 460 800 baud, 8 data bits, no parity. DMA moves the bytes of both directions, so
//! none is lost while a tick runs.

use core::cell::UnsafeCell;
use upright::protocol::BAUD;
use upright::protocol::serial_link::MAX_MESSAGE;

use crate::pac::{DMA1, USART2, USART3, usart1};

use super::chosen::BOARD;
use upright::boards::wiring::{Signal, wire_of};

/// Size of the receive buffer (bytes): more than arrive while the background task does not run.
const RECEIVED: usize = 512;

/// Memory for both directions, which the DMA controller shares with the code.
pub(crate) struct DmaBuffer {
    /// Circular buffer of received bytes.
    received: UnsafeCell<[u8; RECEIVED]>,
    /// The frame that is being sent.
    sent: UnsafeCell<[u8; MAX_MESSAGE]>,
}

impl DmaBuffer {
    /// Nothing received, nothing to send.
    pub(crate) const fn new() -> Self {
        Self { received: UnsafeCell::new([0; RECEIVED]), sent: UnsafeCell::new([0; MAX_MESSAGE]) }
    }
}

/// Number of the USART, from the wiring.
pub(super) const NUMBER: u8 = wire_of(BOARD.wiring, Signal::Transmit).number("USART");
const _: () = assert!(NUMBER == 2 || NUMBER == 3, "the board's serial line is not at USART2 or USART3");

// Streams of DMA1 (RM0090, 10.3.3: channel 4 of all).
const RECEIVE: usize = if NUMBER == 2 { 5 } else { 1 };
const SEND: usize = if NUMBER == 2 { 6 } else { 3 };
/// Channel 4, with the memory address incremented.
const BYTES_OF_USART: u32 = 4 << 25 | 1 << 10;
/// The flags of stream 5 in HIFCR, or of stream 1 in LIFCR (10.5.3, 10.5.4).
const RECEIVE_FLAGS: u32 = 0x3d << 6;
/// The flags of stream 6 in HIFCR, or of stream 3 in LIFCR (10.5.3, 10.5.4).
const SEND_FLAGS: u32 = if NUMBER == 2 { 0x3d << 16 } else { 0x3d << 22 };

/// Both directions of the line.
pub(crate) struct DmaLine {
    usart: &'static usart1::RegisterBlock,
    dma: DMA1,
    buffer: &'static mut DmaBuffer,
    /// The next received byte to read.
    next: usize,
}

/// Enables both directions; `clock` is the frequency of the bus (Hz).
pub(super) fn set_up(dma: DMA1, clock: u32, buffer: &'static mut DmaBuffer) -> DmaLine {
    let registers: *const usart1::RegisterBlock = if NUMBER == 2 { USART2::PTR } else { USART3::PTR };
    // SAFETY: the registers of this USART, which nothing else uses.
    let usart = unsafe { &*registers };
    let data = registers as u32 + 4;
    // SAFETY, here and below: values of the fields of RM0090, 10.5, and addresses of memory that is only the DMA
    // controller's and this module's.
    let receive = dma.st(RECEIVE);
    receive.par().write(|w| unsafe { w.bits(data) });
    receive.m0ar().write(|w| unsafe { w.bits(buffer.received.get() as u32) });
    let send = dma.st(SEND);
    send.par().write(|w| unsafe { w.bits(data) });
    send.m0ar().write(|w| unsafe { w.bits(buffer.sent.get() as u32) });
    // Sixteen samples per bit (30.3.4): the divisor has four fractional bits.
    // SAFETY: 35 to 91 at the clocks of this board.
    usart.brr().write(|w| unsafe { w.bits(((clock + BAUD / 2) / BAUD) as u16) });
    usart.cr3().write(|w| w.dmar().set_bit().dmat().set_bit());
    usart.cr1().write(|w| w.ue().set_bit().te().set_bit().re().set_bit());
    let mut line = DmaLine { usart, dma, buffer, next: 0 };
    line.start_receiving();
    line
}

impl DmaLine {
    /// Starts the stream that receives, at the beginning of the buffer.
    fn start_receiving(&mut self) {
        self.next = 0;
        clear(&self.dma, RECEIVE, RECEIVE_FLAGS);
        let receive = self.dma.st(RECEIVE);
        // SAFETY: values of the fields of RM0090, 10.5; circular, from the peripheral.
        unsafe {
            receive.ndtr().write(|w| w.bits(RECEIVED as u32));
            receive.cr().write(|w| w.bits(BYTES_OF_USART | 1 << 8 | 1));
        }
    }

    /// Receives again after an overrun or a transfer error, each of which ends reception. A frame that was on its way
    /// is lost; the host repeats it.
    fn recover(&mut self) {
        if self.usart.sr().read().ore().bit_is_set() {
            // The status and then the data register read: that clears the overrun (30.6.1).
            let _ = self.usart.dr().read().bits();
        }
        // An error turns the stream off (10.3.18).
        if self.dma.st(RECEIVE).cr().read().bits() & 1 == 0 {
            self.start_receiving();
        }
    }

    /// The next byte from the host, if any.
    pub(crate) fn read(&mut self) -> Option<u8> {
        let left = self.dma.st(RECEIVE).ndtr().read().bits() as usize;
        if self.next == RECEIVED.wrapping_sub(left) % RECEIVED {
            self.recover();
            return None;
        }
        // SAFETY: within the buffer; the DMA controller writes whole bytes.
        let byte = unsafe { self.buffer.received.get().cast::<u8>().add(self.next).read_volatile() };
        self.next = (self.next + 1) % RECEIVED;
        Some(byte)
    }

    /// Whether the last frame has been passed to the USART, so that there is room for another one.
    pub(crate) fn is_free(&self) -> bool {
        self.dma.st(SEND).cr().read().bits() & 1 == 0
    }

    /// Sends a frame to the host; the line has to be free.
    pub(crate) fn write(&mut self, frame: &[u8]) {
        let sent = self.buffer.sent.get_mut();
        let length = frame.len().min(sent.len());
        for (byte, &from) in sent.iter_mut().zip(frame) {
            *byte = from;
        }
        // The DMA controller must not read before the bytes are in memory.
        cortex_m::asm::dmb();
        clear(&self.dma, SEND, SEND_FLAGS);
        let send = self.dma.st(SEND);
        // SAFETY: values of the fields of RM0090, 10.5; the stream is off.
        unsafe {
            send.ndtr().write(|w| w.bits(length as u32));
            // To the peripheral.
            send.cr().write(|w| w.bits(BYTES_OF_USART | 1 << 6 | 1));
        }
    }
}

/// Clears these flags of a stream.
fn clear(dma: &DMA1, stream: usize, flags: u32) {
    // SAFETY: any combination of flags may be cleared (RM0090, 10.5.3, 10.5.4).
    unsafe {
        if stream >= 4 {
            dma.hifcr().write(|w| w.bits(flags));
        } else {
            dma.lifcr().write(|w| w.bits(flags));
        }
    }
}
