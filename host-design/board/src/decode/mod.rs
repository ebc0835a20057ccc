//! The decoder: half-words to instructions (ARMv7-M Architecture Reference Manual, A5 to A7).
//!
//! Strict: what the manual does not define is [`Undecodable::Unknown`], what it calls UNPREDICTABLE is
//! [`Undecodable::Unpredictable`].

mod field;
mod float;
mod narrow;
mod wide_data;
mod wide_memory;
mod wide_register;

use field::Decoded;
pub(crate) use field::Undecodable;

use crate::instruction::Instruction;

/// Whether the instruction that begins with `first` has 32 bits.
pub fn is_wide(first: u16) -> bool {
    first >= 0xe800
}

/// Decodes the instruction at `address`; `second` matters only if `first` begins one of 32 bits.
pub(crate) fn decode(first: u16, second: u16, address: u32) -> Result<Instruction, Undecodable> {
    if is_wide(first) {
        Ok(Instruction { op: wide(first.into(), second.into(), address)?, length: 4 })
    } else {
        Ok(Instruction { op: narrow::decode(first.into(), address)?, length: 2 })
    }
}

fn wide(first: u32, second: u32, address: u32) -> Decoded {
    match (first >> 11 & 3, first >> 4 & 0x7f) {
        (0b01, op) if op & 0x64 == 0x00 => wide_memory::multiple(first, second),
        (0b01, op) if op & 0x64 == 0x04 => wide_memory::dual_or_exclusive(first, second),
        (0b01, op) if op & 0x60 == 0x20 => wide_data::shifted_register(first, second),
        (0b01 | 0b11, op) if op & 0x40 == 0x40 => float::decode(first, second),
        (0b10, op) if second & 0x8000 != 0 => wide_data::branch_or_control(first, second, op, address),
        (0b10, op) if op & 0x20 == 0 => wide_data::modified_immediate(first, second),
        (0b10, _) => wide_data::plain_immediate(first, second, address),
        (0b11, op) if op & 0x71 == 0x00 => wide_memory::store(first, second),
        (0b11, op) if op & 0x67 == 0x01 => wide_memory::load_byte(first, second, address),
        (0b11, op) if op & 0x67 == 0x03 => wide_memory::load_half(first, second, address),
        (0b11, op) if op & 0x67 == 0x05 => wide_memory::load_word(first, second, address),
        (0b11, op) if op & 0x70 == 0x20 => wide_register::decode(first, second),
        (0b11, op) if op & 0x78 == 0x30 => wide_register::multiply(first, second),
        (0b11, op) if op & 0x78 == 0x38 => wide_register::long_multiply(first, second),
        _ => Err(Undecodable::Unknown),
    }
}
