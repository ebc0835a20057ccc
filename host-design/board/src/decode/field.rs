//! What the decoders of all groups share: fields of an instruction, and what they may not hold.

use crate::instruction::Op;

/// Why half-words cannot be decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Undecodable {
    /// Not an instruction of this processor.
    Unknown,
    /// An instruction whose effect the architecture does not define.
    Unpredictable,
}

/// An instruction, or why there is none.
pub(super) type Decoded = Result<Op, Undecodable>;

/// Register number in four bits of a half-word.
pub(super) fn register(word: u32, at: u32) -> u8 {
    (word >> at & 15) as u8
}

/// `op`, if none of the registers is the stack pointer or the program counter.
pub(super) fn general(registers: &[u8], op: Op) -> Decoded {
    if registers.iter().any(|&r| r == 13 || r == 15) { Err(Undecodable::Unpredictable) } else { Ok(op) }
}

/// `op`, if bits that should be zero or one are.
pub(super) fn fixed(right: bool, op: Op) -> Decoded {
    if right { Ok(op) } else { Err(Undecodable::Unpredictable) }
}

/// Sign-extends the lower `bits`.
pub(super) fn signed(value: u32, bits: u32) -> i32 {
    (value << (32 - bits)) as i32 >> (32 - bits)
}
