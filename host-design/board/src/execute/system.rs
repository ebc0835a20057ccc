//! Calls and returns, IT, barriers, masks, special registers, and waiting for interrupts and events.

use crate::error::{Done, ProcessorFault, Violation};
use crate::instruction::{Op, Special};
use crate::machine::Microcontroller;

impl Microcontroller {
    pub(super) fn system(&mut self, op: Op) -> Done {
        match op {
            Op::Nop => {}
            Op::Call { target } => {
                self.registers.set(14, self.next | 1);
                self.branch(target);
            }
            Op::BranchTo { rm } => {
                let target = self.registers.get(rm);
                return self.interwork(target);
            }
            Op::CallTo { rm } => {
                let target = self.registers.get(rm);
                if target & 1 == 0 {
                    return Err(ProcessorFault::InvalidState.into());
                }
                self.registers.set(14, self.next | 1);
                self.branch(target & !1);
            }
            Op::It(it) => self.registers.it = it,
            Op::SyncData => {
                self.cycles += 1;
                self.bus.writes_are_through();
            }
            Op::Barrier => self.cycles += 1,
            Op::ClearExclusive => self.exclusive = false,
            Op::WaitForInterrupt => self.asleep = true,
            Op::WaitForEvent => self.asleep = !std::mem::take(&mut self.event),
            Op::SendEvent => self.event = true,
            Op::Svc => return Err(ProcessorFault::Supervisor.into()),
            Op::Breakpoint | Op::Undefined => {
                return if self.bus.rules.faults_are_taken {
                    Err(ProcessorFault::UndefinedInstruction.into())
                } else {
                    Err(Violation::Trap.into())
                };
            }
            Op::ChangeMasks { disable, primask, faultmask } if self.registers.privileged() => {
                self.registers.primask = if primask { disable } else { self.registers.primask };
                if faultmask && (!disable || self.executing_priority() > -1) {
                    self.registers.faultmask = disable;
                }
                self.bus.system.nvic.changed = true;
            }
            Op::ChangeMasks { .. } => {}
            Op::ReadSpecial { rd, special } => {
                self.cycles += 1;
                let value = self.read_special(special);
                self.registers.set(rd, value);
            }
            Op::WriteSpecial { rn, special, mask } => {
                self.cycles += 1;
                let value = self.registers.get(rn);
                self.write_special(special, mask, value);
            }
            _ => unreachable!("only these are sent here"),
        }
        Ok(())
    }

    fn read_special(&self, special: Special) -> u32 {
        let registers = &self.registers;
        let privileged = registers.privileged();
        let if_privileged = |value| if privileged { value } else { 0 };
        let (main, process) = if registers.uses_process_stack() {
            (registers.other_sp, registers.r[13])
        } else {
            (registers.r[13], registers.other_sp)
        };
        match special {
            Special::Psr(which) => {
                let flags = if which & 4 == 0 { registers.apsr() } else { 0 };
                let number = if which & 1 != 0 { if_privileged(registers.ipsr.into()) } else { 0 };
                flags | number
            }
            Special::Msp => if_privileged(main),
            Special::Psp => if_privileged(process),
            Special::Primask => if_privileged(registers.primask.into()),
            Special::Basepri | Special::BasepriMax => if_privileged(registers.basepri.into()),
            Special::Faultmask => if_privileged(registers.faultmask.into()),
            Special::Control => {
                u32::from(registers.float_active) << 2
                    | u32::from(registers.process_stack) << 1
                    | u32::from(registers.unprivileged)
            }
        }
    }

    fn write_special(&mut self, special: Special, mask: u8, value: u32) {
        let executing = self.executing_priority();
        let registers = &mut self.registers;
        if let Special::Psr(which) = special {
            if which & 4 == 0 {
                if mask & 2 != 0 {
                    registers.set_flags(value);
                    registers.q = value & 1 << 27 != 0;
                }
                if mask & 1 != 0 {
                    registers.ge = (value >> 16 & 15) as u8;
                }
            }
            return;
        }
        if !registers.privileged() {
            return;
        }
        let process = registers.uses_process_stack();
        match special {
            Special::Msp if process => registers.other_sp = value & !3,
            Special::Psp if !process => registers.other_sp = value & !3,
            Special::Msp | Special::Psp => registers.r[13] = value & !3,
            Special::Primask => registers.primask = value & 1 != 0,
            Special::Basepri => registers.basepri = value as u8 & 0xf0,
            Special::BasepriMax => {
                let new = value as u8 & 0xf0;
                if new != 0 && (new < registers.basepri || registers.basepri == 0) {
                    registers.basepri = new;
                }
            }
            Special::Faultmask if executing > -1 => registers.faultmask = value & 1 != 0,
            Special::Faultmask | Special::Psr(_) => {}
            Special::Control => {
                registers.unprivileged = value & 1 != 0;
                registers.float_active = value & 4 != 0;
                if !registers.handler_mode() {
                    let wants = value & 2 != 0;
                    if wants != registers.process_stack {
                        std::mem::swap(&mut registers.r[13], &mut registers.other_sp);
                    }
                    registers.process_stack = wants;
                }
            }
        }
        self.bus.system.nvic.changed = true;
    }
}
