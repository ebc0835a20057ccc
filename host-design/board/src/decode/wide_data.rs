//! 32-bit instructions: data processing with constants and shifted registers, branches and control (A5.3.1 to A5.3.4,
//! A5.3.11).

use super::field::{Decoded, Undecodable, fixed, general, register, signed};
use crate::instruction::{Alu, Compare, Op, Operand, Sets, Shift, Special};

/// Decodes a shift from its type and an amount of five bits (A7.4.2).
pub(super) fn shift(kind: u32, amount: u32) -> (Shift, u8) {
    match (kind & 3, amount as u8) {
        (0, amount) => (Shift::Lsl, amount),
        (1, 0) => (Shift::Lsr, 32),
        (1, amount) => (Shift::Lsr, amount),
        (2, 0) => (Shift::Asr, 32),
        (2, amount) => (Shift::Asr, amount),
        (_, 0) => (Shift::Rrx, 1),
        (_, amount) => (Shift::Ror, amount),
    }
}

/// Expands a modified immediate constant of twelve bits (A5.3.2).
fn expanded(bits: u32) -> Result<Operand, Undecodable> {
    let byte = bits & 0xff;
    let repeated =
        |value| if byte == 0 { Err(Undecodable::Unpredictable) } else { Ok(Operand::Constant(value)) };
    match bits >> 8 {
        0 => Ok(Operand::Constant(byte)),
        1 => repeated(byte << 16 | byte),
        2 => repeated(byte << 24 | byte << 8),
        3 => repeated(byte * 0x0101_0101),
        _ => Ok(Operand::Rotated((0x80 | bits & 0x7f).rotate_right(bits >> 7))),
    }
}

fn twelve_bits(first: u32, second: u32) -> u32 {
    (first & 0x400) << 1 | second >> 4 & 0x700 | second & 0xff
}

pub(super) fn modified_immediate(first: u32, second: u32) -> Decoded {
    let operand = expanded(twelve_bits(first, second))?;
    processing(first, register(second, 8), register(first, 0), operand, None)
}

pub(super) fn shifted_register(first: u32, second: u32) -> Decoded {
    let (rd, rn, rm) = (register(second, 8), register(first, 0), register(second, 0));
    let amount = second >> 10 & 0x1c | second >> 6 & 3;
    if second & 0x8000 != 0 {
        return Err(Undecodable::Unpredictable);
    }
    if first >> 5 & 15 == 0b0110 {
        if first & 0x10 != 0 || second & 0x10 != 0 {
            return Err(Undecodable::Unknown);
        }
        let (top_first, amount) = match (second >> 5 & 1 != 0, amount as u8) {
            (true, 0) => (true, 32),
            other => other,
        };
        return general(&[rd, rn, rm], Op::PackHalves { rd, rn, rm, top_first, amount });
    }
    let (kind, amount) = shift(second >> 4, amount);
    let operand = match (kind, amount) {
        (Shift::Lsl, 0) => Operand::Register(rm),
        _ => Operand::Shifted { register: rm, shift: kind, amount },
    };
    processing(first, rd, rn, operand, Some(rm))
}

/// Common to both forms; `rm` is the shifted register, if there is one.
fn processing(first: u32, rd: u8, rn: u8, operand: Operand, rm: Option<u8>) -> Decoded {
    let flags = first & 0x10 != 0;
    let sets = if flags { Sets::Always } else { Sets::Never };
    let bad = |r: u8| r == 13 || r == 15;
    let rm_bad = rm.is_some_and(bad);
    let compare = |compare, rn_may_be_sp: bool| {
        let allowed = rn != 15 && (rn != 13 || rn_may_be_sp) && !rm_bad;
        fixed(allowed, Op::Compare { compare, rn, operand })
    };
    let alu = |alu| fixed(!bad(rd) && !bad(rn) && !rm_bad, Op::Alu { alu, sets, rd, rn, operand });
    let without_first = |alu| fixed(!bad(rd) && !rm_bad, Op::Alu { alu, sets, rd, rn: 15, operand });
    let sum = |alu| {
        let small = match operand {
            Operand::Shifted { shift: Shift::Lsl, amount, .. } => amount <= 3,
            Operand::Shifted { .. } => false,
            _ => true,
        };
        let allowed = rn != 15 && !rm_bad && rd != 15 && (rd != 13 || (rn == 13 && small));
        fixed(allowed, Op::Alu { alu, sets, rd, rn, operand })
    };
    match first >> 5 & 15 {
        0b0000 if rd == 15 && flags => compare(Compare::Tst, false),
        0b0000 => alu(Alu::And),
        0b0001 => alu(Alu::Bic),
        0b0010 if rn == 15 => match (rm, operand) {
            // MOV.W between registers may use the stack pointer once, but not twice (A7.7.77).
            (Some(rm), Operand::Register(_)) if !flags => {
                let allowed = rd != 15 && rm != 15 && !(rd == 13 && rm == 13);
                fixed(allowed, Op::Alu { alu: Alu::Mov, sets, rd, rn: 15, operand })
            }
            _ => without_first(Alu::Mov),
        },
        0b0010 => alu(Alu::Orr),
        0b0011 if rn == 15 => without_first(Alu::Mvn),
        0b0011 => alu(Alu::Orn),
        0b0100 if rd == 15 && flags => compare(Compare::Teq, false),
        0b0100 => alu(Alu::Eor),
        0b1000 if rd == 15 && flags => compare(Compare::Cmn, true),
        0b1000 => sum(Alu::Add),
        0b1010 => alu(Alu::Adc),
        0b1011 => alu(Alu::Sbc),
        0b1101 if rd == 15 && flags => compare(Compare::Cmp, true),
        0b1101 => sum(Alu::Sub),
        0b1110 => alu(Alu::Rsb),
        _ => Err(Undecodable::Unknown),
    }
}

pub(super) fn plain_immediate(first: u32, second: u32, address: u32) -> Decoded {
    let (rd, rn) = (register(second, 8), register(first, 0));
    let constant = twelve_bits(first, second);
    let move_constant = |value| {
        let operand = Operand::Constant(value);
        general(&[rd], Op::Alu { alu: Alu::Mov, sets: Sets::Never, rd, rn: 15, operand })
    };
    let base = address.wrapping_add(4) & !3;
    let lsb = second >> 10 & 0x1c | second >> 6 & 3;
    let sum = |alu| {
        let op = Op::Alu { alu, sets: Sets::Never, rd, rn, operand: Operand::Constant(constant) };
        fixed(rd != 15 && (rd != 13 || rn == 13), op)
    };
    let saturate = |is_signed: bool| {
        let (kind, amount) = shift(first >> 4 & 2, lsb);
        let bits = (second & 31) as u8 + u8::from(is_signed);
        if first & 0x20 != 0 && lsb == 0 {
            let zero = second & 0x10 == 0;
            let bits = (second & 15) as u8 + u8::from(is_signed);
            let op = Op::SaturateHalves { signed: is_signed, rd, rn, bits };
            return fixed(zero, op).and_then(|op| general(&[rd, rn], op));
        }
        general(&[rd, rn], Op::Saturate { signed: is_signed, rd, rn, bits, shift: kind, amount })
    };
    // Bits 26 and 5 of the instruction are fixed to zero, except in the forms with a constant.
    let fields_fixed = first & 0x400 == 0 && second & 0x20 == 0;
    match first >> 4 & 31 {
        0b00000 if rn == 15 => move_constant(base.wrapping_add(constant)),
        0b00000 => sum(Alu::Add),
        0b01010 if rn == 15 => move_constant(base.wrapping_sub(constant)),
        0b01010 => sum(Alu::Sub),
        0b00100 => move_constant(constant | u32::from(rn) << 12),
        0b01100 => general(&[rd], Op::MoveTop { rd, value: (constant | u32::from(rn) << 12) as u16 }),
        0b10000 | 0b10010 if fields_fixed => saturate(true),
        0b11000 | 0b11010 if fields_fixed => saturate(false),
        kind @ (0b10100 | 0b11100) if fields_fixed => {
            let width = (second & 31) as u8 + 1;
            let op = Op::ExtractField { signed: kind == 0b10100, rd, rn, lsb: lsb as u8, width };
            fixed(lsb + u32::from(width) <= 32, op).and_then(|op| general(&[rd, rn], op))
        }
        0b10110 if fields_fixed => {
            let msb = second & 31;
            if msb < lsb || rn == 13 {
                return Err(Undecodable::Unpredictable);
            }
            let width = (msb - lsb) as u8 + 1;
            general(&[rd], Op::InsertField { rd, rn, lsb: lsb as u8, width })
        }
        _ => Err(Undecodable::Unknown),
    }
}

pub(super) fn branch_or_control(first: u32, second: u32, op: u32, address: u32) -> Decoded {
    match (second >> 12 & 7, op) {
        (0b101 | 0b111, _) => Ok(Op::Call { target: far_target(first, second, address) }),
        (0b001 | 0b011, _) => Ok(Op::Branch { target: far_target(first, second, address) }),
        (0b000 | 0b010, op) if op & 0x38 != 0x38 => {
            let offset = (first & 0x400) << 10 | (second & 0x800) << 8 | (second & 0x2000) << 5;
            let offset = signed(offset | (first & 0x3f) << 12 | (second & 0x7ff) << 1, 21);
            let target = address.wrapping_add(4).wrapping_add_signed(offset);
            Ok(Op::BranchIf { condition: (first >> 6 & 15) as u8, target })
        }
        (0b000, 0b011_1000 | 0b011_1001) => {
            let rn = register(first, 0);
            let mask = (second >> 10 & 3) as u8;
            let special = special(second & 0xff)?;
            let psr = matches!(special, Special::Psr(_));
            let allowed = second & 0x2300 == 0 && first & 0x10 == 0 && mask != 0 && (psr || mask == 2);
            fixed(allowed, Op::WriteSpecial { rn, special, mask }).and_then(|op| general(&[rn], op))
        }
        (0b000, 0b011_1010) => hint(first, second),
        (0b000, 0b011_1011) => {
            let should_be = first & 15 == 15 && second & 0x2f00 == 0x0f00;
            let option_fixed = |op| fixed(should_be, op);
            match second >> 4 & 15 {
                2 => option_fixed(Op::ClearExclusive),
                4 => option_fixed(Op::SyncData),
                5 | 6 => option_fixed(Op::Barrier),
                _ => Err(Undecodable::Unknown),
            }
        }
        (0b000, 0b011_1110 | 0b011_1111) => {
            let rd = register(second, 8);
            let op = Op::ReadSpecial { rd, special: special(second & 0xff)? };
            fixed(first & 0x1f == 15 && second & 0x2000 == 0, op).and_then(|op| general(&[rd], op))
        }
        (0b010, 0b111_1111) => Ok(Op::Undefined),
        _ => Err(Undecodable::Unknown),
    }
}

fn far_target(first: u32, second: u32, address: u32) -> u32 {
    let sign = first >> 10 & 1;
    let (i1, i2) = (!(second >> 13 ^ sign) & 1, !(second >> 11 ^ sign) & 1);
    let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | (second & 0x7ff) << 1;
    address.wrapping_add(4).wrapping_add_signed(signed(offset, 25))
}

fn hint(first: u32, second: u32) -> Decoded {
    if first & 15 != 15 || second & 0x2f00 != 0 {
        return Err(Undecodable::Unpredictable);
    }
    match second & 0xff {
        0 | 1 => Ok(Op::Nop),
        2 => Ok(Op::WaitForEvent),
        3 => Ok(Op::WaitForInterrupt),
        4 => Ok(Op::SendEvent),
        _ => Err(Undecodable::Unknown),
    }
}

fn special(number: u32) -> Result<Special, Undecodable> {
    Ok(match number {
        0..=3 | 5..=7 => Special::Psr(number as u8),
        8 => Special::Msp,
        9 => Special::Psp,
        16 => Special::Primask,
        17 => Special::Basepri,
        18 => Special::BasepriMax,
        19 => Special::Faultmask,
        20 => Special::Control,
        _ => return Err(Undecodable::Unpredictable),
    })
}
