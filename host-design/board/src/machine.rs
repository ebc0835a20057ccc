//! The state of core and board, and what every instruction needs of it: fetch, loads and stores.

use crate::bus::Bus;
use crate::clock::Time;
use crate::decode::{Undecodable, decode, is_wide};
use crate::error::{ProcessorFault, Trap, Violation};
use crate::instruction::{Instruction, Op, Unit};
use crate::processor::mpu::Purpose;
use crate::processor::pipeline::Pipeline;
use crate::processor::registers::Registers;
use crate::processor::watch::Watch;
use crate::timing::CoreTiming;

pub(crate) const FLASH: u32 = 0x0800_0000;

/// The core, and the bus with everything it can address.
#[derive(Debug, Clone)]
pub(crate) struct Microcontroller {
    pub(crate) registers: Registers,
    pub(crate) bus: Bus,
    /// Decoded instructions, one entry per half-word of flash. The last entry is for code elsewhere, which is decoded
    /// each time it executes.
    pub(crate) decoded: Vec<Instruction>,
    pub(crate) next: u32,
    pub(crate) cycles: u32,
    pub(crate) in_it: bool,
    /// The previous instruction was a load with which the next one overlaps.
    pub(crate) loaded: bool,
    pub(crate) pipeline: Pipeline,
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

impl Microcontroller {
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
            pipeline: Pipeline::default(),
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

    pub(crate) fn code_at(&self, address: u32) -> u32 {
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
    pub(crate) fn decoded_at(&mut self, pc: u32) -> Result<usize, Trap> {
        if self.bus.system.mpu.enabled() && !self.allowed(pc, Purpose::Execute) {
            return Err(ProcessorFault::MemoryInstruction.into());
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
                return ProcessorFault::UndefinedInstruction.into();
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

    /// Whether the next load overlaps with one that has itself, or not, overlapped with the one before.
    #[inline]
    pub(crate) fn may_overlap(&self, has_overlapped: bool) -> bool {
        !has_overlapped || self.bus.timing == CoreTiming::Quick
    }

    /// Loads from memory or a register, extended to 32 bits.
    #[inline]
    pub(crate) fn load(&mut self, address: u32, unit: Unit) -> Result<u32, Trap> {
        let bytes = unit.bytes();
        if self.bus.system.mpu.enabled() && !self.allowed(address, Purpose::Read) {
            return Err(ProcessorFault::MemoryData(address).into());
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
            None if address == 0xe000_ed04 => self.bus.system.nvic.interrupt_state(self.registers.ipsr),
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
        let bytes = unit.bytes();
        if self.bus.system.mpu.enabled() && !self.allowed(address, Purpose::Write) {
            return Err(ProcessorFault::MemoryData(address).into());
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
