//! 32-bit instructions: loads and stores (A5.3.5 to A5.3.10).

use super::field::{Decoded, Undecodable, fixed, general, register};
use crate::instruction::{Addressing, Op, Unit};

pub(super) fn multiple(first: u32, second: u32) -> Decoded {
    let (rn, list) = (register(first, 0), second as u16);
    let write_back = first & 0x20 != 0;
    let load = first & 0x10 != 0;
    let down = match first >> 7 & 3 {
        1 => false,
        2 => true,
        _ => return Err(Undecodable::Unknown),
    };
    let base_listed = list >> rn & 1 != 0;
    let common = rn != 15 && list.count_ones() >= 2 && list & 1 << 13 == 0 && !(write_back && base_listed);
    if load {
        fixed(common && list >> 14 != 3, Op::LoadMultiple { rn, list, down, write_back })
    } else {
        fixed(common && list >> 15 == 0, Op::StoreMultiple { rn, list, down, write_back })
    }
}

pub(super) fn dual_or_exclusive(first: u32, second: u32) -> Decoded {
    let (rn, rt, rt2) = (register(first, 0), register(second, 12), register(second, 8));
    let (index, up, write_back) = (first & 0x100 != 0, first & 0x80 != 0, first & 0x20 != 0);
    let load = first & 0x10 != 0;
    if !index && !write_back {
        return exclusive_or_table(first, second);
    }
    let size = ((second & 0xff) * 4) as i16;
    let offset = if up { size } else { -size };
    let wraps = write_back && (rn == rt || rn == rt2);
    let base = rn != 15 || (load && !write_back);
    let allowed = !wraps && base && !(load && rt == rt2);
    let op = if load {
        Op::LoadDual { rt, rt2, rn, offset, index, write_back }
    } else {
        Op::StoreDual { rt, rt2, rn, offset, index, write_back }
    };
    fixed(allowed, op).and_then(|op| general(&[rt, rt2], op))
}

fn exclusive_or_table(first: u32, second: u32) -> Decoded {
    let (rn, rt, rd) = (register(first, 0), register(second, 12), register(second, 8));
    let unit = match second >> 4 & 15 {
        4 => Unit::Byte,
        _ => Unit::Half,
    };
    match (first >> 7 & 3, first >> 4 & 3, second >> 4 & 15) {
        (0, 0, _) => {
            let op = Op::StoreExclusive { unit: Unit::Word, rd, rt, rn, offset: (second & 0xff) as u16 * 4 };
            fixed(rn != 15 && rd != rn && rd != rt, op).and_then(|op| general(&[rd, rt], op))
        }
        (0, 1, _) => {
            let op = Op::LoadExclusive { unit: Unit::Word, rt, rn, offset: (second & 0xff) as u16 * 4 };
            fixed(rn != 15 && rd == 15, op).and_then(|op| general(&[rt], op))
        }
        (1, 0, 4 | 5) => {
            let rd = register(second, 0);
            let op = Op::StoreExclusive { unit, rd, rt, rn, offset: 0 };
            fixed(rn != 15 && rd != rn && rd != rt && second & 0xf00 == 0xf00, op)
                .and_then(|op| general(&[rd, rt], op))
        }
        (1, 1, 4 | 5) => {
            let op = Op::LoadExclusive { unit, rt, rn, offset: 0 };
            fixed(rn != 15 && second & 0xf0f == 0xf0f, op).and_then(|op| general(&[rt], op))
        }
        (1, 1, 0 | 1) => {
            let rm = register(second, 0);
            let op = Op::TableBranch { rn, rm, half: second & 0x10 != 0 };
            fixed(rn != 13 && second & 0xff00 == 0xf000, op).and_then(|op| general(&[rm], op))
        }
        _ => Err(Undecodable::Unknown),
    }
}

/// Addressing mode of a single access; an error for the unprivileged forms.
fn place(first: u32, second: u32) -> Result<Addressing, Undecodable> {
    if first & 0x80 != 0 {
        return Ok(Addressing::Offset((second & 0xfff) as i32));
    }
    if second & 0x800 == 0 {
        let register = register(second, 0);
        if second & 0x7c0 != 0 {
            return Err(Undecodable::Unknown);
        }
        if register == 13 || register == 15 {
            return Err(Undecodable::Unpredictable);
        }
        return Ok(Addressing::Indexed { register, shift: (second >> 4 & 3) as u8 });
    }
    let size = (second & 0xff) as i16;
    let offset = if second & 0x200 != 0 { size } else { -size };
    match (second & 0x400 != 0, second & 0x100 != 0, second & 0x200 != 0) {
        (true, false, false) => Ok(Addressing::Offset(offset.into())),
        // LDRT and the like: unprivileged accesses, which no program here needs.
        (true, false, true) => Err(Undecodable::Unknown),
        (true, true, _) => Ok(Addressing::PreIndexed(offset)),
        (false, true, _) => Ok(Addressing::PostIndexed(offset)),
        (false, false, _) => Err(Undecodable::Unknown),
    }
}

fn writes_back(place: Addressing) -> bool {
    matches!(place, Addressing::PreIndexed(_) | Addressing::PostIndexed(_))
}

pub(super) fn store(first: u32, second: u32) -> Decoded {
    let (rn, rt) = (register(first, 0), register(second, 12));
    if rn == 15 {
        return Err(Undecodable::Unknown);
    }
    let unit = match first >> 5 & 3 {
        0 => Unit::Byte,
        1 => Unit::Half,
        2 => Unit::Word,
        _ => return Err(Undecodable::Unknown),
    };
    let place = place(first, second)?;
    let allowed = rt != 15 && (rt != 13 || unit == Unit::Word) && !(writes_back(place) && rn == rt);
    fixed(allowed, Op::Store { unit, rt, rn, place })
}

fn literal(first: u32, second: u32, address: u32) -> u32 {
    let base = address.wrapping_add(4) & !3;
    if first & 0x80 != 0 { base.wrapping_add(second & 0xfff) } else { base.wrapping_sub(second & 0xfff) }
}

pub(super) fn load_byte(first: u32, second: u32, address: u32) -> Decoded {
    part(first, second, address, Unit::Byte, Unit::SignedByte)
}

pub(super) fn load_half(first: u32, second: u32, address: u32) -> Decoded {
    part(first, second, address, Unit::Half, Unit::SignedHalf)
}

fn part(first: u32, second: u32, address: u32, plain: Unit, extended: Unit) -> Decoded {
    let (rn, rt) = (register(first, 0), register(second, 12));
    let unit = if first & 0x100 == 0 { plain } else { extended };
    if rn == 15 {
        // With R15 as target this is a preload hint, which does nothing.
        let op = Op::LoadLiteral { unit, rt, address: literal(first, second, address) };
        return if rt == 15 { Ok(Op::Nop) } else { fixed(rt != 13, op) };
    }
    let place = place(first, second)?;
    if rt == 15 && !writes_back(place) {
        return Ok(Op::Nop);
    }
    let allowed = !(writes_back(place) && rn == rt);
    fixed(allowed, Op::Load { unit, rt, rn, place }).and_then(|op| general(&[rt], op))
}

pub(super) fn load_word(first: u32, second: u32, address: u32) -> Decoded {
    let (rn, rt) = (register(first, 0), register(second, 12));
    if first & 0x100 != 0 {
        return Err(Undecodable::Unknown);
    }
    if rn == 15 {
        return Ok(Op::LoadLiteral { unit: Unit::Word, rt, address: literal(first, second, address) });
    }
    let place = place(first, second)?;
    fixed(!(writes_back(place) && rn == rt), Op::Load { unit: Unit::Word, rt, rn, place })
}
