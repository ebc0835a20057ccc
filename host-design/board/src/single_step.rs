//! Execution of single instructions from given states, for comparison with another emulator.

use crate::bus::{Bus, Conditions};
use crate::error::{Rules, Stopped};
use crate::machine::Microcontroller;

/// The registers that are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoreState {
    /// R0 to R14 and the program counter.
    pub r: [u32; 16],
    /// Flags N, Z, C, V, Q (bits 31 to 27) and GE (19 to 16).
    pub apsr: u32,
    /// Single-precision registers S0 to S31, as bits.
    pub s: [u32; 32],
    /// FPSCR.
    pub fpscr: u32,
}

/// A processor without program in flash, which executes what is written to SRAM.
#[derive(Debug)]
pub struct Stepper {
    machine: Microcontroller,
}

impl Default for Stepper {
    fn default() -> Self {
        Self::new()
    }
}

impl Stepper {
    /// With the floating-point unit enabled, and unaligned accesses of one register allowed.
    pub fn new() -> Self {
        let mut bus = Bus::new(&Conditions::f405(1), Rules::NOTED, &[]);
        // CPACR: full access to the floating-point unit.
        let _ = bus.system.write(0xe000_ed88, 0x00f0_0000, 0, 1);
        bus.rules = Rules::NOTED;
        Self { machine: Microcontroller::new(bus, 0) }
    }

    /// Writes bytes to memory.
    pub fn write(&mut self, address: u32, bytes: &[u8]) {
        for (i, &byte) in (0..).zip(bytes) {
            self.machine.bus.write_memory(address + i, crate::instruction::Unit::Byte, byte.into());
        }
    }

    /// Reads `length` bytes of memory.
    pub fn read(&self, address: u32, length: u32) -> Vec<u8> {
        (0..length)
            .map(|i| {
                self.machine.bus.read_memory(address + i, crate::instruction::Unit::Byte).unwrap_or(0) as u8
            })
            .collect()
    }

    /// Executes `count` instructions from a state; returns the state after them.
    ///
    /// # Errors
    /// [`Stopped`] at a violation that ends the run of a board.
    pub fn run(&mut self, state: &CoreState, count: u32) -> Result<CoreState, Stopped> {
        let machine = &mut self.machine;
        machine.bus.notes.clear();
        machine.asleep = false;
        let registers = &mut machine.registers;
        registers.r = state.r;
        registers.pc = state.r[15] & !1;
        registers.set_xpsr(state.apsr | 1 << 24);
        registers.s = state.s;
        registers.fpscr = state.fpscr;
        registers.float_active = true;
        machine.bus.system.fpccr = 0;
        machine.bus.system.nvic = crate::processor::nvic::Nvic::new();
        machine.bus.system.nvic.changed = false;
        for _ in 0..count {
            machine.run_until(machine.bus.now + 1)?;
        }
        let registers = &machine.registers;
        let mut r = registers.r;
        r[15] = registers.pc;
        Ok(CoreState { r, apsr: registers.apsr(), s: registers.s, fpscr: registers.fpscr })
    }
}
