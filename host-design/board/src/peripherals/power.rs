//! Power control (RM0090, 5.4): the voltage detector.

use super::Bits;

/// Thresholds of the detector (V), falling (datasheet, embedded reset and power control block).
const THRESHOLDS: [f32; 8] = [2.04, 2.20, 2.33, 2.45, 2.62, 2.76, 2.87, 3.0];

/// The registers.
#[derive(Debug, Clone)]
pub(crate) struct Power {
    control: u32,
    /// Supply of the chip (V).
    pub(crate) volts: f32,
}

impl Power {
    pub(crate) fn new(volts: f32) -> Self {
        Self { control: 1 << 14, volts }
    }

    pub(crate) fn bits(offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 => Bits::writable(0x43ff),
            0x04 => Bits::writable(0x300).with_read_only(0x400f),
            _ => return None,
        })
    }

    pub(crate) fn read(&self, offset: u32) -> u32 {
        if offset == 0 { self.control } else { 1 << 14 | u32::from(self.below()) << 2 }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        if offset == 0 {
            self.control = value;
        }
    }

    /// Whether the supply is below the threshold; line 16 of EXTI.
    pub(crate) fn below(&self) -> bool {
        self.control & 1 << 4 != 0 && self.volts < THRESHOLDS[(self.control >> 5 & 7) as usize]
    }
}
