//! Register models of the peripherals in use. Section numbers are those of RM0090.

pub(crate) mod adc;
pub(crate) mod capture_timer;
pub(crate) mod dma;
pub(crate) mod encoder_timer;
pub(crate) mod exti;
pub(crate) mod gpio;
pub(crate) mod iwdg;
pub(crate) mod power;
pub(crate) mod pwm_timer;
pub(crate) mod rcc;
pub(crate) mod usart;

/// Kinds of the bits of a register, as masks; bits in no mask are reserved.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bits {
    /// What software may write.
    pub(crate) writable: u32,
    /// What only hardware changes.
    pub(crate) read_only: u32,
    /// Reserved bits that are one, and must stay so.
    pub(crate) reserved_ones: u32,
}

impl Bits {
    /// A register with these writable bits; all others are reserved.
    pub(crate) const fn writable(writable: u32) -> Self {
        Self { writable, read_only: 0, reserved_ones: 0 }
    }

    pub(crate) const fn with_read_only(self, read_only: u32) -> Self {
        Self { read_only, ..self }
    }

    pub(crate) const fn with_reserved_ones(self, reserved_ones: u32) -> Self {
        Self { reserved_ones, ..self }
    }
}
