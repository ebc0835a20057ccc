//! Power control (RM0090, 5.4; RM0390, 5.4), the voltage detector, and the brown-out reset (RM0090, 5.2.2).

use super::Bits;
use crate::chip::Chip;

/// Typical thresholds of the detector's levels (V): the falling supply that it reports, and the rising one that
/// releases it again (datasheet DS8626, embedded reset and power control block).
#[expect(clippy::approx_constant, reason = "3.14 V is not pi")]
const THRESHOLDS_V: [(f32, f32); 8] = [
    (2.04, 2.14),
    (2.19, 2.30),
    (2.35, 2.45),
    (2.51, 2.60),
    (2.66, 2.76),
    (2.84, 2.93),
    (2.93, 3.03),
    (3.03, 3.14),
];

/// Supply below which the chip is in reset, whatever the option bytes say (V; datasheet, VPDR).
pub(crate) const POWER_DOWN_V: f32 = 1.68;

/// Brown-out level in the option bytes (BOR_LEV in FLASH_OPTCR): the supply below which the chip is in reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BrownOut {
    /// As delivered: only the power-down threshold applies.
    #[default]
    Off,
    /// Level 1: reset below 2.19 V.
    Level1,
    /// Level 2: reset below 2.50 V.
    Level2,
    /// Level 3: reset below 2.83 V.
    Level3,
}

impl BrownOut {
    /// The falling supply that resets the chip, and the rising supply that releases it (V; datasheet, VBOR, VPDR).
    pub(crate) fn thresholds_v(self) -> (f32, f32) {
        match self {
            BrownOut::Off => (POWER_DOWN_V, 1.72),
            BrownOut::Level1 => (2.19, 2.29),
            BrownOut::Level2 => (2.50, 2.59),
            BrownOut::Level3 => (2.83, 2.92),
        }
    }

    /// FLASH_OPTCR with this level and without protection (3.9.10).
    pub(crate) fn option_control(self) -> u32 {
        let level = match self {
            BrownOut::Off => 3,
            BrownOut::Level1 => 2,
            BrownOut::Level2 => 1,
            BrownOut::Level3 => 0,
        };
        0x0fff_aae1 | level << 2
    }
}

/// PWR's registers, and the supply.
#[derive(Debug, Clone)]
pub(crate) struct Power {
    chip: Chip,
    control: u32,
    is_below: bool,
    /// Supply of the chip (V).
    pub(crate) volts: f32,
    pub(crate) brown_out: BrownOut,
}

impl Power {
    pub(crate) fn new(chip: Chip, volts: f32, brown_out: BrownOut) -> Self {
        let control = if chip == Chip::F446 { 3 << 14 } else { 1 << 14 };
        Self { chip, control, is_below: false, volts, brown_out }
    }

    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.chip, self.volts, self.brown_out);
    }

    pub(crate) fn bits(&self, offset: u32) -> Option<Bits> {
        Some(match (offset, self.chip) {
            (0x00, Chip::F446) => Bits::writable(0x003f_eff3 | 0xc),
            (0x00, _) => Bits::writable(0x43ff),
            (0x04, Chip::F446) => Bits::writable(0x000c_0300).with_read_only(0x0003_400f),
            (0x04, _) => Bits::writable(0x300).with_read_only(0x400f),
            _ => return None,
        })
    }

    pub(crate) fn read(&self, offset: u32) -> u32 {
        if offset == 0 { self.control } else { 1 << 14 | u32::from(self.is_below) << 2 }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        if offset == 0 {
            self.control = value;
        }
    }

    /// Compares the supply with the threshold; returns whether it is below (EXTI line 16), and whether that changed.
    pub(crate) fn compare(&mut self) -> (bool, bool) {
        let (falling_v, rising_v) = THRESHOLDS_V[(self.control >> 5 & 7) as usize];
        let threshold_v = if self.is_below { rising_v } else { falling_v };
        let is_below = self.control & 1 << 4 != 0 && self.volts < threshold_v;
        let changed = is_below != self.is_below;
        self.is_below = is_below;
        (is_below, changed)
    }

    /// Core clock per flash wait state at this supply (Hz; RM0090, 3.5.1, table 10).
    pub(crate) fn hz_per_wait_state(&self) -> u32 {
        match self.volts {
            volts if volts >= 2.7 => 30_000_000,
            volts if volts >= 2.4 => 24_000_000,
            volts if volts >= 2.1 => 22_000_000,
            _ => 20_000_000,
        }
    }
}
