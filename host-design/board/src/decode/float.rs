//! Floating-point instructions of FPv4-SP (A6.3 to A6.7).

use super::field::{Decoded, Undecodable, fixed, general, register};
use crate::instruction::{Float1, Float2, Op};

/// Number of a single-precision register: four bits at `at`, and its lowest bit from `low`.
fn single(word: u32, at: u32, low: u32) -> u8 {
    ((word >> at & 15) << 1 | low & 1) as u8
}

pub(super) fn decode(first: u32, second: u32) -> Decoded {
    // Only coprocessors 10 and 11 exist.
    if second >> 9 & 7 != 5 || first & 0x1000 != 0 {
        return Err(Undecodable::Unknown);
    }
    let double = second & 0x100 != 0;
    match first >> 8 & 3 {
        2 if second & 0x10 == 0 && !double => arithmetic(first, second),
        2 if second & 0x10 != 0 => transfer(first, second, double),
        0 | 1 if first & 0x1e0 == 0x40 => pair(first, second, double),
        0 | 1 => memory(first, second, double),
        _ => Err(Undecodable::Unknown),
    }
}

fn arithmetic(first: u32, second: u32) -> Decoded {
    let d = single(second, 12, first >> 6);
    let n = single(first, 0, second >> 7);
    let m = single(second, 0, second >> 5);
    let negate = second & 0x40 != 0;
    let choose = |plain, negated| if negate { negated } else { plain };
    let op = match first >> 4 & 0xb {
        0x0 => choose(Float2::Mla, Float2::Mls),
        0x1 => choose(Float2::NegMls, Float2::NegMla),
        0x2 => choose(Float2::Mul, Float2::NegMul),
        0x3 => choose(Float2::Add, Float2::Sub),
        0x8 if !negate => Float2::Div,
        0x9 => choose(Float2::NegFms, Float2::NegFma),
        0xa => choose(Float2::Fma, Float2::Fms),
        0xb => return other(first, second, d, m),
        _ => return Err(Undecodable::Unknown),
    };
    Ok(Op::Float2 { op, d, n, m })
}

fn other(first: u32, second: u32, d: u8, m: u8) -> Decoded {
    if second & 0x40 == 0 {
        if second & 0xa0 != 0 {
            return Err(Undecodable::Unpredictable);
        }
        return Ok(Op::FloatConstant { d, bits: constant((first & 15) << 4 | second & 15) });
    }
    let top = second & 0x80 != 0;
    let unary = |op| Ok(Op::Float1 { op, d, m });
    match (first & 15, top) {
        (0, false) => unary(Float1::Move),
        (0, true) => unary(Float1::Abs),
        (1, false) => unary(Float1::Neg),
        (1, true) => unary(Float1::Sqrt),
        (2, top) => unary(Float1::FromHalf { top }),
        (3, top) => unary(Float1::ToHalf { top }),
        (4, signal) => Ok(Op::FloatCompare { d, m: Some(m), signal }),
        (5, signal) => fixed(second & 0x2f == 0, Op::FloatCompare { d, m: None, signal }),
        (8, false) => unary(Float1::FromUnsigned),
        (8, true) => unary(Float1::FromSigned),
        (12, to_zero) => unary(Float1::ToUnsigned { to_zero }),
        (13, to_zero) => unary(Float1::ToSigned { to_zero }),
        (number @ (10 | 11 | 14 | 15), word) => {
            let bits = second << 1 & 0x1e | second >> 5 & 1;
            let size = if word { 32 } else { 16 };
            let Some(fraction) = u8::try_from(size - bits as i32).ok() else {
                return Err(Undecodable::Unpredictable);
            };
            let (signed, half) = (number & 1 == 0, !word);
            let op = if number < 12 {
                Float1::FromFixed { signed, half, fraction }
            } else {
                Float1::ToFixed { signed, half, fraction }
            };
            Ok(Op::Float1 { op, d, m: d })
        }
        _ => Err(Undecodable::Unknown),
    }
}

/// Expands a floating-point constant of eight bits (A6.4.1).
fn constant(bits: u32) -> u32 {
    let exponent = if bits & 0x40 != 0 { 0x1f } else { 0x20 };
    (bits & 0x80) << 24 | exponent << 25 | (bits & 0x3f) << 19
}

fn transfer(first: u32, second: u32, double: bool) -> Decoded {
    let rt = register(second, 12);
    let n = single(first, 0, second >> 7);
    let to_core = first & 0x10 != 0;
    if first & 0xe0 == 0xe0 {
        // FPSCR is register 1; a read into R15 copies the flags.
        if double || first & 15 != 1 {
            return Err(Undecodable::Unknown);
        }
        let zero = second & 0xef == 0;
        return if to_core {
            fixed(zero && rt != 13, Op::ReadFloatStatus { rt })
        } else {
            fixed(zero, Op::WriteFloatStatus { rt }).and_then(|op| general(&[rt], op))
        };
    }
    // Half of a double-precision register is a single-precision one, of even or odd number.
    let n = match (double, first >> 5 & 7) {
        (false, 0) => n,
        (true, half @ (0 | 1)) if second & 0x80 == 0 => single(first, 0, half),
        _ => return Err(Undecodable::Unknown),
    };
    let op = if to_core { Op::FloatToCore { rt, n } } else { Op::CoreToFloat { n, rt } };
    let zero = second & 0x6f == 0;
    fixed(zero, op).and_then(|op| general(&[rt], op))
}

fn pair(first: u32, second: u32, double: bool) -> Decoded {
    let (rt, rt2) = (register(second, 12), register(first, 0));
    if second & 0xd0 != 0x10 {
        return Err(Undecodable::Unknown);
    }
    let m = if double { single(second, 0, 0) } else { single(second, 0, second >> 5) };
    if double && second & 0x20 != 0 {
        return Err(Undecodable::Unknown);
    }
    let to_core = first & 0x10 != 0;
    let allowed = m != 31 && !(to_core && rt == rt2);
    let op = if to_core { Op::FloatPairToCore { rt, rt2, m } } else { Op::CorePairToFloat { rt, rt2, m } };
    fixed(allowed, op).and_then(|op| general(&[rt, rt2], op))
}

fn memory(first: u32, second: u32, double: bool) -> Decoded {
    let rn = register(first, 0);
    let (before, up, write_back) = (first & 0x100 != 0, first & 0x80 != 0, first & 0x20 != 0);
    let load = first & 0x10 != 0;
    let words = (second & 0xff) as u8;
    // This unit has no double-precision registers beyond D15.
    if double && first & 0x40 != 0 {
        return Err(Undecodable::Unknown);
    }
    let d = if double { single(second, 12, 0) } else { single(second, 12, first >> 6) };
    if before && !write_back {
        let size = i16::from(words) * 4;
        let offset = if up { size } else { -size };
        let count = if double { 2 } else { 1 };
        return if load {
            Ok(Op::FloatLoad { d, rn, offset, count })
        } else {
            fixed(rn != 15, Op::FloatStore { d, rn, offset, count })
        };
    }
    let down = match (before, up) {
        (false, true) => false,
        (true, false) => true,
        _ => return Err(Undecodable::Unknown),
    };
    // An odd count for doubles is the deprecated FLDMX.
    let whole = !double || words & 1 == 0;
    let fits = words != 0 && u32::from(d) + u32::from(words) <= 32;
    let op = if load {
        Op::FloatLoadMultiple { d, rn, count: words, down, write_back }
    } else {
        Op::FloatStoreMultiple { d, rn, count: words, down, write_back }
    };
    fixed(whole && fits && rn != 15, op)
}
