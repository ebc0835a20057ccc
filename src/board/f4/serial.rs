//! The serial line: USART2, 460 800 baud, 8 data bits, no parity.

use heapless::spsc::{Consumer, Producer};
use stm32f4xx_hal::pac::{RCC, USART2};
use upright::protocol::{BAUD, queue};

/// Iterations of the loop that waits for the transmitter: at least 60 µs, three bytes.
const PATIENCE: u32 = 2_500;

/// The receiving half, used by the interrupt.
pub(crate) struct Receiver {
    received: Producer<'static, u8>,
}

/// The sending half, and the queue of received bytes.
pub(crate) struct SerialLine {
    received: Consumer<'static, u8>,
    usart: USART2,
}

/// Enables both halves; `clock` is the frequency of the bus (Hz).
pub(super) fn set_up(
    rcc: &RCC,
    usart: USART2,
    clock: u32,
    (producer, consumer): (Producer<'static, u8>, Consumer<'static, u8>),
) -> (Receiver, SerialLine) {
    rcc.apb1enr().modify(|_, w| w.usart2en().set_bit());
    // Sixteen samples per bit (RM0090, 30.3.4): the divisor has four fractional bits.
    // SAFETY: 35 to 91 at the clocks of this board.
    usart.brr().write(|w| unsafe { w.bits(((clock + BAUD / 2) / BAUD) as u16) });
    usart.cr1().write(|w| w.ue().set_bit().te().set_bit().re().set_bit().rxneie().set_bit());
    (Receiver { received: producer }, SerialLine { received: consumer, usart })
}

impl Receiver {
    /// Queues a received byte. If the queue is full, the byte is lost, and the frame's checksum shows it.
    pub(crate) fn interrupt(&mut self) {
        // SAFETY: only this half reads status and data, in this order, which also clears an overrun (30.6.1).
        let usart = unsafe { &*USART2::PTR };
        let _ = usart.sr().read();
        let _ = queue::put(&mut self.received, usart.dr().read().bits() as u8);
    }
}

impl SerialLine {
    /// The next byte from the host, if any.
    pub(crate) fn read(&mut self) -> Option<u8> {
        queue::take(&mut self.received)
    }

    /// Sends a frame to the host. If the transmitter is not ready in time, drops the frame.
    pub(crate) fn write(&mut self, frame: &[u8]) {
        for &byte in frame {
            if !(0..PATIENCE).any(|_| self.usart.sr().read().txe().bit_is_set()) {
                return;
            }
            self.usart.dr().write(|w| w.dr().set(byte.into()));
        }
    }
}
