//! Parallel sums and differences, saturation, and selection by bytes.

use super::arithmetic::{shifted, signed_saturated, unsigned_saturated};
use crate::error::Done;
use crate::instruction::{Op, ParallelLanes, Prefix};
use crate::machine::Microcontroller;

impl Microcontroller {
    pub(super) fn parallel(&mut self, op: Op) -> Done {
        match op {
            Op::Parallel { prefix, lanes, rd, rn, rm } => {
                let (x, y) = (self.registers.get(rn), self.registers.get(rm));
                let (value, flags) = lanewise(prefix, lanes, x, y);
                if let Some(flags) = flags {
                    self.registers.ge = flags;
                }
                self.registers.set(rd, value);
            }
            Op::SaturatingSum { double, subtract, rd, rn, rm } => {
                let x = i64::from(self.registers.get(rm) as i32);
                let y = i64::from(self.registers.get(rn) as i32);
                let (y, doubled) = if double { signed_saturated(2 * y, 32) } else { (y as u32, false) };
                let y = i64::from(y as i32);
                let (value, cut) = signed_saturated(if subtract { x - y } else { x + y }, 32);
                self.registers.q |= doubled | cut;
                self.registers.set(rd, value);
            }
            Op::Select { rd, rn, rm } => {
                let mask = (0..4).fold(0, |mask, lane| {
                    mask | if self.registers.ge >> lane & 1 != 0 { 0xff << (8 * lane) } else { 0 }
                });
                let value = self.registers.get(rn) & mask | self.registers.get(rm) & !mask;
                self.registers.set(rd, value);
            }
            Op::AbsoluteDifferences { rd, rn, rm, ra } => {
                let x = self.registers.get(rn).to_le_bytes();
                let y = self.registers.get(rm).to_le_bytes();
                let sum: u32 = x.iter().zip(y).map(|(&x, y)| u32::from(x.abs_diff(y))).sum();
                let a = if ra == 15 { 0 } else { self.registers.get(ra) };
                self.registers.set(rd, a.wrapping_add(sum));
            }
            Op::Saturate { signed, rd, rn, bits, shift, amount } => {
                let (value, _) = shifted(self.registers.get(rn), shift, amount.into(), false);
                let (value, cut) = saturated(signed, i64::from(value as i32), bits);
                self.registers.q |= cut;
                self.registers.set(rd, value);
            }
            Op::SaturateHalves { signed, rd, rn, bits } => {
                let x = self.registers.get(rn);
                let mut saturate = |value: u32| {
                    let (value, cut) = saturated(signed, i64::from(value as i16), bits);
                    self.registers.q |= cut;
                    value & 0xffff
                };
                let value = saturate(x) | saturate(x >> 16) << 16;
                self.registers.set(rd, value);
            }
            _ => unreachable!("only these are sent here"),
        }
        Ok(())
    }
}

/// The nearest number of so many bits, and whether it differs.
fn saturated(signed: bool, value: i64, bits: u8) -> (u32, bool) {
    if signed { signed_saturated(value, bits.into()) } else { unsigned_saturated(value, bits.into()) }
}

/// Result, and the GE flags, which only the forms without saturation and halving set.
fn lanewise(prefix: Prefix, lanes: ParallelLanes, x: u32, y: u32) -> (u32, Option<u8>) {
    let signed = matches!(prefix, Prefix::Signed | Prefix::SignedSaturating | Prefix::SignedHalving);
    let bytes = matches!(lanes, ParallelLanes::Add8 | ParallelLanes::Sub8);
    let width = if bytes { 8 } else { 16 };
    let lane = |value: u32, number: u32| {
        let value = value >> (number * width) << (32 - width);
        if signed { i64::from(value as i32 >> (32 - width)) } else { i64::from(value >> (32 - width)) }
    };
    let exchanged = matches!(lanes, ParallelLanes::AddSubExchanged | ParallelLanes::SubAddExchanged);
    let (mut result, mut flags) = (0, 0);
    for number in 0..32 / width {
        let adds = match lanes {
            ParallelLanes::Add16 | ParallelLanes::Add8 => true,
            ParallelLanes::Sub16 | ParallelLanes::Sub8 => false,
            ParallelLanes::AddSubExchanged => number == 1,
            ParallelLanes::SubAddExchanged => number == 0,
        };
        let other = lane(y, if exchanged { 1 - number } else { number });
        let sum = if adds { lane(x, number) + other } else { lane(x, number) - other };
        let value = match prefix {
            Prefix::Signed | Prefix::Unsigned => sum as u32,
            Prefix::SignedHalving | Prefix::UnsignedHalving => (sum >> 1) as u32,
            Prefix::SignedSaturating => signed_saturated(sum, width).0,
            Prefix::UnsignedSaturating => unsigned_saturated(sum, width).0,
        };
        let mask = (1 << width) - 1;
        result |= (value & mask) << (number * width);
        let set = match (signed, adds) {
            (false, true) => sum > i64::from(mask),
            _ => sum >= 0,
        };
        if set {
            flags |= if bytes { 1 << number } else { 3 << (2 * number) };
        }
    }
    (result, matches!(prefix, Prefix::Signed | Prefix::Unsigned).then_some(flags))
}
