//! 32-bit instructions: data processing on registers, multiplication and division (A5.3.12 to A5.3.17).

use super::field::{Decoded, Undecodable, fixed, general, register};
use crate::instruction::{Extend, LongMultiply, Multiply, Op, ParallelLanes, Prefix, Sets, Shift, Unary};

pub(super) fn decode(first: u32, second: u32) -> Decoded {
    let (rd, rn, rm) = (register(second, 8), register(first, 0), register(second, 0));
    if second & 0xf000 != 0xf000 {
        return Err(Undecodable::Unknown);
    }
    let top = second >> 4 & 15;
    match first >> 4 & 15 {
        op @ 0..=7 if top == 0 => {
            let shift = [Shift::Lsl, Shift::Lsr, Shift::Asr, Shift::Ror][(op >> 1) as usize];
            let sets = if op & 1 != 0 { Sets::Always } else { Sets::Never };
            general(&[rd, rn, rm], Op::ShiftBy { shift, sets, rd, rn, rm })
        }
        op @ 0..=5 if top & 8 != 0 => {
            let extend = [
                Extend::SignedHalf,
                Extend::Half,
                Extend::SignedBytes,
                Extend::Bytes,
                Extend::SignedByte,
                Extend::Byte,
            ][op as usize];
            let rotate = (second >> 4 & 3) as u8 * 8;
            let op = Op::Extend { extend, rd, rn, rm, rotate };
            fixed(second & 0x40 == 0 && rn != 13, op).and_then(|op| general(&[rd, rm], op))
        }
        op @ 8..=15 if top & 8 == 0 => parallel(op & 7, top, rd, rn, rm),
        op @ 8..=11 if top & 12 == 8 => miscellaneous(op & 3, top & 3, rd, rn, rm),
        _ => Err(Undecodable::Unknown),
    }
}

fn parallel(op: u32, top: u32, rd: u8, rn: u8, rm: u8) -> Decoded {
    let prefix = match top {
        0 => Prefix::Signed,
        1 => Prefix::SignedSaturating,
        2 => Prefix::SignedHalving,
        4 => Prefix::Unsigned,
        5 => Prefix::UnsignedSaturating,
        6 => Prefix::UnsignedHalving,
        _ => return Err(Undecodable::Unknown),
    };
    let lanes = match op {
        0 => ParallelLanes::Add8,
        1 => ParallelLanes::Add16,
        2 => ParallelLanes::AddSubExchanged,
        4 => ParallelLanes::Sub8,
        5 => ParallelLanes::Sub16,
        6 => ParallelLanes::SubAddExchanged,
        _ => return Err(Undecodable::Unknown),
    };
    general(&[rd, rn, rm], Op::Parallel { prefix, lanes, rd, rn, rm })
}

fn miscellaneous(op: u32, top: u32, rd: u8, rn: u8, rm: u8) -> Decoded {
    let unary = |unary| {
        // The encoding holds the operand register twice.
        fixed(rn == rm, Op::Unary { unary, rd, rm }).and_then(|op| general(&[rd, rm], op))
    };
    match (op, top) {
        (0, top) => {
            let op = Op::SaturatingSum { double: top & 1 != 0, subtract: top & 2 != 0, rd, rn, rm };
            general(&[rd, rn, rm], op)
        }
        (1, 0) => unary(Unary::Rev),
        (1, 1) => unary(Unary::Rev16),
        (1, 2) => unary(Unary::Rbit),
        (1, 3) => unary(Unary::Revsh),
        (2, 0) => general(&[rd, rn, rm], Op::Select { rd, rn, rm }),
        (3, 0) => unary(Unary::Clz),
        _ => Err(Undecodable::Unknown),
    }
}

pub(super) fn multiply(first: u32, second: u32) -> Decoded {
    let (rd, rn, rm, ra) =
        (register(second, 8), register(first, 0), register(second, 0), register(second, 12));
    let (upper, lower) = (second & 0x20 != 0, second & 0x10 != 0);
    if second & 0xc0 != 0 {
        return Err(Undecodable::Unknown);
    }
    let multiply = match (first >> 4 & 7, second >> 4 & 3) {
        (0, 0) => Multiply::Low,
        (0, 1) if ra == 15 => return Err(Undecodable::Unpredictable),
        (0, 1) => Multiply::Subtract,
        (1, _) => Multiply::Halves { first_top: upper, second_top: lower },
        (2, 0 | 1) => Multiply::DualAdd { exchange: lower },
        (3, 0 | 1) => Multiply::WordByHalf { top: lower },
        (4, 0 | 1) => Multiply::DualSubtract { exchange: lower },
        (5, 0 | 1) => Multiply::High { round: lower },
        (6, 0 | 1) if ra == 15 => return Err(Undecodable::Unpredictable),
        (6, 0 | 1) => Multiply::HighSubtract { round: lower },
        (7, 0) => {
            let op = Op::AbsoluteDifferences { rd, rn, rm, ra };
            return fixed(ra != 13, op).and_then(|op| general(&[rd, rn, rm], op));
        }
        _ => return Err(Undecodable::Unknown),
    };
    let op = Op::Multiply { multiply, sets: Sets::Never, rd, rn, rm, ra };
    fixed(ra != 13, op).and_then(|op| general(&[rd, rn, rm], op))
}

pub(super) fn long_multiply(first: u32, second: u32) -> Decoded {
    let (high, rn, rm, low) =
        (register(second, 8), register(first, 0), register(second, 0), register(second, 12));
    let (upper, lower) = (second & 0x20 != 0, second & 0x10 != 0);
    let multiply = match (first >> 4 & 7, second >> 4 & 15) {
        (0, 0) => LongMultiply::Signed,
        (op @ (1 | 3), 15) => {
            let op = Op::Divide { signed: op == 1, rd: high, rn, rm };
            return fixed(low == 15, op).and_then(|op| general(&[high, rn, rm], op));
        }
        (2, 0) => LongMultiply::Unsigned,
        (4, 0) => LongMultiply::SignedAdd,
        (4, 8..=11) => LongMultiply::Halves { first_top: upper, second_top: lower },
        (4, 12 | 13) => LongMultiply::DualAdd { exchange: lower },
        (5, 12 | 13) => LongMultiply::DualSubtract { exchange: lower },
        (6, 0) => LongMultiply::UnsignedAdd,
        (6, 6) => LongMultiply::UnsignedAddTwo,
        _ => return Err(Undecodable::Unknown),
    };
    let op = Op::LongMultiply { multiply, low, high, rn, rm };
    fixed(low != high, op).and_then(|op| general(&[low, high, rn, rm], op))
}
