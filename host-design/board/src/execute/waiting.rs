//! Skipping of waiting loops, without changing any result.
//!
//! A loop that stores nothing, reads nothing that changes before the next deadline, and ends each iteration with the
//! same registers repeats until that deadline. One register may count down by a constant per iteration, if the loop
//! uses it in one subtraction of that constant only: then the flags stay the same until it comes near zero.

use crate::clock::Time;
use crate::instruction::{Alu, Op, Operand};
use crate::machine::Microcontroller;
use crate::processor::registers::Registers;

/// Number of iterations that may be skipped, and the register that counts them down, with its step.
type Skip = (u64, Option<(usize, u32)>);

/// Longest loop that is considered (instructions).
const LONGEST: u64 = 32;

impl Microcontroller {
    /// Called after a backward branch, with the program counter at the loop's head.
    pub(crate) fn skip_waiting(&mut self, end: Time) {
        let head = self.registers.pc;
        let (now, executed) = (self.bus.now, self.executed);
        let quiet = !std::mem::take(&mut self.watch.stored)
            & !std::mem::take(&mut self.bus.unstable)
            & !std::mem::take(&mut self.bus.touched);
        let same_loop = self.watch.head == head && quiet;
        self.watch.head = head;
        let turn = match &self.watch.since {
            Some((_, since, count)) if same_loop && executed - count <= LONGEST => {
                Some((now - since, executed - count))
            }
            _ => None,
        };
        let repeats = turn.is_some() && turn == self.watch.turn;
        self.watch.turn = turn;
        if repeats {
            let limit = self.turns_without_change(self.bus.pc);
            if let (Some(limit), Some((span, count))) = (limit, turn) {
                self.skip(end, span, count, limit);
            }
        }
        {
            let (now, executed) = (self.bus.now, self.executed);
            match &mut self.watch.since {
                Some((registers, since, count)) => {
                    (**registers).clone_from(&self.registers);
                    (*since, *count) = (now, executed);
                }
                None => self.watch.since = Some((Box::new(self.registers.clone()), now, executed)),
            }
        }
    }

    /// How many iterations may be skipped, and which register counts them; `None` if this is not a waiting loop.
    fn turns_without_change(&mut self, last: u32) -> Option<Skip> {
        let before = &self.watch.since.as_ref()?.0;
        let mut counter = None;
        for i in 0..15 {
            if before.r[i] != self.registers.r[i] {
                if counter.is_some() {
                    return None;
                }
                counter = Some((i, before.r[i].wrapping_sub(self.registers.r[i])));
            }
        }
        let mut without = Registers::clone(before);
        (without.r, without.pc) = (self.registers.r, self.registers.pc);
        if without != self.registers {
            return None;
        }
        let Some((counter, step)) = counter else { return Some((u64::MAX, None)) };
        let (head, left) = (self.registers.pc, self.registers.r[counter]);
        if !self.only_counts(head, last, counter as u8, step) || left >= 1 << 31 {
            return None;
        }
        let turns = u64::from(left / step).saturating_sub(3);
        Some((turns, Some((counter, step))))
    }

    /// Whether the code from `head` to `last` uses a register in one `subs r, r, #step` only.
    fn only_counts(&mut self, head: u32, last: u32, counter: u8, step: u32) -> bool {
        let mut pc = head;
        let mut seen = 0;
        while pc <= last {
            let Ok(instruction) = self.instruction(pc) else { return false };
            pc += u32::from(instruction.length);
            let plain = match instruction.op {
                Op::Alu { alu: Alu::Sub, rd, rn, operand: Operand::Constant(constant), .. }
                    if rd == counter && rn == counter && constant == step =>
                {
                    seen += 1;
                    true
                }
                Op::Load { rt, rn, place: crate::instruction::Addressing::Offset(_), .. } => {
                    rt != counter && rn != counter
                }
                Op::Alu { rd, rn, operand, .. } => rd != counter && rn != counter && !uses(operand, counter),
                Op::Compare { rn, operand, .. } => rn != counter && !uses(operand, counter),
                Op::Branch { .. } | Op::BranchIf { .. } | Op::Nop | Op::It(_) => true,
                Op::BranchZero { rn, .. } => rn != counter,
                Op::MoveTop { rd, .. } => rd != counter,
                _ => false,
            };
            if !plain {
                return false;
            }
        }
        seen == 1
    }

    fn skip(&mut self, end: Time, span: Time, count: u64, (limit, counter): Skip) {
        let until = self.bus.deadline.min(end);
        // The iteration in which the deadline falls is executed.
        let turns = ((until - self.bus.now) / span).saturating_sub(1).min(limit);
        self.bus.now += turns * span;
        self.executed += turns * count;
        self.skipped += turns * count;
        if let Some((counter, step)) = counter {
            self.registers.r[counter] -= turns as u32 * step;
        }
    }
}

fn uses(operand: Operand, register: u8) -> bool {
    match operand {
        Operand::Constant(_) | Operand::Rotated(_) => false,
        Operand::Register(r) | Operand::Shifted { register: r, .. } => r == register,
    }
}
