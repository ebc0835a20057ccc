//! The processor's main loop: fetch, execution, exceptions, sleep.

use crate::bus::Bus;
use crate::clock::{NEVER, Time};
use crate::decode::{Undecodable, decode, is_wide};
use crate::error::{Fault, Stopped, Trap, Violation};
use crate::execute::memory::size;
use crate::instruction::{Instruction, Op, Unit};
use crate::peripherals::rcc::{SOFTWARE_FLAG, WATCHDOG_FLAG};
use crate::processor::mpu::Purpose;
use crate::processor::registers::Registers;
use crate::processor::waiting::Watch;

pub(crate) const FLASH: u32 = 0x0800_0000;

/// The core, and the bus with everything it can address.
#[derive(Debug, Clone)]
pub(crate) struct Machine {
    pub(crate) registers: Registers,
    pub(crate) bus: Bus,
    /// Decoded instructions, one entry per half-word of flash. The last entry is for code elsewhere, which is decoded
    /// each time it executes.
    decoded: Vec<Instruction>,
    pub(crate) next: u32,
    pub(crate) cycles: u32,
    pub(crate) in_it: bool,
    /// The previous instruction was a load.
    pub(crate) loaded: bool,
    pub(crate) asleep: bool,
    pub(crate) locked_up: bool,
    /// The core is stalled until this time; peripherals keep running.
    pub(crate) stalled_until: Time,
    /// Held in reset, or without power.
    pub(crate) held: bool,
    pub(crate) event: bool,
    pub(crate) exclusive: bool,
    /// Instructions executed, those skipped in waiting loops included.
    pub(crate) executed: u64,
    pub(crate) skipped: u64,
    pub(crate) resets: u64,
    pub(crate) watch: Watch,
    /// Whether waiting loops are skipped.
    pub(crate) skips: bool,
}

impl Machine {
    /// The state at power-on; instructions in the first `code_bytes` of flash are cached in decoded form.
    pub(crate) fn new(mut bus: Bus, code_bytes: usize) -> Self {
        let registers = Registers::after_reset(|| bus.random() as u32);
        let undecoded = Instruction { op: Op::Undecoded, length: 2 };
        Self {
            registers,
            bus,
            decoded: vec![undecoded; code_bytes / 2 + 2],
            next: 0,
            cycles: 0,
            in_it: false,
            loaded: false,
            asleep: false,
            locked_up: false,
            stalled_until: 0,
            held: false,
            event: false,
            exclusive: false,
            executed: 0,
            skipped: 0,
            resets: 0,
            watch: Watch::default(),
            skips: true,
        }
    }

    /// A reset of the core: stack pointer and program counter from the vectors.
    pub(crate) fn reset(&mut self) -> Result<(), Violation> {
        let bus = &mut self.bus;
        self.registers = Registers::after_reset(|| bus.random() as u32);
        let stack = self.bus.vector(0)?;
        let start = self.bus.vector(1)?;
        self.registers.r[13] = stack & !3;
        self.registers.r[14] = u32::MAX;
        self.registers.pc = start & !1;
        self.asleep = false;
        self.locked_up = false;
        self.stalled_until = 0;
        self.exclusive = false;
        self.resets += 1;
        if start & 1 == 0 {
            Err(Violation::Forbidden("a reset vector without its lowest bit"))
        } else {
            Ok(())
        }
    }

    /// Forgets the decoded instructions around an address of flash.
    pub(crate) fn forget(&mut self, address: u32) {
        let index = (address & 0x00ff_ffff) as usize / 2;
        for i in index.saturating_sub(1)..=index {
            if let Some(instruction) = self.decoded.get_mut(i) {
                instruction.op = Op::Undecoded;
            }
        }
    }

    /// Runs until a time.
    pub(crate) fn run_until(&mut self, end: Time) -> Result<(), Stopped> {
        self.run(end).map_err(|violation| Stopped {
            violation,
            program_counter: self.registers.pc,
            time: self.bus.now,
        })
    }

    fn run(&mut self, end: Time) -> Result<(), Violation> {
        while self.bus.now < end {
            if self.bus.now >= self.bus.deadline {
                self.bus.advance();
            }
            if self.bus.watchdog_reset || self.bus.system.reset_requested {
                let flag = if self.bus.watchdog_reset { WATCHDOG_FLAG } else { SOFTWARE_FLAG };
                self.bus.reset(flag);
                self.reset()?;
            }
            if self.held || self.locked_up || self.bus.rcc.stopped || self.bus.debug_freeze.halted {
                self.bus.now = self.idle_until(end);
                continue;
            }
            if self.bus.now < self.stalled_until {
                self.bus.now = self.idle_until(end.min(self.stalled_until));
                continue;
            }
            if self.bus.system.nvic.changed && self.take_pending()? {
                self.bus.now += Time::from(self.cycles) * self.bus.hclk;
                self.watch.forget();
                continue;
            }
            if self.asleep {
                self.sleep(end);
                continue;
            }
            self.run_steps(end)?;
        }
        Ok(())
    }

    /// Executes instructions until an exception or a peripheral event may be due, or until `end`.
    fn run_steps(&mut self, end: Time) -> Result<(), Violation> {
        loop {
            self.step()?;
            let bus = &self.bus;
            if bus.system.nvic.changed || self.asleep || bus.now >= bus.deadline.min(end) || self.locked_up {
                return Ok(());
            }
            if bus.system.reset_requested {
                return Ok(());
            }
            if self.next < self.bus.pc && self.skips {
                self.skip_waiting(end);
            }
        }
    }

    /// The next deadline, but not beyond the end of the run.
    fn idle_until(&self, end: Time) -> Time {
        let deadline = if self.held { NEVER } else { self.bus.deadline };
        deadline.clamp(self.bus.now + 1, end.max(self.bus.now + 1))
    }

    /// WFI or WFE: wakes if an exception or event is pending, else advances time to the next deadline in whole clocks.
    fn sleep(&mut self, end: Time) {
        if self.wakes() || std::mem::take(&mut self.event) {
            self.asleep = false;
            self.bus.system.nvic.changed = true;
            return;
        }
        let until = self.idle_until(end);
        let clocks = (until - self.bus.now).div_ceil(self.bus.hclk);
        self.bus.now += clocks * self.bus.hclk;
    }

    /// Executes one instruction.
    #[inline]
    fn step(&mut self) -> Result<(), Violation> {
        let pc = self.registers.pc;
        self.bus.pc = pc;
        self.executed += 1;
        self.cycles = 1;
        let it = self.registers.it;
        let done = match self.decoded_at(pc) {
            Ok(place) => {
                let instruction = self.decoded[place];
                self.next = pc.wrapping_add(instruction.length.into());
                self.registers.r[15] = pc.wrapping_add(4);
                if it == 0 {
                    self.in_it = false;
                    self.execute(instruction.op)
                } else {
                    self.conditional(instruction.op, it)
                }
            }
            Err(trap) => Err(trap),
        };
        match done {
            Ok(()) => self.registers.pc = self.next,
            Err(Trap::Stop(violation)) => return Err(violation),
            Err(Trap::Fault(fault)) => {
                self.registers.it = it;
                self.fault(fault)?;
            }
        }
        self.bus.now += Time::from(self.cycles) * self.bus.hclk;
        Ok(())
    }

    /// Executes an instruction of an IT block if its condition holds.
    fn conditional(&mut self, op: Op, it: u8) -> Result<(), Trap> {
        let last = it & 15 == 8;
        let never =
            matches!(op, Op::It(_) | Op::BranchIf { .. } | Op::BranchZero { .. } | Op::ChangeMasks { .. });
        if never {
            return Err(Violation::Unpredictable(self.code_at(self.registers.pc)).into());
        }
        self.registers.advance_it();
        if !self.registers.holds(it >> 4) {
            return Ok(());
        }
        self.in_it = true;
        let straight = self.next;
        self.execute(op)?;
        if self.next != straight && !last {
            return Err(Violation::Unpredictable(self.code_at(self.registers.pc)).into());
        }
        Ok(())
    }

    fn code_at(&self, address: u32) -> u32 {
        let first = self.bus.fetch(address).unwrap_or(0);
        if is_wide(first) {
            u32::from(first) << 16 | u32::from(self.bus.fetch(address.wrapping_add(2)).unwrap_or(0))
        } else {
            first.into()
        }
    }

    /// The instruction at an address.
    pub(crate) fn instruction(&mut self, pc: u32) -> Result<Instruction, Trap> {
        self.decoded_at(pc).map(|place| self.decoded[place])
    }

    /// Index in `decoded` of the instruction at an address.
    #[inline]
    fn decoded_at(&mut self, pc: u32) -> Result<usize, Trap> {
        if self.bus.system.mpu.enabled() && !self.allowed(pc, Purpose::Execute) {
            return Err(Fault::MemoryInstruction.into());
        }
        let elsewhere = self.decoded.len() - 1;
        let place = (pc.wrapping_sub(FLASH) >> 1) as usize;
        if place < elsewhere && !matches!(self.decoded[place].op, Op::Undecoded) {
            return Ok(place);
        }
        self.decode_into(place.min(elsewhere), pc)
    }

    #[cold]
    fn decode_into(&mut self, place: usize, pc: u32) -> Result<usize, Trap> {
        self.decoded[place] = self.decode_at(pc)?;
        Ok(place)
    }

    fn decode_at(&mut self, pc: u32) -> Result<Instruction, Trap> {
        let nothing = |bus: &Bus, address| bus.nothing_at(address, Violation::Unmapped(address));
        let first = self.bus.fetch(pc).ok_or_else(|| nothing(&self.bus, pc))?;
        let second = if is_wide(first) {
            self.bus.fetch(pc.wrapping_add(2)).ok_or_else(|| nothing(&self.bus, pc))?
        } else {
            0
        };
        decode(first, second, pc).map_err(|undecodable| {
            if self.bus.rules.faults_are_taken {
                return Fault::UndefinedInstruction.into();
            }
            let code = self.code_at(pc);
            Trap::Stop(match undecodable {
                Undecodable::Unknown => Violation::UnknownInstruction(code),
                Undecodable::Unpredictable => Violation::Unpredictable(code),
            })
        })
    }

    #[inline]
    fn allowed(&mut self, address: u32, purpose: Purpose) -> bool {
        let registers = &self.registers;
        let suspended = registers.faultmask || matches!(registers.ipsr, 2 | 3);
        self.bus.system.mpu.allows(address, purpose, registers.privileged(), suspended)
    }

    /// Loads from memory or a register, extended to 32 bits.
    #[inline]
    pub(crate) fn load(&mut self, address: u32, unit: Unit) -> Result<u32, Trap> {
        let bytes = size(unit);
        if self.bus.system.mpu.enabled() && !self.allowed(address, Purpose::Read) {
            return Err(Fault::MemoryData(address).into());
        }
        if address & (bytes - 1) != 0 {
            self.unaligned(address)?;
        }
        let value = match self.bus.read_memory(address, unit) {
            Some(value) => {
                if address >> 24 == 8 {
                    self.cycles += self.bus.cache.load(address);
                }
                value
            }
            None if address == 0xe000_ed04 => self.bus.system.interrupt_state(self.registers.ipsr),
            None => self.bus.read_register(address, bytes)?,
        };
        Ok(match unit {
            Unit::SignedHalf => value as i16 as u32,
            Unit::SignedByte => value as i8 as u32,
            _ => value,
        })
    }

    /// Stores to memory or a register.
    #[inline]
    pub(crate) fn store(&mut self, address: u32, unit: Unit, value: u32) -> Result<(), Trap> {
        let bytes = size(unit);
        if self.bus.system.mpu.enabled() && !self.allowed(address, Purpose::Write) {
            return Err(Fault::MemoryData(address).into());
        }
        if address & (bytes - 1) != 0 {
            self.unaligned(address)?;
        }
        self.watch.stored();
        if self.bus.write_memory(address, unit, value) {
            return Ok(());
        }
        if matches!(address >> 24, 0x00 | 0x08 | 0x1f) {
            return Err(self.bus.nothing_at(address, Violation::ReadOnly(address)));
        }
        self.bus.write_register(address, bytes, value)
    }

    /// The core splits unaligned accesses to memory; those to registers end the run.
    fn unaligned(&mut self, address: u32) -> Result<(), Trap> {
        let memory =
            matches!(address >> 24, 0x00 | 0x08 | 0x10 | 0x20) || self.bus.below_sram(address).is_some();
        if !memory {
            return Err(Violation::Unaligned(address).into());
        }
        self.cycles += 1;
        self.bus.tolerate(self.bus.rules.unaligned, Violation::Unaligned(address))
    }
}
