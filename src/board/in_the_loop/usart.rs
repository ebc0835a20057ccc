//! Channels to the host as serial lines: USART1 for the pins, USART2 for the serial line. Slow, but what boards have.

use stm32f4xx_hal::pac::{USART1, USART2};

/// The pins.
pub(super) struct Channel {
    usart: USART1,
}

/// The serial line.
pub(super) struct Serial {
    usart: USART2,
}

/// Turns both lines on. The emulator has no baud rate.
pub(super) fn open(pins: USART1, serial: USART2) -> (Channel, Serial) {
    pins.cr1().write(|w| w.ue().enabled().te().enabled().re().enabled());
    serial.cr1().write(|w| w.ue().enabled().te().enabled());
    let mut pins = Channel { usart: pins };
    // What the host sends before the receiver is on is lost: it waits for this empty frame.
    pins.write(&[0]);
    (pins, Serial { usart: serial })
}

impl Channel {
    /// The channel once more, to write to.
    ///
    /// # Safety
    /// Its owner must no longer run.
    pub(super) unsafe fn steal() -> Self {
        // SAFETY: as above.
        Channel { usart: unsafe { stm32f4xx_hal::pac::Peripherals::steal() }.USART1 }
    }

    /// The next byte; waits for it.
    pub(super) fn read(&mut self) -> u8 {
        while self.usart.sr().read().rxne().bit_is_clear() {}
        // A data frame of eight bits.
        self.usart.dr().read().dr().bits() as u8
    }

    /// Sends bytes.
    pub(super) fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            while self.usart.sr().read().txe().bit_is_clear() {}
            self.usart.dr().write(|w| w.dr().set(byte.into()));
        }
    }
}

impl Serial {
    /// Sends bytes.
    pub(super) fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            while self.usart.sr().read().txe().bit_is_clear() {}
            self.usart.dr().write(|w| w.dr().set(byte.into()));
        }
    }
}

/// The end: nothing tells the emulator.
pub(super) fn exit(_: Result<(), ()>) -> ! {
    loop {
        cortex_m::asm::nop();
    }
}
