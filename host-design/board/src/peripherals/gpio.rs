//! Ports (RM0090, 8.4), and what is connected to their pins.

use super::Bits;
use crate::error::Violation;

/// What is connected to a pin from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ExternalLevel {
    /// Nothing: the pin follows its pull-up or pull-down, or floats and reads as noise.
    #[default]
    Open,
    /// A low level.
    Low,
    /// A high level.
    High,
}

/// Registers of a port, and what is connected to its pins.
#[derive(Debug, Clone)]
pub(crate) struct Port {
    pub(crate) mode: u32,
    output_type: u32,
    speed: u32,
    pull: u32,
    pub(crate) output: u32,
    alternate: [u32; 2],
    pub(crate) wires: [ExternalLevel; 16],
}

impl Port {
    /// The state after a reset, with the debugger's pins configured (8.3.1).
    pub(crate) fn new(letter: u8) -> Self {
        let (mode, speed, pull) = match letter {
            b'A' => (0xa800_0000, 0x0c00_0000, 0x6400_0000),
            b'B' => (0x0000_0280, 0x0000_00c0, 0x0000_0100),
            _ => (0, 0, 0),
        };
        Self {
            mode,
            output_type: 0,
            speed,
            pull,
            output: 0,
            alternate: [0; 2],
            wires: [ExternalLevel::Open; 16],
        }
    }

    /// Resets the registers; what is connected stays.
    pub(crate) fn reset(&mut self, letter: u8) {
        *self = Self { wires: self.wires, ..Self::new(letter) };
    }

    pub(crate) fn bits(&self, offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 | 0x08 | 0x0c | 0x18 | 0x20 | 0x24 => Bits::writable(u32::MAX),
            0x04 | 0x14 => Bits::writable(0xffff),
            0x10 => Bits::writable(0).with_read_only(0xffff),
            _ => return None,
        })
    }

    /// `alternate_levels`: levels that peripherals drive at their pins; `noise`: levels of floating pins.
    pub(crate) fn read(&self, offset: u32, alternate_levels: u32, noise: u32) -> u32 {
        match offset {
            0x00 => self.mode,
            0x04 => self.output_type,
            0x08 => self.speed,
            0x0c => self.pull,
            0x10 => self.levels(alternate_levels, noise),
            0x14 => self.output,
            0x20 => self.alternate[0],
            0x24 => self.alternate[1],
            _ => 0,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Violation> {
        match offset {
            0x00 => self.mode = value,
            0x04 => self.output_type = value,
            0x08 => self.speed = value,
            0x0c => {
                if (0..16).any(|pin| value >> (2 * pin) & 3 == 3) {
                    return Err(Violation::Forbidden("pull 11 is reserved (8.4.4)"));
                }
                self.pull = value;
            }
            0x14 => self.output = value,
            0x18 => self.output = self.output & !(value >> 16) | value & 0xffff,
            0x20 => self.alternate[0] = value,
            _ => self.alternate[1] = value,
        }
        Ok(())
    }

    /// Two bits of MODER: 0 input, 1 output, 2 alternate function, 3 analog.
    pub(crate) fn mode_of(&self, pin: u8) -> u32 {
        self.mode >> (2 * pin) & 3
    }

    /// Whether the pin is set to this alternate function.
    pub(crate) fn is_alternate(&self, pin: u8, function: u32) -> bool {
        self.mode_of(pin) == 2 && self.alternate[usize::from(pin / 8)] >> (4 * (pin % 8)) & 15 == function
    }

    /// Level of an input; `None` if it floats.
    pub(crate) fn input(&self, pin: u8) -> Option<bool> {
        match (self.wires[usize::from(pin)], self.pull >> (2 * pin) & 3) {
            (ExternalLevel::Low, _) => Some(false),
            (ExternalLevel::High, _) => Some(true),
            (ExternalLevel::Open, 1) => Some(true),
            (ExternalLevel::Open, 2) => Some(false),
            (ExternalLevel::Open, _) => None,
        }
    }

    /// Levels as IDR shows them: analog pins read as zero.
    pub(crate) fn levels(&self, alternate_levels: u32, noise: u32) -> u32 {
        (0..16).fold(0, |levels, pin| {
            let level = match self.mode_of(pin) {
                3 => false,
                1 => {
                    let open_drain = self.output_type >> pin & 1 != 0;
                    let high = self.output >> pin & 1 != 0;
                    if open_drain && high { self.input(pin).unwrap_or(noise >> pin & 1 != 0) } else { high }
                }
                2 if alternate_levels >> pin & 1 != 0 => true,
                _ => self.input(pin).unwrap_or(noise >> pin & 1 != 0),
            };
            levels | u32::from(level) << pin
        })
    }
}
