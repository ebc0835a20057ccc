//! Execution of instructions (ARMv7-M Architecture Reference Manual, A7.7), and their cycles.
//!
//! Cycles follow the table of the Cortex-M4 Technical Reference Manual (DDI 0439, 3.3), with single-cycle stores (the
//! write buffer), two cycles for refilling the pipeline, and the flash accelerator of
//! [`crate::processor::flash_cache`]. They are approximate: see [`crate::timing`].

mod arithmetic;
mod data;
mod exception;
mod float;
mod float_arithmetic;
mod memory;
mod multiply;
mod parallel;
mod run;
mod system;
mod waiting;

use crate::error::Done;
use crate::instruction::Op;
use crate::machine::Microcontroller;

impl Microcontroller {
    /// Executes one instruction whose IT condition, if any, holds.
    #[inline]
    pub(crate) fn execute(&mut self, op: Op) -> Done {
        let loaded = std::mem::take(&mut self.loaded);
        match op {
            Op::Alu { alu, sets, rd, rn, operand } => self.alu(alu, sets, rd, rn, operand),
            Op::Compare { compare, rn, operand } => {
                self.compare(compare, rn, operand);
                Ok(())
            }
            Op::Branch { target } => {
                self.branch(target);
                Ok(())
            }
            Op::BranchIf { condition, target } => {
                if self.registers.holds(condition) {
                    self.branch(target);
                }
                Ok(())
            }
            Op::BranchZero { rn, if_zero, target } => {
                if (self.registers.get(rn) == 0) == if_zero {
                    self.branch(target);
                }
                Ok(())
            }
            Op::Load { unit, rt, rn, place } => self.load_single(unit, rt, rn, place, loaded),
            Op::Store { unit, rt, rn, place } => self.store_single(unit, rt, rn, place),
            Op::LoadLiteral { unit, rt, address } => {
                self.cycles += u32::from(!loaded);
                let value = self.load(address, unit)?;
                self.loaded = self.may_overlap(loaded);
                self.load_into(rt, value)
            }
            _ if op.is_float() => self.float(op),
            Op::LoadDual { .. }
            | Op::StoreDual { .. }
            | Op::LoadMultiple { .. }
            | Op::StoreMultiple { .. }
            | Op::LoadExclusive { .. }
            | Op::StoreExclusive { .. }
            | Op::TableBranch { .. } => self.memory(op),
            Op::Multiply { .. } | Op::LongMultiply { .. } | Op::Divide { .. } => self.multiply(op),
            Op::Parallel { .. }
            | Op::SaturatingSum { .. }
            | Op::Select { .. }
            | Op::AbsoluteDifferences { .. }
            | Op::Saturate { .. }
            | Op::SaturateHalves { .. } => self.parallel(op),
            Op::ShiftBy { .. }
            | Op::MoveTop { .. }
            | Op::InsertField { .. }
            | Op::ExtractField { .. }
            | Op::Extend { .. }
            | Op::PackHalves { .. }
            | Op::Unary { .. } => self.data(op),
            _ => self.system(op),
        }
    }

    /// Branches; costs a refill of the pipeline and the flash's wait states.
    #[inline]
    pub(crate) fn branch(&mut self, target: u32) {
        self.next = target;
        self.cycles += 2 + self.bus.instruction_wait(target);
    }
}
