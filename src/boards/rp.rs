//! The Raspberry Pi Pico and the Pico 2, whose pins are in `boards/rp2040/`.

/// Encoders that both count.
pub const ENCODERS: usize = 5;
/// Shortest and longest tick (µs): a shorter one leaves no time for a controller, and SysTick has 24 bits.
pub const TICK_US: [u32; 2] = [500, 100_000];
/// Most step pulses in a tick.
pub const PULSES: u32 = 4096;

/// A board of this family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RpBoard {
    /// Microcontroller.
    pub chip: RpChip,
    /// Where its image has been executed.
    pub executed: &'static str,
}

/// A microcontroller of this family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RpChip {
    /// RP2040.
    Rp2040,
    /// RP2350.
    Rp2350,
}

impl RpChip {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rp2040 => "RP2040",
            Self::Rp2350 => "RP2350",
        }
    }

    /// Processor clock (Hz).
    pub const fn clock_hz(self) -> u32 {
        match self {
            Self::Rp2040 => 125_000_000,
            Self::Rp2350 => 150_000_000,
        }
    }

    /// Rust's target: Cortex-M0+, and Cortex-M33 with its floating-point unit.
    pub const fn target(self) -> &'static str {
        match self {
            Self::Rp2040 => "thumbv6m-none-eabi",
            Self::Rp2350 => "thumbv8m.main-none-eabihf",
        }
    }

    /// Its family in a UF2 file; of the RP2350's, the one of secure programs for its Arm cores.
    pub const fn uf2_family(self) -> u32 {
        match self {
            Self::Rp2040 => 0xe48b_ff56,
            Self::Rp2350 => 0xe48b_ff59,
        }
    }

    /// What its boot loader calls its drive and, in a file there, the board.
    pub const fn drive(self) -> &'static str {
        match self {
            Self::Rp2040 => "RPI-RP2",
            Self::Rp2350 => "RP2350",
        }
    }
}
