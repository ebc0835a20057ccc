//! 16-bit instructions (A5.2).

use super::field::{Decoded, Undecodable, fixed, general, signed};
use crate::instruction::{Addressing, Alu, Compare, Extend, Op, Operand, Sets, Shift, Unary, Unit};

fn low(code: u32, at: u32) -> u8 {
    (code >> at & 7) as u8
}

pub(super) fn decode(code: u32, address: u32) -> Decoded {
    match code >> 10 {
        0x00..=0x0f => shift_add_move(code),
        0x10 => data_processing(code),
        0x11 => special(code),
        0x12 | 0x13 => {
            let address = (address.wrapping_add(4) & !3).wrapping_add((code & 0xff) * 4);
            Ok(Op::LoadLiteral { unit: Unit::Word, rt: low(code, 8), address })
        }
        0x14..=0x17 => Ok(by_register(code)),
        0x18..=0x27 => Ok(by_offset(code)),
        0x28 | 0x29 => {
            let value = (address.wrapping_add(4) & !3).wrapping_add((code & 0xff) * 4);
            Ok(alu(Alu::Mov, Sets::Never, low(code, 8), 15, Operand::Constant(value)))
        }
        0x2a | 0x2b => Ok(alu(Alu::Add, Sets::Never, low(code, 8), 13, Operand::Constant((code & 0xff) * 4))),
        0x2c..=0x2f => miscellaneous(code, address),
        0x30..=0x33 => multiple(code),
        0x34..=0x37 => conditional(code, address),
        _ => {
            let target = address.wrapping_add(4).wrapping_add_signed(signed((code & 0x7ff) << 1, 12));
            Ok(Op::Branch { target })
        }
    }
}

fn alu(alu: Alu, sets: Sets, rd: u8, rn: u8, operand: Operand) -> Op {
    Op::Alu { alu, sets, rd, rn, operand }
}

fn shift_add_move(code: u32) -> Decoded {
    let amount = (code >> 6 & 31) as u8;
    let shifted = |shift, amount| Operand::Shifted { register: low(code, 3), shift, amount };
    let constant = Operand::Constant(code & 0xff);
    let sets = Sets::OutsideIt;
    Ok(match code >> 9 {
        0x00..=0x03 if amount == 0 => alu(Alu::Mov, sets, low(code, 0), 15, Operand::Register(low(code, 3))),
        0x00..=0x03 => alu(Alu::Mov, sets, low(code, 0), 15, shifted(Shift::Lsl, amount)),
        0x04..=0x07 => {
            alu(Alu::Mov, sets, low(code, 0), 15, shifted(Shift::Lsr, if amount == 0 { 32 } else { amount }))
        }
        0x08..=0x0b => {
            alu(Alu::Mov, sets, low(code, 0), 15, shifted(Shift::Asr, if amount == 0 { 32 } else { amount }))
        }
        0x0c => alu(Alu::Add, sets, low(code, 0), low(code, 3), Operand::Register(low(code, 6))),
        0x0d => alu(Alu::Sub, sets, low(code, 0), low(code, 3), Operand::Register(low(code, 6))),
        0x0e => alu(Alu::Add, sets, low(code, 0), low(code, 3), Operand::Constant(code >> 6 & 7)),
        0x0f => alu(Alu::Sub, sets, low(code, 0), low(code, 3), Operand::Constant(code >> 6 & 7)),
        0x10..=0x13 => alu(Alu::Mov, sets, low(code, 8), 15, constant),
        0x14..=0x17 => Op::Compare { compare: Compare::Cmp, rn: low(code, 8), operand: constant },
        0x18..=0x1b => alu(Alu::Add, sets, low(code, 8), low(code, 8), constant),
        _ => alu(Alu::Sub, sets, low(code, 8), low(code, 8), constant),
    })
}

fn data_processing(code: u32) -> Decoded {
    let (rd, rm) = (low(code, 0), low(code, 3));
    let sets = Sets::OutsideIt;
    let of = |kind| alu(kind, sets, rd, rd, Operand::Register(rm));
    let shift_by = |shift| Op::ShiftBy { shift, sets, rd, rn: rd, rm };
    let compare = |compare| Op::Compare { compare, rn: rd, operand: Operand::Register(rm) };
    Ok(match code >> 6 & 15 {
        0 => of(Alu::And),
        1 => of(Alu::Eor),
        2 => shift_by(Shift::Lsl),
        3 => shift_by(Shift::Lsr),
        4 => shift_by(Shift::Asr),
        5 => of(Alu::Adc),
        6 => of(Alu::Sbc),
        7 => shift_by(Shift::Ror),
        8 => compare(Compare::Tst),
        9 => alu(Alu::Rsb, sets, rd, rm, Operand::Constant(0)),
        10 => compare(Compare::Cmp),
        11 => compare(Compare::Cmn),
        12 => of(Alu::Orr),
        13 => {
            let multiply = crate::instruction::Multiply::Low;
            Op::Multiply { multiply, sets, rd, rn: rm, rm: rd, ra: 15 }
        }
        14 => of(Alu::Bic),
        _ => alu(Alu::Mvn, sets, rd, 15, Operand::Register(rm)),
    })
}

fn special(code: u32) -> Decoded {
    let rd = (code & 7 | code >> 4 & 8) as u8;
    let rm = (code >> 3 & 15) as u8;
    let operand = Operand::Register(rm);
    match code >> 8 & 3 {
        0 => fixed(!(rd == 15 && rm == 15), alu(Alu::Add, Sets::Never, rd, rd, operand)),
        1 => {
            let allowed = rd != 15 && rm != 15 && (rd >= 8 || rm >= 8);
            fixed(allowed, Op::Compare { compare: Compare::Cmp, rn: rd, operand })
        }
        2 => Ok(alu(Alu::Mov, Sets::Never, rd, 15, operand)),
        _ if code & 7 != 0 => Err(Undecodable::Unpredictable),
        _ if code & 0x80 == 0 => fixed(rm != 15, Op::BranchTo { rm }),
        _ => fixed(rm != 15, Op::CallTo { rm }),
    }
}

fn by_register(code: u32) -> Op {
    let (rt, rn) = (low(code, 0), low(code, 3));
    let place = Addressing::Indexed { register: low(code, 6), shift: 0 };
    match code >> 9 & 7 {
        0 => Op::Store { unit: Unit::Word, rt, rn, place },
        1 => Op::Store { unit: Unit::Half, rt, rn, place },
        2 => Op::Store { unit: Unit::Byte, rt, rn, place },
        3 => Op::Load { unit: Unit::SignedByte, rt, rn, place },
        4 => Op::Load { unit: Unit::Word, rt, rn, place },
        5 => Op::Load { unit: Unit::Half, rt, rn, place },
        6 => Op::Load { unit: Unit::Byte, rt, rn, place },
        _ => Op::Load { unit: Unit::SignedHalf, rt, rn, place },
    }
}

fn by_offset(code: u32) -> Op {
    let (rt, rn) = (low(code, 0), low(code, 3));
    let offset = (code >> 6 & 31) as i32;
    let single = |unit, scale| (unit, rt, rn, Addressing::Offset(offset * scale));
    let (unit, rt, rn, place) = match code >> 12 {
        6 => single(Unit::Word, 4),
        7 => single(Unit::Byte, 1),
        8 => single(Unit::Half, 2),
        _ => (Unit::Word, low(code, 8), 13, Addressing::Offset((code & 0xff) as i32 * 4)),
    };
    if code & 0x800 == 0 { Op::Store { unit, rt, rn, place } } else { Op::Load { unit, rt, rn, place } }
}

fn miscellaneous(code: u32, address: u32) -> Decoded {
    let (rd, rm) = (low(code, 0), low(code, 3));
    let extend = |extend| Ok(Op::Extend { extend, rd, rn: 15, rm, rotate: 0 });
    let sp = |kind| Ok(alu(kind, Sets::Never, 13, 13, Operand::Constant((code & 0x7f) * 4)));
    match code >> 5 & 0x7f {
        0x00..=0x03 => sp(Alu::Add),
        0x04..=0x07 => sp(Alu::Sub),
        op if op & 0x28 == 0x08 => {
            let target = address.wrapping_add(4).wrapping_add((code >> 3 & 0x1f | code >> 4 & 0x20) << 1);
            Ok(Op::BranchZero { rn: rd, if_zero: code & 0x800 == 0, target })
        }
        0x10..=0x17 => extend(match code >> 6 & 3 {
            0 => Extend::SignedHalf,
            1 => Extend::SignedByte,
            2 => Extend::Half,
            _ => Extend::Byte,
        }),
        0x20..=0x2f => {
            let list = (code & 0xff | (code & 0x100) << 6) as u16;
            fixed(list != 0, Op::StoreMultiple { rn: 13, list, down: true, write_back: true })
        }
        0x33 => {
            let (primask, faultmask) = (code & 2 != 0, code & 1 != 0);
            let op = Op::ChangeMasks { disable: code & 0x10 != 0, primask, faultmask };
            fixed(code & 0x0c == 0 && (primask || faultmask), op)
        }
        0x50..=0x57 => {
            let unary = match code >> 6 & 3 {
                0 => Unary::Rev,
                1 => Unary::Rev16,
                3 => Unary::Revsh,
                _ => return Err(Undecodable::Unknown),
            };
            Ok(Op::Unary { unary, rd, rm })
        }
        0x60..=0x6f => {
            let list = (code & 0xff | (code & 0x100) << 7) as u16;
            fixed(list != 0, Op::LoadMultiple { rn: 13, list, down: false, write_back: true })
        }
        0x70..=0x77 => Ok(Op::Breakpoint),
        0x78..=0x7f if code & 15 != 0 => it(code),
        0x78..=0x7f => match code >> 4 & 15 {
            0 | 1 => Ok(Op::Nop), // NOP, YIELD
            2 => Ok(Op::WaitForEvent),
            3 => Ok(Op::WaitForInterrupt),
            4 => Ok(Op::SendEvent),
            _ => Err(Undecodable::Unknown),
        },
        _ => Err(Undecodable::Unknown),
    }
}

/// An IT block's condition may be "always" only without an else (A7.7.38).
fn it(code: u32) -> Decoded {
    let (condition, mask) = (code >> 4 & 15, code & 15);
    let allowed = condition != 15 && (condition != 14 || mask.count_ones() == 1);
    general(&[], Op::It((code & 0xff) as u8)).and_then(|op| fixed(allowed, op))
}

fn multiple(code: u32) -> Decoded {
    let (rn, list) = (low(code, 8), (code & 0xff) as u16);
    let has_base = list >> rn & 1 != 0;
    let op = if code & 0x800 == 0 {
        // The base may be stored only as the first register.
        if has_base && list.trailing_zeros() != u32::from(rn) {
            return Err(Undecodable::Unpredictable);
        }
        Op::StoreMultiple { rn, list, down: false, write_back: true }
    } else {
        Op::LoadMultiple { rn, list, down: false, write_back: !has_base }
    };
    fixed(list != 0, op)
}

fn conditional(code: u32, address: u32) -> Decoded {
    match code >> 8 & 15 {
        14 => Ok(Op::Undefined),
        15 => Ok(Op::Svc),
        condition => {
            let target = address.wrapping_add(4).wrapping_add_signed(signed((code & 0xff) << 1, 9));
            Ok(Op::BranchIf { condition: condition as u8, target })
        }
    }
}
