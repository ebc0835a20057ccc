//! Reset and clock control (RM0090, 7.3), with the oscillators and the PLL behind it.

use super::Bits;
use crate::chip::Chip;
use crate::clock::{NEVER, Time, UNITS_PER_MICROSECOND, frequency, period};
use crate::error::Violation;

const HSE_ON: u32 = 1 << 16;
const HSE_BYPASS: u32 = 1 << 18;
const CSS_ON: u32 = 1 << 19;
const PLL_ON: u32 = 1 << 24;
/// The PLL locks within 200 µs (datasheet, table of the main PLL).
const PLL_LOCK: Time = 200 * UNITS_PER_MICROSECOND;
/// LSI starts within 40 µs.
const LSI_START: Time = 40 * UNITS_PER_MICROSECOND;

/// Flags of CSR.
pub(crate) const BROWN_OUT_FLAG: u32 = 1 << 25;
pub(crate) const PIN_FLAG: u32 = 1 << 26;
pub(crate) const POWER_FLAG: u32 = 1 << 27;
pub(crate) const SOFTWARE_FLAG: u32 = 1 << 28;
pub(crate) const WATCHDOG_FLAG: u32 = 1 << 29;

/// The high-speed external clock (HSE) that the board provides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crystal {
    /// Frequency (Hz); 0: none is fitted.
    pub hz: u32,
    /// Start-up time.
    pub start: Time,
    /// Whether a clock signal is fed in instead of a crystal, which requires HSEBYP.
    pub is_clock_input: bool,
}

/// The buses with peripherals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Domain {
    Ahb1,
    Apb1,
    Apb2,
}

/// Registers, and the state of the clocks.
#[derive(Debug, Clone)]
pub(crate) struct Rcc {
    chip: Chip,
    crystal: Crystal,
    /// The crystal has stopped oscillating.
    pub(crate) crystal_stopped: bool,
    hsi: Time,
    control: u32,
    pll: u32,
    configuration: u32,
    interrupts: u32,
    enables: [u32; 3],
    ready: [[Time; 32]; 3],
    pub(crate) status: u32,
    hse_ready_at: Time,
    pll_ready_at: Time,
    lsi_ready_at: Time,
    system: Time,
    /// The core has no clock: the crystal has stopped, and the clock security system was off.
    pub(crate) stopped: bool,
    /// The clock security system has detected the failure of the crystal (7.2.7).
    pub(crate) security_event: bool,
}

/// A source of the system clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ClockSource {
    Hsi,
    Hse,
    Pll,
}

impl Rcc {
    /// The state after power-on; `hsi_hz` is the actual frequency of HSI.
    pub(crate) fn new(chip: Chip, crystal: Crystal, hsi_hz: u32) -> Self {
        Self {
            chip,
            crystal,
            crystal_stopped: false,
            hsi: period(hsi_hz),
            control: 0x83,
            pll: 0x2400_3010,
            configuration: 0,
            interrupts: 0,
            enables: [1 << 20, 0, 0],
            ready: [[NEVER; 32]; 3],
            status: 0,
            hse_ready_at: NEVER,
            pll_ready_at: NEVER,
            lsi_ready_at: NEVER,
            system: period(hsi_hz),
            stopped: false,
            security_event: false,
        }
    }

    /// A system reset of everything but the flags of CSR, to which `flags` are added.
    pub(crate) fn reset(&mut self, flags: u32) {
        let (status, crystal_stopped) = (self.status, self.crystal_stopped);
        *self = Self::new(self.chip, self.crystal, frequency(self.hsi));
        self.status = status & 0xfe00_0000 | flags;
        self.crystal_stopped = crystal_stopped;
    }

    /// Clock period of the core and of AHB.
    pub(crate) fn hclk(&self) -> Time {
        let code = self.configuration >> 4 & 15;
        let divisor = if code < 8 { 1 } else { [2, 4, 8, 16, 64, 128, 256, 512][code as usize - 8] };
        self.system * divisor
    }

    fn apb_divisor(&self, domain: Domain) -> Time {
        let code = match domain {
            Domain::Ahb1 => return 1,
            Domain::Apb1 => self.configuration >> 10 & 7,
            Domain::Apb2 => self.configuration >> 13 & 7,
        };
        if code < 4 { 1 } else { 2 << (code - 4) }
    }

    /// Clock period of a bus.
    pub(crate) fn pclk(&self, domain: Domain) -> Time {
        self.hclk() * self.apb_divisor(domain)
    }

    /// Clock period of the timers of a bus: half that of the bus if its clock is divided (7.2).
    pub(crate) fn timer_clock(&self, domain: Domain) -> Time {
        let divisor = self.apb_divisor(domain);
        self.hclk() * if divisor == 1 { 1 } else { divisor / 2 }
    }

    /// Period of HSE divided for the RTC, which TIM11 can measure (7.3.3, 19.5.11).
    pub(crate) fn hse_for_rtc(&self) -> Option<Time> {
        let divisor = Time::from(self.configuration >> 16 & 31);
        let runs = self.control & HSE_ON != 0 && !self.crystal_stopped && self.hse_ready_at != NEVER;
        (runs && divisor >= 2).then(|| period(self.crystal.hz) * divisor)
    }

    /// When the peripheral with this bit may first be accessed; `None` if its clock is off.
    pub(crate) fn usable_at(&self, domain: Domain, bit: u32) -> Option<Time> {
        let enabled = self.enables[domain as usize] >> bit & 1 != 0;
        enabled.then_some(self.ready[domain as usize][bit as usize])
    }

    /// DSB: all clock enables have taken effect.
    pub(crate) fn writes_are_through(&mut self, now: Time) {
        for ready in self.ready.iter_mut().flatten().filter(|ready| **ready != NEVER) {
            *ready = (*ready).min(now);
        }
    }

    /// When a ready flag is next set.
    pub(crate) fn deadline(&self) -> Time {
        let future = |at: Time, flag_is_set: bool| if flag_is_set { NEVER } else { at };
        future(self.hse_ready_at, self.control & 1 << 17 != 0)
            .min(future(self.pll_ready_at, self.control & 1 << 25 != 0))
            .min(future(self.lsi_ready_at, self.status & 2 != 0))
    }

    /// Updates the ready flags.
    pub(crate) fn advance(&mut self, now: Time) {
        let flag = |register: u32, bit: u32, at: Time| register & !(1 << bit) | u32::from(at <= now) << bit;
        self.control = flag(self.control, 17, self.hse_ready_at);
        self.control = flag(self.control, 25, self.pll_ready_at);
        self.status = flag(self.status, 1, self.lsi_ready_at);
    }

    /// The crystal stops oscillating.
    pub(crate) fn stop_crystal(&mut self) {
        self.crystal_stopped = true;
        let watched = self.control & CSS_ON != 0 && self.control & 1 << 17 != 0;
        let uses_it =
            self.source() == ClockSource::Hse || (self.source() == ClockSource::Pll && self.pll_from_hse());
        self.hse_ready_at = NEVER;
        self.control &= !(1 << 17);
        if watched {
            self.security_event = true;
            self.interrupts |= 1 << 7;
            self.control &= !(HSE_ON | CSS_ON);
            if uses_it {
                self.configuration &= !0xf;
                self.control &= !(PLL_ON | 1 << 25);
                self.pll_ready_at = NEVER;
                self.system = self.hsi;
            }
        } else if uses_it {
            self.stopped = true;
        }
    }

    /// Whether the clock security system requests the NMI.
    pub(crate) fn security_pending(&self) -> bool {
        self.interrupts & 1 << 7 != 0
    }

    fn pll_from_hse(&self) -> bool {
        self.pll & 1 << 22 != 0
    }

    fn source(&self) -> ClockSource {
        match self.configuration >> 2 & 3 {
            1 => ClockSource::Hse,
            2 => ClockSource::Pll,
            _ => ClockSource::Hsi,
        }
    }

    pub(crate) fn bits(&self, offset: u32) -> Option<Bits> {
        let f446 = self.chip == Chip::F446;
        Some(match offset {
            0x00 if f446 => Bits::writable(0x150d_00f9).with_read_only(0x2a02_ff02),
            0x00 => Bits::writable(0x050d_00f9).with_read_only(0x0a02_ff02),
            0x04 if f446 => Bits::writable(0x7f43_7fff),
            0x04 => Bits::writable(0x0f43_7fff).with_reserved_ones(0x2000_0000),
            0x08 => Bits::writable(0xfffd_fcf3 | 1 << 17).with_read_only(0xc),
            0x0c => Bits::writable(0x00bf_3f00).with_read_only(0xbf),
            0x30 => Bits::writable(if f446 { 0x6060_1000 | 0x0030_00ff } else { 0x7e74_11ff }),
            0x40 => Bits::writable(if f446 { 0x3fff_c9ff } else { 0x36fe_c9ff }),
            0x44 => Bits::writable(if f446 { 0x00c7_7f33 } else { 0x0007_5f33 }),
            0x74 => Bits::writable(1 | 1 << 24).with_read_only(0xfe00_0002),
            _ => return None,
        })
    }

    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 => self.control,
            0x04 => self.pll,
            0x08 => self.configuration,
            0x0c => self.interrupts,
            0x30 => self.enables[0],
            0x40 => self.enables[1],
            0x44 => self.enables[2],
            _ => self.status,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Result<(), Violation> {
        match offset {
            0x00 => return self.write_control(value, now),
            0x04 if self.control & PLL_ON != 0 => {
                return Err(Violation::Forbidden("the PLL is configured while it runs (7.3.2)"));
            }
            0x04 => self.pll = value | self.pll & 0x2000_0000,
            0x08 => return self.write_configuration(value),
            0x0c => {
                self.interrupts &= !(value >> 16 & 0xbf);
                self.interrupts = self.interrupts & 0xff | value & 0x3f00;
            }
            0x30 => self.enable(Domain::Ahb1, value, now),
            0x40 => self.enable(Domain::Apb1, value, now),
            0x44 => self.enable(Domain::Apb2, value, now),
            _ => {
                if value & 1 << 24 != 0 {
                    self.status &= 0x00ff_ffff;
                }
                self.status = self.status & !1 | value & 1;
                self.lsi_ready_at = match (value & 1 != 0, self.lsi_ready_at) {
                    (false, _) => NEVER,
                    (true, NEVER) => now + LSI_START,
                    (true, at) => at,
                };
            }
        }
        Ok(())
    }

    /// Enables clocks. After the store's own cycle, they take 2 cycles on AHB and 1 plus the bus's divisor on APB
    /// (ES0182, 2.1.13).
    fn enable(&mut self, domain: Domain, value: u32, now: Time) {
        let wait = (2 + self.apb_divisor(domain)) * self.hclk();
        let new = value & !self.enables[domain as usize];
        for bit in 0..32 {
            let ready = &mut self.ready[domain as usize][bit];
            if new >> bit & 1 != 0 {
                *ready = now + wait;
            } else if value >> bit & 1 == 0 {
                *ready = NEVER;
            }
        }
        self.enables[domain as usize] = value;
    }

    fn write_control(&mut self, value: u32, now: Time) -> Result<(), Violation> {
        let changed = value ^ self.control;
        if self.source() == ClockSource::Pll && changed & PLL_ON != 0 {
            return Err(Violation::Forbidden("the PLL is switched off while it is the system clock (7.3.1)"));
        }
        if value & 1 == 0 {
            return Err(Violation::NotModelled("HSI off"));
        }
        if changed & HSE_BYPASS != 0 && self.control & HSE_ON != 0 {
            return Err(Violation::Forbidden("HSEBYP is changed while HSE is on (7.3.1)"));
        }
        self.control = self.control & 0xff02_ff02 | value & 0x150d_00f9 | self.control & 0x0a00_0000;
        if changed & HSE_ON != 0 {
            let bypassed = value & HSE_BYPASS != 0;
            let swings =
                self.crystal.hz != 0 && !self.crystal_stopped && bypassed == self.crystal.is_clock_input;
            let starts = value & HSE_ON != 0 && swings;
            self.hse_ready_at = if starts { now + self.crystal.start } else { NEVER };
        }
        if changed & PLL_ON != 0 {
            self.pll_ready_at = NEVER;
            if value & PLL_ON != 0 {
                self.pll_period()?;
                let source_ready = !self.pll_from_hse() || self.control & 1 << 17 != 0;
                self.pll_ready_at = if source_ready { now + PLL_LOCK } else { NEVER };
            }
        }
        self.control = self.control & !PLL_ON | value & PLL_ON;
        self.advance(now);
        Ok(())
    }

    /// Period of the PLL's output; an error if a factor or a frequency is outside its limits (7.3.2).
    fn pll_period(&self) -> Result<Time, Violation> {
        let (m, n) = (self.pll & 63, self.pll >> 6 & 0x1ff);
        let p = 2 * ((self.pll >> 16 & 3) + 1);
        if m < 2 || !(50..=432).contains(&n) || self.pll >> 24 & 15 < 2 {
            return Err(Violation::Forbidden("a factor of the PLL (7.3.2)"));
        }
        let source_hz = if self.pll_from_hse() { self.crystal.hz } else { frequency(self.hsi) };
        let input_hz = source_hz / m;
        if !self.chip.pll_input_hz().contains(&input_hz) {
            return Err(Violation::Forbidden("the PLL's input is not at 1 to 2 MHz (7.3.2)"));
        }
        let vco_hz = (u64::from(source_hz) * u64::from(n) / u64::from(m)) as u32;
        if !self.chip.vco_hz().contains(&vco_hz) {
            return Err(Violation::ClockTooFast(vco_hz));
        }
        Ok(period(vco_hz / p))
    }

    fn write_configuration(&mut self, value: u32) -> Result<(), Violation> {
        self.configuration = self.configuration & 0xc | value & !0xc;
        self.system = match value & 3 {
            0 => self.hsi,
            1 if self.control & 1 << 17 != 0 => period(self.crystal.hz),
            2 if self.control & 1 << 25 != 0 => self.pll_period()?,
            1 | 2 => return Err(Violation::NotModelled("a system clock chosen before it is ready")),
            _ => return Err(Violation::Forbidden("a system clock that does not exist (7.3.3)")),
        };
        self.configuration = self.configuration & !0xc | (value & 3) << 2;
        let limit = |period: Time, limit_hz: u32| {
            let hz = frequency(period);
            if hz > limit_hz { Err(Violation::ClockTooFast(hz)) } else { Ok(()) }
        };
        limit(self.hclk(), self.chip.fastest_hz())?;
        limit(self.pclk(Domain::Apb1), self.chip.fastest_hz() / 4)?;
        limit(self.pclk(Domain::Apb2), self.chip.fastest_hz() / 2)
    }
}
