//! Channels to the host as serial lines: USART1 for the pins, USART2 for the serial line. Slow, but real boards have
//! them, too.
//!
//! For the emulator, each read of a status register is a reason to look for new bytes from the host, with several
//! system calls. So it is read once per byte that arrives and never for a byte that is sent, which is gone at once.

use cortex_m::peripheral::NVIC;

use crate::pac::{Interrupt, USART1, USART2};

/// The channel that carries the simulated pins.
pub(super) struct PinUsart {
    usart: USART1,
}

/// The channel that carries the serial line's output.
pub(super) struct SerialUsart {
    usart: USART2,
}

/// Enables both lines. The emulator has no baud rate.
pub(super) fn open(pins: USART1, serial: USART2) -> (PinUsart, SerialUsart) {
    pins.cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
    serial.cr1().write(|w| w.ue().enabled().te().enabled());
    let mut pins = PinUsart { usart: pins };
    // Bytes that the host sends before the receiver is on are lost, so the host waits for this empty frame.
    pins.write(&[0]);
    (pins, SerialUsart { usart: serial })
}

impl PinUsart {
    /// A second handle on the channel, for writing.
    ///
    /// # Safety
    /// The owner of the channel must no longer run.
    pub(super) unsafe fn steal() -> Self {
        // SAFETY: as above.
        PinUsart { usart: unsafe { crate::pac::Peripherals::steal() }.USART1 }
    }

    /// Waits for the next byte.
    pub(super) fn read(&mut self) -> u8 {
        NVIC::unpend(Interrupt::USART1);
        while self.usart.sr().read().rxne().bit_is_clear() {
            // The interrupt is not enabled: it becomes pending, and nothing else happens.
            while !NVIC::is_pending(Interrupt::USART1) {}
            NVIC::unpend(Interrupt::USART1);
        }
        // 8 data bits.
        self.usart.dr().read().dr().bits() as u8
    }

    /// Sends bytes to the host.
    pub(super) fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.usart.dr().write(|w| w.dr().set(byte.into()));
        }
    }
}

impl SerialUsart {
    /// Sends bytes to the host.
    pub(super) fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.usart.dr().write(|w| w.dr().set(byte.into()));
        }
    }
}

/// Stops here: the emulator cannot be told to end.
pub(super) fn exit(_: Result<(), ()>) -> ! {
    loop {
        cortex_m::asm::nop();
    }
}
