//! Sums with carry and overflow, and shifts with carry (A2.2.1).

use crate::instruction::Shift;

/// Sum, carry and overflow.
#[inline]
pub(super) fn add_with_carry(x: u32, y: u32, carry: bool) -> (u32, bool, bool) {
    let (half, first) = x.overflowing_add(y);
    let (sum, second) = half.overflowing_add(carry.into());
    (sum, first | second, ((x ^ sum) & (y ^ sum)) >> 31 != 0)
}

/// A shifted value, and the carry out of the barrel shifter.
#[inline]
pub(super) fn shifted(value: u32, shift: Shift, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    match shift {
        Shift::Lsl => match amount {
            1..=31 => (value << amount, value >> (32 - amount) & 1 != 0),
            32 => (0, value & 1 != 0),
            _ => (0, false),
        },
        Shift::Lsr => match amount {
            1..=31 => (value >> amount, value >> (amount - 1) & 1 != 0),
            32 => (0, value >> 31 != 0),
            _ => (0, false),
        },
        Shift::Asr => {
            let amount = amount.min(32);
            let last = ((value as i32) >> (amount - 1)) & 1 != 0;
            ((i64::from(value as i32) >> amount) as u32, last)
        }
        Shift::Ror => {
            let value = value.rotate_right(amount & 31);
            (value, value >> 31 != 0)
        }
        Shift::Rrx => (value >> 1 | u32::from(carry) << 31, value & 1 != 0),
    }
}

/// A number saturated to the signed range of `bits`, and whether it was out of range.
pub(super) fn signed_saturated(value: i64, bits: u32) -> (u32, bool) {
    let limit = 1i64 << (bits - 1);
    let cut = value.clamp(-limit, limit - 1);
    (cut as u32, cut != value)
}

/// A number saturated to the unsigned range of `bits`, and whether it was out of range.
pub(super) fn unsigned_saturated(value: i64, bits: u32) -> (u32, bool) {
    let cut = value.clamp(0, (1i64 << bits) - 1);
    (cut as u32, cut != value)
}
