//! The boards of the Pico's family.

/// A board of the Pico's family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PicoBoard {
    /// Raspberry Pi Pico.
    Pico,
    /// Raspberry Pi Pico 2.
    Pico2,
}

impl PicoBoard {
    /// Both boards.
    pub const ALL: [Self; 2] = [Self::Pico, Self::Pico2];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pico => "pico",
            Self::Pico2 => "pico2",
        }
    }

    /// What it is sold as.
    pub const fn product(self) -> &'static str {
        match self {
            Self::Pico => "Raspberry Pi Pico",
            Self::Pico2 => "Raspberry Pi Pico 2",
        }
    }

    /// Its microcontroller.
    pub const fn chip(self) -> &'static str {
        match self {
            Self::Pico => "RP2040",
            Self::Pico2 => "RP2350",
        }
    }

    /// What its boot loader calls its drive and, in a file there, the board.
    pub const fn drive(self) -> &'static str {
        match self {
            Self::Pico => "RPI-RP2",
            Self::Pico2 => "RP2350",
        }
    }

    /// Where its image has been executed.
    pub(super) const fn executed(self) -> &'static str {
        match self {
            Self::Pico => "rp2040js 1.4.1, with a motor and with a stepper",
            Self::Pico2 => "compiled; its bits by the replay image in QEMU; peripherals untried",
        }
    }

    /// Rust's target: Cortex-M0+, and Cortex-M33 with its floating-point unit.
    pub(super) const fn target(self) -> &'static str {
        match self {
            Self::Pico => "thumbv6m-none-eabi",
            Self::Pico2 => "thumbv8m.main-none-eabihf",
        }
    }

    /// The chip's family in a UF2 file; of the RP2350's, the one of secure programs for its Arm cores.
    pub(super) const fn family(self) -> u32 {
        match self {
            Self::Pico => 0xe48b_ff56,
            Self::Pico2 => 0xe48b_ff59,
        }
    }
}
