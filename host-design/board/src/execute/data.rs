//! Data processing.

use super::arithmetic::{add_with_carry, shifted};
use crate::error::Done;
use crate::instruction::{Alu, Compare, Extend, Op, Operand, Sets, Unary};
use crate::machine::Microcontroller;

impl Microcontroller {
    /// Value of an operand, and the carry out of the barrel shifter.
    #[inline]
    fn operand(&self, operand: Operand) -> (u32, bool) {
        let carry = self.registers.c;
        match operand {
            Operand::Constant(value) => (value, carry),
            Operand::Rotated(value) => (value, value >> 31 != 0),
            Operand::Register(register) => (self.registers.get(register), carry),
            Operand::Shifted { register, shift, amount } => {
                shifted(self.registers.get(register), shift, amount.into(), carry)
            }
        }
    }

    #[inline]
    pub(super) fn sets(&self, sets: Sets) -> bool {
        match sets {
            Sets::Never => false,
            Sets::Always => true,
            Sets::OutsideIt => !self.in_it,
        }
    }

    #[inline]
    pub(super) fn alu(&mut self, alu: Alu, sets: Sets, rd: u8, rn: u8, operand: Operand) -> Done {
        let (y, shifter) = self.operand(operand);
        let x = self.registers.get(rn);
        let (c, v) = (self.registers.c, self.registers.v);
        let (value, carry, overflow) = match alu {
            Alu::And => (x & y, shifter, v),
            Alu::Bic => (x & !y, shifter, v),
            Alu::Orr => (x | y, shifter, v),
            Alu::Orn => (x | !y, shifter, v),
            Alu::Eor => (x ^ y, shifter, v),
            Alu::Mov => (y, shifter, v),
            Alu::Mvn => (!y, shifter, v),
            Alu::Add => add_with_carry(x, y, false),
            Alu::Adc => add_with_carry(x, y, c),
            Alu::Sub => add_with_carry(x, !y, true),
            Alu::Sbc => add_with_carry(x, !y, c),
            Alu::Rsb => add_with_carry(!x, y, true),
        };
        if self.sets(sets) {
            self.registers.n = value >> 31 != 0;
            self.registers.z = value == 0;
            self.registers.c = carry;
            self.registers.v = overflow;
        }
        if rd == 15 {
            // ADD and MOV to the program counter branch and ignore bit 0.
            self.branch(value & !1);
        } else {
            self.registers.set(rd, value);
        }
        Ok(())
    }

    #[inline]
    pub(super) fn compare(&mut self, compare: Compare, rn: u8, operand: Operand) {
        let (y, shifter) = self.operand(operand);
        let x = self.registers.get(rn);
        let (value, carry, overflow) = match compare {
            Compare::Tst => (x & y, shifter, self.registers.v),
            Compare::Teq => (x ^ y, shifter, self.registers.v),
            Compare::Cmp => add_with_carry(x, !y, true),
            Compare::Cmn => add_with_carry(x, y, false),
        };
        self.registers.n = value >> 31 != 0;
        self.registers.z = value == 0;
        self.registers.c = carry;
        self.registers.v = overflow;
    }

    pub(super) fn data(&mut self, op: Op) -> Done {
        let registers = &mut self.registers;
        match op {
            Op::ShiftBy { shift, sets, rd, rn, rm } => {
                let amount = registers.get(rm) & 0xff;
                let (value, carry) = shifted(registers.get(rn), shift, amount, registers.c);
                registers.set(rd, value);
                if self.sets(sets) {
                    self.registers.n = value >> 31 != 0;
                    self.registers.z = value == 0;
                    self.registers.c = carry;
                }
            }
            Op::MoveTop { rd, value } => {
                let value = registers.get(rd) & 0xffff | u32::from(value) << 16;
                registers.set(rd, value);
            }
            Op::InsertField { rd, rn, lsb, width } => {
                let mask = (u32::MAX >> (32 - width)) << lsb;
                let source = if rn == 15 { 0 } else { registers.get(rn) };
                let value = registers.get(rd) & !mask | source << lsb & mask;
                registers.set(rd, value);
            }
            Op::ExtractField { signed, rd, rn, lsb, width } => {
                let value = registers.get(rn) << (32 - lsb - width);
                let right = 32 - width;
                registers.set(rd, if signed { ((value as i32) >> right) as u32 } else { value >> right });
            }
            Op::Extend { extend, rd, rn, rm, rotate } => {
                let base = if rn == 15 { 0 } else { registers.get(rn) };
                let value = extended(extend, base, registers.get(rm).rotate_right(rotate.into()));
                registers.set(rd, value);
            }
            Op::PackHalves { rd, rn, rm, top_first, amount } => {
                let (x, y) = (registers.get(rn), registers.get(rm));
                let value = if top_first {
                    x & 0xffff_0000 | (i64::from(y as i32) >> amount) as u32 & 0xffff
                } else {
                    x & 0xffff | y << amount & 0xffff_0000
                };
                registers.set(rd, value);
            }
            Op::Unary { unary, rd, rm } => {
                let x = registers.get(rm);
                let value = match unary {
                    Unary::Rev => x.swap_bytes(),
                    Unary::Rev16 => x.swap_bytes().rotate_right(16),
                    Unary::Revsh => (x as u16).swap_bytes() as i16 as u32,
                    Unary::Rbit => x.reverse_bits(),
                    Unary::Clz => x.leading_zeros(),
                };
                registers.set(rd, value);
            }
            _ => unreachable!("only these are sent here"),
        }
        Ok(())
    }
}

fn extended(extend: Extend, base: u32, x: u32) -> u32 {
    let halves =
        |low: u32, high: u32| base.wrapping_add(low) & 0xffff | (base >> 16).wrapping_add(high) << 16;
    match extend {
        Extend::SignedByte => base.wrapping_add(x as i8 as u32),
        Extend::SignedHalf => base.wrapping_add(x as i16 as u32),
        Extend::Byte => base.wrapping_add(x & 0xff),
        Extend::Half => base.wrapping_add(x & 0xffff),
        Extend::SignedBytes => halves(x as i8 as u32, (x >> 16) as i8 as u32),
        Extend::Bytes => halves(x & 0xff, x >> 16 & 0xff),
    }
}
