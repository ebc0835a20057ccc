//! Entry to and return from exceptions, faults and their escalation (ARMv7-M Architecture Reference Manual, B1.5).

use crate::error::{ProcessorFault, Trap, Violation};
use crate::instruction::Unit;
use crate::machine::Microcontroller;
use crate::processor::nvic;

/// Cycles of exception entry and return without contention (TRM, 3.9.1).
const ENTRY_CYCLES: u32 = 12;
const RETURN_CYCLES: u32 = 10;
const TAIL_CHAIN_CYCLES: u32 = 6;
/// FPCCR bits.
const LAZY_ACTIVE: u32 = 1;
const LAZY: u32 = 1 << 30;
const AUTOMATIC: u32 = 1 << 31;

impl Microcontroller {
    pub(crate) fn executing_priority(&self) -> i32 {
        let registers = &self.registers;
        self.bus.system.nvic.executing(registers.primask, registers.faultmask, registers.basepri)
    }

    /// Takes the pending exception of highest priority if it can preempt; returns whether it did.
    pub(crate) fn take_pending(&mut self) -> Result<bool, Violation> {
        self.bus.system.nvic.changed = false;
        let Some((exception, priority)) = self.bus.system.nvic.most_urgent() else {
            return Ok(false);
        };
        if priority >= self.executing_priority() {
            return Ok(false);
        }
        self.asleep = false;
        self.enter(exception, self.registers.pc)?;
        Ok(true)
    }

    /// Whether WFI ends: an exception that would preempt if PRIMASK were clear.
    pub(crate) fn wakes(&self) -> bool {
        let masks = &self.registers;
        self.bus.system.nvic.most_urgent().is_some_and(|(_, priority)| {
            priority < self.bus.system.nvic.executing(false, masks.faultmask, masks.basepri)
        })
    }

    fn enter(&mut self, exception: usize, return_address: u32) -> Result<(), Violation> {
        self.cycles = ENTRY_CYCLES;
        let return_code = self.exception_return_code();
        let pushed = self.push_frame(return_address);
        self.start_handler(exception, return_code)?;
        match pushed {
            Ok(()) => Ok(()),
            Err(Trap::Stop(violation)) => Err(violation),
            // The frame is lost, and the handler of the derived fault comes first.
            Err(Trap::Fault(fault)) => {
                let bit = match fault {
                    ProcessorFault::MemoryData(_) => 1 << 4,
                    _ => 1 << 12,
                };
                self.derived(fault, bit)
            }
        }
    }

    /// Enters the handler, with the registers as in B1.5.6 (ExceptionTaken).
    fn start_handler(&mut self, exception: usize, return_code: u32) -> Result<(), Violation> {
        self.bus.system.nvic.activate(exception);
        self.bus.system.nvic.changed = true;
        let vector = self.bus.vector(exception)?;
        if self.registers.uses_process_stack() {
            std::mem::swap(&mut self.registers.r[13], &mut self.registers.other_sp);
        }
        self.registers.ipsr = exception as u16;
        self.registers.it = 0;
        self.registers.float_active = false;
        self.registers.r[14] = return_code;
        self.exclusive = false;
        self.event = true;
        self.asleep = false;
        if vector & 1 == 0 {
            return Err(Violation::Forbidden("a vector without its lowest bit"));
        }
        self.registers.pc = vector & !1;
        self.cycles += self.bus.instruction_wait(vector & !1);
        Ok(())
    }

    fn exception_return_code(&self) -> u32 {
        let base = match (self.registers.handler_mode(), self.registers.process_stack) {
            (true, _) => 0xffff_fff1,
            (false, false) => 0xffff_fff9,
            (false, true) => 0xffff_fffd,
        };
        if self.registers.float_active { base & !0x10 } else { base }
    }

    /// Stacks the frame; with lazy stacking (FPCCR), the floating-point registers only get their space reserved.
    fn push_frame(&mut self, return_address: u32) -> Result<(), Trap> {
        let with_float = self.registers.float_active && self.bus.system.fpccr & AUTOMATIC != 0;
        let size = if with_float { 0x68 } else { 0x20 };
        let sp = self.registers.r[13];
        let padded = sp & 4 != 0;
        let frame = sp.wrapping_sub(size) & !7;
        self.registers.r[13] = frame;
        let registers = &self.registers;
        let words = [
            registers.r[0],
            registers.r[1],
            registers.r[2],
            registers.r[3],
            registers.r[12],
            registers.r[14],
            return_address,
            registers.xpsr() & !(1 << 9) | u32::from(padded) << 9,
        ];
        for (i, word) in words.into_iter().enumerate() {
            self.store(frame.wrapping_add(4 * i as u32), Unit::Word, word)?;
        }
        if with_float {
            if self.bus.system.fpccr & LAZY == 0 {
                self.cycles += 17;
                self.store_float(frame.wrapping_add(0x20))?;
            } else {
                let thread = !self.registers.handler_mode();
                let user = !self.registers.privileged();
                let keep = self.bus.system.fpccr & (AUTOMATIC | LAZY);
                self.bus.system.fpccr = keep | LAZY_ACTIVE | u32::from(user) << 1 | u32::from(thread) << 3;
                self.bus.system.fpcar = frame.wrapping_add(0x20);
            }
        }
        Ok(())
    }

    fn store_float(&mut self, address: u32) -> Result<(), Trap> {
        for i in 0..16 {
            let word = self.registers.single(i);
            self.store(address.wrapping_add(4 * u32::from(i)), Unit::Word, word)?;
        }
        self.store(address.wrapping_add(0x40), Unit::Word, self.registers.fpscr)
    }

    /// Completes lazy stacking, at the first floating-point instruction of a handler.
    pub(crate) fn save_float_lazily(&mut self) -> Result<(), Trap> {
        self.cycles += 17;
        self.store_float(self.bus.system.fpcar)?;
        self.bus.system.fpccr &= !LAZY_ACTIVE;
        Ok(())
    }

    /// An interworking branch: to an address with the Thumb bit set or, in a handler, to EXC_RETURN.
    pub(crate) fn interwork(&mut self, target: u32) -> Result<(), Trap> {
        if self.registers.handler_mode() && target >> 28 == 15 {
            return self.exception_return(target);
        }
        if target & 1 == 0 {
            return Err(ProcessorFault::InvalidState.into());
        }
        self.branch(target & !1);
        Ok(())
    }

    fn exception_return(&mut self, code: u32) -> Result<(), Trap> {
        let ending = usize::from(self.registers.ipsr);
        let to_handler = code & 0xf == 1;
        let to_process = code & 0xf == 13;
        let nested = (0..113).filter(|&e| self.bus.system.nvic.active.has(e)).count() > 1;
        if code & 0x0fff_ffe0 != 0x0fff_ffe0
            || !matches!(code & 0xf, 1 | 9 | 13)
            || to_handler != nested
            || !self.bus.system.nvic.active.has(ending)
        {
            return Err(Violation::Unpredictable(code).into());
        }
        self.bus.system.nvic.deactivate(ending);
        if ending != nvic::NMI {
            self.registers.faultmask = false;
        }
        self.cycles += RETURN_CYCLES - 1;
        // Tail-chaining: the next handler reuses the stacked frame.
        let next = self.bus.system.nvic.most_urgent();
        if let Some((next, _)) = next.filter(|&(_, priority)| priority < self.executing_priority()) {
            self.cycles = TAIL_CHAIN_CYCLES;
            self.start_handler(next, code)?;
            self.next = self.registers.pc;
            return Ok(());
        }
        self.pop_frame(code, to_process)
    }

    fn pop_frame(&mut self, code: u32, to_process: bool) -> Result<(), Trap> {
        if to_process {
            std::mem::swap(&mut self.registers.r[13], &mut self.registers.other_sp);
        }
        let frame = self.registers.r[13];
        let mut words = [0; 8];
        for (i, word) in words.iter_mut().enumerate() {
            *word = self.load(frame.wrapping_add(4 * i as u32), Unit::Word)?;
        }
        let with_float = code & 0x10 == 0;
        if with_float {
            if self.bus.system.fpccr & LAZY_ACTIVE != 0 {
                self.bus.system.fpccr &= !LAZY_ACTIVE;
            } else {
                self.cycles += 17;
                for i in 0..16 {
                    let address = frame.wrapping_add(0x20 + 4 * u32::from(i));
                    let word = self.load(address, Unit::Word)?;
                    self.registers.set_single(i, word);
                }
                self.registers.fpscr = self.load(frame.wrapping_add(0x60), Unit::Word)?;
            }
        }
        let registers = &mut self.registers;
        registers.float_active = with_float;
        registers.r[0..4].copy_from_slice(&words[0..4]);
        registers.r[12] = words[4];
        registers.r[14] = words[5];
        registers.set_xpsr(words[7]);
        registers.process_stack = if code & 0xf == 1 { registers.process_stack } else { to_process };
        let size = if with_float { 0x68 } else { 0x20 };
        registers.r[13] = frame.wrapping_add(size) | (words[7] >> 9 & 1) << 2;
        self.next = words[6] & !1;
        self.bus.system.nvic.changed = true;
        Ok(())
    }

    /// Takes the exception of the instruction at the program counter: SVC returns after it, a fault returns to it.
    pub(crate) fn fault(&mut self, fault: ProcessorFault) -> Result<(), Violation> {
        let pc = self.registers.pc;
        if let ProcessorFault::Supervisor = fault {
            return self.synchronous(nvic::SV_CALL, pc.wrapping_add(2));
        }
        let exception = self.record(fault);
        self.synchronous(exception, pc)
    }

    /// Sets the fault status and address registers (B3.2.15 to B3.2.18); returns the fault's exception.
    fn record(&mut self, fault: ProcessorFault) -> usize {
        let system = &mut self.bus.system;
        let (exception, bits) = match fault {
            ProcessorFault::MemoryInstruction => (nvic::MEM_MANAGE, 1),
            ProcessorFault::MemoryData(address) => {
                system.mmfar = address;
                (nvic::MEM_MANAGE, 1 << 7 | 1 << 1)
            }
            ProcessorFault::Bus(address) => {
                system.bfar = address;
                (nvic::BUS_FAULT, 1 << 15 | 1 << 9)
            }
            ProcessorFault::UndefinedInstruction => (nvic::USAGE_FAULT, 1 << 16),
            ProcessorFault::InvalidState => (nvic::USAGE_FAULT, 1 << 17),
            ProcessorFault::NoCoprocessor => (nvic::USAGE_FAULT, 1 << 19),
            ProcessorFault::Unaligned => (nvic::USAGE_FAULT, 1 << 24),
            ProcessorFault::Supervisor => (nvic::SV_CALL, 0),
        };
        system.cfsr |= bits;
        exception
    }

    /// A synchronous exception: if it is disabled or cannot preempt, it escalates to HardFault; if that cannot preempt
    /// either, the core locks up.
    fn synchronous(&mut self, exception: usize, return_address: u32) -> Result<(), Violation> {
        let executing = self.executing_priority();
        let system = &mut self.bus.system;
        let comes = system.nvic.enabled.has(exception) && system.nvic.preemption(exception) < executing;
        let exception = if comes {
            exception
        } else if executing > -1 {
            system.hfsr |= 1 << 30;
            nvic::HARD_FAULT
        } else {
            self.locked_up = true;
            return Ok(());
        };
        self.enter(exception, return_address)
    }

    /// A derived fault: one that occurs while a frame is stacked.
    fn derived(&mut self, fault: ProcessorFault, bit: u32) -> Result<(), Violation> {
        self.bus.system.cfsr |= bit;
        // HardFault and NMI are entered without a frame: no fault can preempt them, and this is no lock-up.
        if matches!(usize::from(self.registers.ipsr), nvic::NMI | nvic::HARD_FAULT) {
            return Ok(());
        }
        let exception = match fault {
            ProcessorFault::MemoryData(_) => nvic::MEM_MANAGE,
            _ => nvic::BUS_FAULT,
        };
        let executing = self.executing_priority();
        let system = &mut self.bus.system;
        let comes = system.nvic.enabled.has(exception) && system.nvic.preemption(exception) < executing;
        let exception = if comes {
            exception
        } else {
            system.hfsr |= 1 << 30;
            nvic::HARD_FAULT
        };
        let code = self.registers.r[14];
        self.start_handler(exception, code)
    }
}
