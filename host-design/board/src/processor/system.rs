//! The system control space: SysTick, NVIC, SCB, MPU, FPU control, DWT (ARMv7-M reference manual, B3 and C1).

use super::mpu::Mpu;
use super::nvic::{self, Nvic};
use super::systick::SysTick;
use crate::clock::Time;
use crate::error::{Trap, Violation};

/// Value of CCR that is modelled: STKALIGN set; division by zero and unaligned accesses do not trap.
const CCR_RESET: u32 = 1 << 9;

/// The registers, and the counters behind them.
#[derive(Debug, Clone)]
pub(crate) struct System {
    pub(crate) nvic: Nvic,
    pub(crate) mpu: Mpu,
    pub(crate) systick: SysTick,
    pub(crate) vtor: u32,
    scr: u32,
    pub(crate) shcsr: u32,
    pub(crate) cfsr: u32,
    pub(crate) hfsr: u32,
    pub(crate) mmfar: u32,
    pub(crate) bfar: u32,
    cpacr: u32,
    pub(crate) fpccr: u32,
    pub(crate) fpcar: u32,
    pub(crate) fpdscr: u32,
    demcr: u32,
    dwt_control: u32,
    cycles: CycleCounter,
    /// A system reset was requested (SYSRESETREQ).
    pub(crate) reset_requested: bool,
}

/// The cycle counter: its value `base` at the time `since`.
#[derive(Debug, Clone, Copy)]
struct CycleCounter {
    base: u32,
    since: Time,
}

impl System {
    pub(crate) fn new() -> Self {
        Self {
            nvic: Nvic::new(),
            mpu: Mpu::default(),
            systick: SysTick::new(),
            vtor: 0,
            scr: 0,
            shcsr: 0,
            cfsr: 0,
            hfsr: 0,
            mmfar: 0,
            bfar: 0,
            cpacr: 0,
            // ASPEN and LSPEN.
            fpccr: 3 << 30,
            fpcar: 0,
            fpdscr: 0,
            demcr: 0,
            dwt_control: 0x4000_0000,
            cycles: CycleCounter { base: 0, since: 0 },
            reset_requested: false,
        }
    }

    /// Whether the floating-point unit may be used.
    pub(crate) fn float_enabled(&self, privileged: bool) -> bool {
        match self.cpacr >> 20 & 15 {
            15 => true,
            5 => privileged,
            _ => false,
        }
    }

    /// Processes SysTick events that are due.
    pub(crate) fn advance(&mut self, now: Time, hclk: Time) {
        if self.systick.advance(now, hclk) {
            self.nvic.pend(nvic::SYS_TICK);
        }
    }

    /// The core clock changes from period `old` to `new`.
    pub(crate) fn change_clock(&mut self, now: Time, old: Time, new: Time) {
        self.cycles = CycleCounter { base: self.cycle_count(now, old), since: now };
        self.systick.change_clock(now, old, new);
    }

    /// Value of DWT_CYCCNT.
    pub(crate) fn cycle_count(&self, now: Time, hclk: Time) -> u32 {
        if self.demcr & 1 << 24 != 0 && self.dwt_control & 1 != 0 {
            self.cycles.base.wrapping_add(((now - self.cycles.since) / hclk) as u32)
        } else {
            self.cycles.base
        }
    }

    pub(crate) fn read(&mut self, address: u32, now: Time, hclk: Time) -> Result<u32, Trap> {
        let unknown = Trap::Stop(Violation::UnknownRegister(address));
        Ok(match address {
            0xe000_1000 => self.dwt_control,
            0xe000_1004 => self.cycle_count(now, hclk),
            0xe000_edfc => self.demcr,
            0xe000_e004 => 3,
            0xe000_e010..0xe000_e020 => {
                if address == 0xe000_e010 {
                    self.advance(now, hclk);
                }
                self.systick.read(address, now, hclk).ok_or(unknown)?
            }
            0xe000_e100..0xe000_e500 => self.nvic.read(address).ok_or(unknown)?,
            0xe000_ed00 => 0x410f_c241,
            0xe000_ed08 => self.vtor,
            0xe000_ed0c => 0xfa05_0000 | u32::from(self.nvic.group) << 8,
            0xe000_ed10 => self.scr,
            0xe000_ed14 => CCR_RESET,
            0xe000_ed18 => self.nvic.priorities(4),
            0xe000_ed1c => self.nvic.priorities(8),
            0xe000_ed20 => self.nvic.priorities(12),
            0xe000_ed24 => self.shcsr,
            0xe000_ed28 => self.cfsr,
            0xe000_ed2c => self.hfsr,
            0xe000_ed34 => self.mmfar,
            0xe000_ed38 => self.bfar,
            0xe000_ed88 => self.cpacr,
            0xe000_ef34 => self.fpccr,
            0xe000_ef38 => self.fpcar,
            0xe000_ef3c => self.fpdscr,
            0xe000_ed90..0xe000_edbc => self.mpu.read(address & 0xff).ok_or(unknown)?,
            _ => return Err(unknown),
        })
    }

    pub(crate) fn write(&mut self, address: u32, value: u32, now: Time, hclk: Time) -> Result<(), Trap> {
        let unknown = Trap::Stop(Violation::UnknownRegister(address));
        self.nvic.changed = true;
        match address {
            0xe000_1000 | 0xe000_edfc => {
                let base = self.cycle_count(now, hclk);
                if address == 0xe000_1000 {
                    self.dwt_control = 0x4000_0000 | value & 1
                } else {
                    self.demcr = value
                }
                self.cycles = CycleCounter { base, since: now };
            }
            0xe000_1004 => self.cycles = CycleCounter { base: value, since: now },
            // The lock access register of the DWT, which is not locked for the processor.
            0xe000_1fb0 => {}
            0xe000_e010..0xe000_e020 if self.systick.write(address, value, now, hclk) => {}
            0xe000_e100..0xe000_e500 if self.nvic.write(address, value) => {}
            0xe000_ed04 => self.nvic.pend_system(value),
            0xe000_ed08 => self.vtor = value & !0x7f,
            0xe000_ed0c if value >> 16 == 0x05fa => {
                self.nvic.group = (value >> 8 & 7) as u8;
                self.reset_requested = value & 4 != 0;
            }
            0xe000_ed0c => {}
            0xe000_ed10 if value & 4 != 0 => return Err(Violation::NotModelled("SLEEPDEEP").into()),
            0xe000_ed10 => self.scr = value & 0x1e,
            0xe000_ed14 if value & !0x20a == CCR_RESET & !0x20a => {}
            0xe000_ed14 => return Err(Violation::NotModelled("this setting of CCR").into()),
            0xe000_ed18 => self.nvic.set_priorities(4, value & 0x00ff_ffff),
            0xe000_ed1c => self.nvic.set_priorities(8, value & 0xff00_0000),
            0xe000_ed20 => self.nvic.set_priorities(12, value),
            0xe000_ed24 => {
                self.shcsr = value & 7 << 16;
                self.nvic.enable_faults(value);
            }
            0xe000_ed28 => self.cfsr &= !value,
            0xe000_ed2c => self.hfsr &= !value,
            0xe000_ed34 => self.mmfar = value,
            0xe000_ed38 => self.bfar = value,
            0xe000_ed88 => self.cpacr = value & 0x00f0_0000,
            0xe000_ef34 => self.fpccr = value & 0xc000_017b,
            0xe000_ef38 => self.fpcar = value & !7,
            0xe000_ef3c => self.fpdscr = value & 0x07c0_0000,
            // STIR
            0xe000_ef00 => self.nvic.pend(16 + (value & 0xff).min(nvic::INTERRUPTS as u32 - 1) as usize),
            0xe000_ed90..0xe000_edbc if self.mpu.write(address & 0xff, value) => {}
            _ => return Err(unknown),
        }
        Ok(())
    }
}
