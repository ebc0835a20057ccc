//! The system control space: SysTick, NVIC, SCB, MPU, FPU control, DWT (ARMv7-M reference manual, B3 and C1).

use super::mpu::Mpu;
use super::nvic::{self, Nvic};
use crate::clock::{NEVER, Time};
use crate::error::{Trap, Violation};

/// Value of CCR that is modelled: STKALIGN set; division by zero and unaligned accesses do not trap.
const CCR_RESET: u32 = 1 << 9;

/// The registers, and the counters behind them.
#[derive(Debug, Clone)]
pub(crate) struct System {
    pub(crate) nvic: Nvic,
    pub(crate) mpu: Mpu,
    systick: SysTick,
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
    cycles: Cycles,
    /// A system reset was requested (SYSRESETREQ).
    pub(crate) reset_requested: bool,
}

/// The cycle counter: its value `base` at the time `since`.
#[derive(Debug, Clone, Copy)]
struct Cycles {
    base: u32,
    since: Time,
}

/// The SysTick timer (B3.3).
#[derive(Debug, Clone)]
struct SysTick {
    control: u32,
    reload: u32,
    /// When it next reaches zero.
    zero_at: Time,
    /// Its value while it is disabled.
    stopped_at: u32,
    counted: bool,
    /// Time at which the debugger halted the core, if it has.
    frozen_at: Option<Time>,
}

impl SysTick {
    fn period(&self, hclk: Time) -> Time {
        if self.control & 4 != 0 { hclk } else { 8 * hclk }
    }

    fn value(&self, now: Time, hclk: Time) -> u32 {
        if self.control & 1 == 0 {
            return self.stopped_at;
        }
        let left = self.zero_at.saturating_sub(now) / self.period(hclk);
        if left > Time::from(self.reload) { 0 } else { left as u32 }
    }

    fn start(&mut self, now: Time, hclk: Time) {
        let clocks = if self.stopped_at == 0 { Time::from(self.reload) + 1 } else { self.stopped_at.into() };
        self.zero_at = now + clocks * self.period(hclk);
    }
}

impl System {
    pub(crate) fn new() -> Self {
        Self {
            nvic: Nvic::new(),
            mpu: Mpu::default(),
            systick: SysTick {
                control: 4,
                reload: 0,
                zero_at: NEVER,
                stopped_at: 0,
                counted: false,
                frozen_at: None,
            },
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
            cycles: Cycles { base: 0, since: 0 },
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

    /// When SysTick next reaches zero.
    pub(crate) fn deadline(&self) -> Time {
        let counts = self.systick.control & 1 != 0 && self.systick.reload != 0;
        if counts && self.systick.frozen_at.is_none() { self.systick.zero_at } else { NEVER }
    }

    /// The debugger halts the core or resumes it.
    pub(crate) fn freeze(&mut self, halted: bool, now: Time) {
        if halted {
            self.systick.frozen_at = Some(now);
        } else if let Some(since) = self.systick.frozen_at.take().filter(|_| self.systick.zero_at != NEVER) {
            self.systick.zero_at += now - since;
        }
    }

    /// When SysTick next interrupts; `None` if it does not.
    pub(crate) fn next_tick(&self) -> Option<Time> {
        Some(self.deadline()).filter(|&at| at != NEVER && self.systick.control & 2 != 0)
    }

    /// Processes SysTick events that are due.
    pub(crate) fn advance(&mut self, now: Time, hclk: Time) {
        while self.deadline() <= now {
            self.systick.counted = true;
            if self.systick.control & 2 != 0 {
                self.nvic.pend(nvic::SYS_TICK);
            }
            self.systick.zero_at += (Time::from(self.systick.reload) + 1) * self.systick.period(hclk);
        }
    }

    /// The core clock changes from period `old` to `new`.
    pub(crate) fn change_clock(&mut self, now: Time, old: Time, new: Time) {
        self.cycles = Cycles { base: self.cycle_count(now, old), since: now };
        if self.systick.control & 1 != 0 {
            let left = self.systick.zero_at.saturating_sub(now) / old;
            self.systick.zero_at = now + left * new;
        }
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
        let unknown = Err(Trap::Stop(Violation::UnknownRegister(address)));
        Ok(match address {
            0xe000_1000 => self.dwt_control,
            0xe000_1004 => self.cycle_count(now, hclk),
            0xe000_edfc => self.demcr,
            0xe000_e004 => 3,
            0xe000_e010 => {
                self.advance(now, hclk);
                self.systick.control | u32::from(std::mem::take(&mut self.systick.counted)) << 16
            }
            0xe000_e014 => self.systick.reload,
            0xe000_e018 => self.systick.value(now, hclk),
            0xe000_e01c => 0x4000_4650,
            0xe000_e100..0xe000_e110 | 0xe000_e180..0xe000_e190 => self.nvic.enabled.word(word(address)),
            0xe000_e200..0xe000_e210 | 0xe000_e280..0xe000_e290 => self.nvic.pending.word(word(address)),
            0xe000_e300..0xe000_e310 => self.nvic.active.word(word(address)),
            0xe000_e400..0xe000_e464 => self.priorities(16 + (address - 0xe000_e400) as usize),
            0xe000_ed00 => 0x410f_c241,
            0xe000_ed08 => self.vtor,
            0xe000_ed0c => 0xfa05_0000 | u32::from(self.nvic.group) << 8,
            0xe000_ed10 => self.scr,
            0xe000_ed14 => CCR_RESET,
            0xe000_ed18 => self.priorities(4),
            0xe000_ed1c => self.priorities(8),
            0xe000_ed20 => self.priorities(12),
            0xe000_ed24 => self.shcsr,
            0xe000_ed28 => self.cfsr,
            0xe000_ed2c => self.hfsr,
            0xe000_ed34 => self.mmfar,
            0xe000_ed38 => self.bfar,
            0xe000_ed88 => self.cpacr,
            0xe000_ef34 => self.fpccr,
            0xe000_ef38 => self.fpcar,
            0xe000_ef3c => self.fpdscr,
            0xe000_ed90..0xe000_edbc => match self.mpu.read(address & 0xff) {
                Some(value) => value,
                None => return unknown,
            },
            _ => return unknown,
        })
    }

    pub(crate) fn write(&mut self, address: u32, value: u32, now: Time, hclk: Time) -> Result<(), Trap> {
        let unknown = Err(Trap::Stop(Violation::UnknownRegister(address)));
        self.nvic.changed = true;
        match address {
            0xe000_1000 | 0xe000_edfc => {
                let base = self.cycle_count(now, hclk);
                if address == 0xe000_1000 {
                    self.dwt_control = 0x4000_0000 | value & 1
                } else {
                    self.demcr = value
                }
                self.cycles = Cycles { base, since: now };
            }
            0xe000_1004 => self.cycles = Cycles { base: value, since: now },
            // The lock access register of the DWT, which is not locked for the processor.
            0xe000_1fb0 => {}
            0xe000_e010 => {
                let value = value & 7;
                self.systick.stopped_at = self.systick.value(now, hclk);
                self.systick.control = value;
                self.systick.start(now, hclk);
            }
            0xe000_e014 => self.systick.reload = value & 0xff_ffff,
            0xe000_e018 => {
                self.systick.stopped_at = 0;
                self.systick.counted = false;
                self.systick.start(now, hclk);
            }
            0xe000_e100..0xe000_e110 => self.nvic.enabled.put_word(word(address), value, true),
            0xe000_e180..0xe000_e190 => self.nvic.enabled.put_word(word(address), value, false),
            0xe000_e200..0xe000_e210 => self.nvic.pending.put_word(word(address), value, true),
            0xe000_e280..0xe000_e290 => {
                self.nvic.pending.put_word(word(address), value, false);
                let high =
                    self.nvic.lines.word(word(address)) & value & !self.nvic.active.word(word(address));
                self.nvic.pending.put_word(word(address), high, true);
            }
            0xe000_e400..0xe000_e464 => self.set_priorities(16 + (address - 0xe000_e400) as usize, value),
            0xe000_ed04 => self.pend_system(value),
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
            0xe000_ed18 => self.set_priorities(4, value & 0x00ff_ffff),
            0xe000_ed1c => self.set_priorities(8, value & 0xff00_0000),
            0xe000_ed20 => self.set_priorities(12, value),
            0xe000_ed24 => {
                self.shcsr = value & 7 << 16;
                for (bit, exception) in
                    [(16, nvic::MEM_MANAGE), (17, nvic::BUS_FAULT), (18, nvic::USAGE_FAULT)]
                {
                    self.nvic.enabled.put(exception, value >> bit & 1 != 0);
                }
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
            _ => return unknown,
        }
        Ok(())
    }

    /// ICSR: pending bits (B3.2.4).
    fn pend_system(&mut self, value: u32) {
        for (bit, exception, pend) in [
            (31, nvic::NMI, true),
            (28, nvic::PEND_SV, true),
            (27, nvic::PEND_SV, false),
            (26, nvic::SYS_TICK, true),
            (25, nvic::SYS_TICK, false),
        ] {
            if value >> bit & 1 != 0 {
                self.nvic.pending.put(exception, pend);
            }
        }
    }

    /// ICSR as it is read; `current` is the number of the running handler.
    pub(crate) fn interrupt_state(&self, current: u16) -> u32 {
        let pending = self.nvic.most_urgent().map_or(0, |(exception, _)| exception as u32);
        let bit = |exception, bit: u32| u32::from(self.nvic.pending.has(exception)) << bit;
        u32::from(current)
            | pending << 12
            | bit(nvic::SYS_TICK, 26)
            | bit(nvic::PEND_SV, 28)
            | bit(nvic::NMI, 31)
    }

    /// Writes a byte of a priority register; returns whether there is one at this address.
    pub(crate) fn write_byte(&mut self, address: u32, value: u8) -> bool {
        self.nvic.changed = true;
        let exception = match address {
            0xe000_e400..0xe000_e461 => 16 + (address - 0xe000_e400) as usize,
            0xe000_ed18..0xe000_ed24 => 4 + (address - 0xe000_ed18) as usize,
            _ => return false,
        };
        self.nvic.priority[exception] = value & 0xf0;
        true
    }

    pub(crate) fn read_byte(&self, address: u32) -> Option<u8> {
        let exception = match address {
            0xe000_e400..0xe000_e461 => 16 + (address - 0xe000_e400) as usize,
            0xe000_ed18..0xe000_ed24 => 4 + (address - 0xe000_ed18) as usize,
            _ => return None,
        };
        Some(self.nvic.priority[exception])
    }

    fn priorities(&self, first: usize) -> u32 {
        (0..4).fold(0, |word, i| {
            word | u32::from(self.nvic.priority.get(first + i).copied().unwrap_or(0)) << (8 * i)
        })
    }

    fn set_priorities(&mut self, first: usize, value: u32) {
        for i in 0..4 {
            if let Some(priority) = self.nvic.priority.get_mut(first + i) {
                *priority = (value >> (8 * i)) as u8 & 0xf0;
            }
        }
    }
}

/// Index of a register in its array of NVIC registers.
fn word(address: u32) -> usize {
    (address >> 2 & 7) as usize
}
