//! The converter ADC1: single conversions of one channel (RM0090, 13.13).

use super::Bits;
use crate::clock::{NEVER, Time, UNITS_PER_MICROSECOND, UNITS_PER_SECOND};
use crate::error::Violation;

/// Time from ADON to the first conversion (datasheet, tSTAB).
const SETTLE: Time = 3 * UNITS_PER_MICROSECOND;
/// Highest clock of the converter (Hz).
const FASTEST_HZ: Time = 36_000_000;
const END_OF_CONVERSION: u32 = 1 << 1;
/// TSVREFE: temperature sensor and internal reference on.
const REFERENCE_ON: u32 = 1 << 23;
/// Start-up and shortest sampling of the internal reference (datasheet, embedded reference voltage).
const REFERENCE_START: Time = 10 * UNITS_PER_MICROSECOND;
const REFERENCE_SAMPLING: Time = 10 * UNITS_PER_MICROSECOND;

/// The converter.
#[derive(Debug, Clone, Default)]
pub(crate) struct Adc {
    status: u32,
    control: [u32; 2],
    sampling: [u32; 2],
    sequence: [u32; 3],
    data: u32,
    common: u32,
    reference_on_at: Time,
    on_at: Time,
    done_at: Option<Time>,
    /// Voltages of the channels, as fractions of the reference.
    pub(crate) inputs: [f32; 19],
}

impl Adc {
    pub(crate) fn reset(&mut self) {
        *self = Self { inputs: self.inputs, ..Self::default() };
    }

    pub(crate) fn bits(offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 => Bits::writable(0x3f),
            0x04 => Bits::writable(0x07c0_ffff),
            0x08 => Bits::writable(0x7f7f_0f03),
            0x0c => Bits::writable(0x07ff_ffff),
            0x10 | 0x30 | 0x34 => Bits::writable(0x3fff_ffff),
            0x2c => Bits::writable(0x00ff_ffff),
            0x4c => Bits::writable(0).with_read_only(0xffff),
            0x300 => Bits::writable(0).with_read_only(u32::MAX),
            0x304 => Bits::writable(0x00c3_ef1f),
            _ => return None,
        })
    }

    pub(crate) fn read(&mut self, offset: u32) -> u32 {
        match offset {
            0x00 => self.status,
            0x04 => self.control[0],
            0x08 => self.control[1],
            0x0c => self.sampling[0],
            0x10 => self.sampling[1],
            0x2c => self.sequence[0],
            0x30 => self.sequence[1],
            0x34 => self.sequence[2],
            0x4c => {
                self.status &= !END_OF_CONVERSION;
                self.data
            }
            0x304 => self.common,
            _ => self.status,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time, pclk: Time) -> Result<(), Violation> {
        match offset {
            0x00 => self.status &= value,
            0x04 if value & !0x0300_0000 == 0 => self.control[0] = value,
            0x08 => return self.control2(value, now, pclk),
            0x0c => self.sampling[0] = value,
            0x10 => self.sampling[1] = value,
            0x2c if value == 0 => {}
            0x30 => self.sequence[1] = value,
            0x34 => self.sequence[2] = value,
            0x304 if value & 0xef1f == 0 => {
                if value & !self.common & REFERENCE_ON != 0 {
                    self.reference_on_at = now;
                }
                self.common = value;
            }
            _ => return Err(Violation::NotModelled("this function of the converter")),
        }
        Ok(())
    }

    fn clock(&self, pclk: Time) -> Time {
        pclk * 2 * (Time::from(self.common >> 16 & 3) + 1)
    }

    fn control2(&mut self, value: u32, now: Time, pclk: Time) -> Result<(), Violation> {
        if value & !0x4000_0001 != 0 {
            return Err(Violation::NotModelled("this function of the converter"));
        }
        let was_on = self.control[1] & 1 != 0;
        self.control[1] = value & 1;
        if !was_on && value & 1 != 0 {
            self.on_at = now;
        }
        if value & 1 == 0 {
            self.done_at = None;
        }
        if value & 1 << 30 == 0 {
            return Ok(());
        }
        let clock = self.clock(pclk);
        if !was_on || now < self.on_at + SETTLE {
            return Err(Violation::Forbidden("a conversion before the converter has settled (tSTAB)"));
        }
        if UNITS_PER_SECOND > FASTEST_HZ * clock {
            return Err(Violation::ClockTooFast((UNITS_PER_SECOND / clock) as u32));
        }
        if self.channel() > 16
            && self.common & REFERENCE_ON != 0
            && now < self.reference_on_at + REFERENCE_START
        {
            return Err(Violation::Forbidden(
                "the internal reference is converted before it has started (tSTART)",
            ));
        }
        if self.channel() > 16 && self.sampling_clocks() * clock < REFERENCE_SAMPLING {
            return Err(Violation::Forbidden(
                "the internal reference is sampled for less than 10 µs (TS_vrefint)",
            ));
        }
        if self.done_at.is_none() {
            self.done_at = Some(now + (self.sampling_clocks() + 12) * clock);
        }
        Ok(())
    }

    fn channel(&self) -> usize {
        (self.sequence[2] & 31) as usize
    }

    fn sampling_clocks(&self) -> Time {
        let channel = self.channel();
        let code = if channel < 10 {
            self.sampling[1] >> (3 * channel)
        } else {
            self.sampling[0] >> (3 * (channel - 10))
        };
        [3, 15, 28, 56, 84, 112, 144, 480][(code & 7) as usize]
    }

    pub(crate) fn deadline(&self) -> Time {
        self.done_at.unwrap_or(NEVER)
    }

    /// Completes a conversion that is due. `connected`: whether a channel's pin is in analog mode.
    pub(crate) fn advance(&mut self, now: Time, connected: impl Fn(usize) -> bool) {
        if self.done_at.is_some_and(|at| at <= now) {
            self.done_at = None;
            let channel = self.channel();
            let enabled = channel < 16 || self.common & REFERENCE_ON != 0;
            let fraction = self.inputs.get(channel).copied().filter(|_| connected(channel) && enabled);
            self.data = (fraction.unwrap_or(0.0) * 4096.0).clamp(0.0, 4095.0) as u32;
            self.status |= END_OF_CONVERSION | 1 << 4;
        }
    }
}
