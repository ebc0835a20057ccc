//! The supported chips, and the data in which they differ.

/// A microcontroller that the board can model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chip {
    /// STM32F405
    F405,
    /// STM32F407
    F407,
    /// STM32F407 of the first revision, on old Discovery boards: it has the identity of an STM32F2 (ES0182, 2.1.1).
    F407RevisionA,
    /// STM32F446
    F446,
}

impl Chip {
    /// DBGMCU_IDCODE (RM0090, 38.6.1; RM0390, 33.6.1).
    pub fn identity(self) -> u32 {
        match self {
            Chip::F405 | Chip::F407 => 0x1007_6413,
            Chip::F407RevisionA => 0x2000_6411,
            Chip::F446 => 0x1000_6421,
        }
    }

    /// Bytes of flash memory.
    pub fn flash_bytes(self) -> usize {
        match self {
            Chip::F405 | Chip::F407 | Chip::F407RevisionA => 1 << 20,
            Chip::F446 => 512 << 10,
        }
    }

    /// Bytes of core-coupled memory at 0x1000_0000.
    pub fn core_coupled_bytes(self) -> usize {
        match self {
            Chip::F405 | Chip::F407 | Chip::F407RevisionA => 64 << 10,
            Chip::F446 => 0,
        }
    }

    /// Highest core clock (Hz); that of the F446 is the one without over-drive, which is not modelled.
    pub fn fastest_hz(self) -> u32 {
        168_000_000
    }

    /// Allowed range of the PLL's input frequency (Hz), with the margin of the datasheets.
    pub(crate) fn pll_input_hz(self) -> std::ops::RangeInclusive<u32> {
        950_000..=2_100_000
    }

    /// Allowed range of the PLL's VCO frequency (Hz).
    pub(crate) fn vco_hz(self) -> std::ops::RangeInclusive<u32> {
        100_000_000..=432_000_000
    }
}
