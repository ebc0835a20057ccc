//! Multiplication and division.

use crate::error::Done;
use crate::instruction::{LongMultiply, Multiply, Op};
use crate::machine::Microcontroller;

fn half(value: u32, top: bool) -> i64 {
    i64::from((if top { value >> 16 } else { value }) as i16)
}

fn products(x: u32, y: u32, exchange: bool) -> (i64, i64) {
    let y = if exchange { y.rotate_right(16) } else { y };
    (half(x, false) * half(y, false), half(x, true) * half(y, true))
}

impl Microcontroller {
    pub(super) fn multiply(&mut self, op: Op) -> Done {
        match op {
            Op::Multiply { multiply, sets, rd, rn, rm, ra } => {
                let (x, y) = (self.registers.get(rn), self.registers.get(rm));
                let a = if ra == 15 { 0 } else { self.registers.get(ra) };
                let value = self.product(multiply, x, y, a);
                self.registers.set(rd, value);
                self.cycles += u32::from(ra != 15 && matches!(multiply, Multiply::Low | Multiply::Subtract));
                if self.sets(sets) {
                    self.registers.n = value >> 31 != 0;
                    self.registers.z = value == 0;
                }
            }
            Op::LongMultiply { multiply, low, high, rn, rm } => {
                let (x, y) = (self.registers.get(rn), self.registers.get(rm));
                let sum = u64::from(self.registers.get(high)) << 32 | u64::from(self.registers.get(low));
                let value = long_product(multiply, x, y, sum);
                self.registers.set(low, value as u32);
                self.registers.set(high, (value >> 32) as u32);
            }
            Op::Divide { signed, rd, rn, rm } => {
                let (x, y) = (self.registers.get(rn), self.registers.get(rm));
                let value = match (y, signed) {
                    // CCR.DIV_0_TRP is off.
                    (0, _) => 0,
                    (_, true) => (x as i32).wrapping_div(y as i32) as u32,
                    (_, false) => x / y,
                };
                self.registers.set(rd, value);
                // 2 to 12 cycles, depending on the length of the quotient.
                self.cycles += 1 + (y.leading_zeros().saturating_sub(x.leading_zeros()) / 3).min(10);
            }
            _ => unreachable!("only these are sent here"),
        }
        Ok(())
    }

    fn product(&mut self, multiply: Multiply, x: u32, y: u32, a: u32) -> u32 {
        let signed_a = i64::from(a as i32);
        let high = |sum: i64, round: bool| ((sum + if round { 0x8000_0000 } else { 0 }) >> 32) as u32;
        let full = i64::from(x as i32) * i64::from(y as i32);
        let wide_a = signed_a << 32;
        let (sum, fits) = match multiply {
            Multiply::Low => return x.wrapping_mul(y).wrapping_add(a),
            Multiply::Subtract => return a.wrapping_sub(x.wrapping_mul(y)),
            Multiply::High { round } => return high(wide_a.wrapping_add(full), round),
            Multiply::HighSubtract { round } => return high(wide_a.wrapping_sub(full), round),
            Multiply::Halves { first_top, second_top } => {
                (half(x, first_top) * half(y, second_top) + signed_a, true)
            }
            Multiply::WordByHalf { top } => (((i64::from(x as i32) * half(y, top)) >> 16) + signed_a, true),
            Multiply::DualAdd { exchange } => {
                let (low, top) = products(x, y, exchange);
                (low + top + signed_a, true)
            }
            Multiply::DualSubtract { exchange } => {
                let (low, top) = products(x, y, exchange);
                (low - top + signed_a, true)
            }
        };
        let fits = fits && i32::try_from(sum).is_ok();
        self.registers.q |= !fits;
        sum as u32
    }
}

fn long_product(multiply: LongMultiply, x: u32, y: u32, sum: u64) -> u64 {
    let signed = (i64::from(x as i32) * i64::from(y as i32)) as u64;
    let unsigned = u64::from(x) * u64::from(y);
    match multiply {
        LongMultiply::Signed => signed,
        LongMultiply::Unsigned => unsigned,
        LongMultiply::SignedAdd => sum.wrapping_add(signed),
        LongMultiply::UnsignedAdd => sum.wrapping_add(unsigned),
        LongMultiply::UnsignedAddTwo => unsigned.wrapping_add(sum >> 32).wrapping_add(sum & 0xffff_ffff),
        LongMultiply::Halves { first_top, second_top } => {
            sum.wrapping_add((half(x, first_top) * half(y, second_top)) as u64)
        }
        LongMultiply::DualAdd { exchange } => {
            let (low, top) = products(x, y, exchange);
            sum.wrapping_add((low + top) as u64)
        }
        LongMultiply::DualSubtract { exchange } => {
            let (low, top) = products(x, y, exchange);
            sum.wrapping_add((low - top) as u64)
        }
    }
}
