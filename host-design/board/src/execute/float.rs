//! Floating-point instructions.

use super::float_arithmetic as number;
use crate::error::{Done, ProcessorFault, Violation};
use crate::instruction::{Float1, Float2, Op};
use crate::machine::Microcontroller;

/// FPSCR bits that change the arithmetic: AHP, DN, FZ, RMode.
const MODES: u32 = 0x07c0_0000;

impl Microcontroller {
    pub(super) fn float(&mut self, op: Op) -> Done {
        self.prepare_float()?;
        match op {
            Op::Float2 { op, d, n, m } => {
                self.only_default_modes()?;
                self.float2(op, d, n, m);
            }
            Op::Float1 { op, d, m } => {
                if !matches!(op, Float1::Move | Float1::Abs | Float1::Neg) {
                    self.only_default_modes()?;
                }
                self.float1(op, d, m);
            }
            Op::FloatConstant { d, bits } => self.registers.set_single(d, bits),
            Op::FloatCompare { d, m, signal } => {
                let x = self.registers.single(d);
                let y = m.map_or(0, |m| self.registers.single(m));
                let flags = number::compare(x, y, signal, &mut self.registers.fpscr);
                self.registers.fpscr = self.registers.fpscr & 0x0fff_ffff | flags << 28;
            }
            Op::FloatToCore { rt, n } => self.registers.set(rt, self.registers.single(n)),
            Op::CoreToFloat { n, rt } => self.registers.set_single(n, self.registers.get(rt)),
            Op::FloatPairToCore { rt, rt2, m } => {
                self.registers.set(rt, self.registers.single(m));
                self.registers.set(rt2, self.registers.single(m + 1));
                self.cycles += 1;
            }
            Op::CorePairToFloat { rt, rt2, m } => {
                self.registers.set_single(m, self.registers.get(rt));
                self.registers.set_single(m + 1, self.registers.get(rt2));
                self.cycles += 1;
            }
            Op::ReadFloatStatus { rt: 15 } => {
                let bits = self.registers.fpscr;
                self.registers.set_flags(bits);
            }
            Op::ReadFloatStatus { rt } => self.registers.set(rt, self.registers.fpscr),
            Op::WriteFloatStatus { rt } => self.registers.fpscr = self.registers.get(rt) & 0xf7c0_009f,
            _ => return self.float_memory(op),
        }
        Ok(())
    }

    /// Completes lazy stacking if it is pending, and marks the floating-point unit as in use (B1.5.7).
    fn prepare_float(&mut self) -> Done {
        if !self.bus.system.float_enabled(self.registers.privileged()) {
            return Err(ProcessorFault::NoCoprocessor.into());
        }
        if self.bus.system.fpccr & 1 != 0 {
            self.save_float_lazily()?;
        }
        if !self.registers.float_active {
            self.registers.float_active = true;
            self.registers.fpscr = self.bus.system.fpdscr & MODES;
        }
        Ok(())
    }

    fn only_default_modes(&self) -> Done {
        if self.registers.fpscr & MODES != 0 {
            return Err(Violation::NotModelled("floating point with modes other than the default").into());
        }
        Ok(())
    }

    fn float2(&mut self, op: Float2, d: u8, n: u8, m: u8) {
        let registers = &mut self.registers;
        let (x, y, a) = (registers.single(n), registers.single(m), registers.single(d));
        let flags = &mut registers.fpscr;
        let minus = |bits: u32| bits ^ 1 << 31;
        let value = match op {
            Float2::Add => number::add(x, y, flags),
            Float2::Sub => number::sub(x, y, flags),
            Float2::Mul => number::mul(x, y, flags),
            Float2::NegMul => minus(number::mul(x, y, flags)),
            Float2::Div => number::div(x, y, flags),
            Float2::Mla => {
                let product = number::mul(x, y, flags);
                number::add(a, product, flags)
            }
            Float2::Mls => {
                let product = minus(number::mul(x, y, flags));
                number::add(a, product, flags)
            }
            Float2::NegMla => {
                let product = minus(number::mul(x, y, flags));
                number::add(minus(a), product, flags)
            }
            Float2::NegMls => {
                let product = number::mul(x, y, flags);
                number::add(minus(a), product, flags)
            }
            Float2::Fma => number::fused(a, x, y, flags),
            Float2::Fms => number::fused(a, minus(x), y, flags),
            Float2::NegFma => number::fused(minus(a), minus(x), y, flags),
            Float2::NegFms => number::fused(minus(a), x, y, flags),
        };
        registers.set_single(d, value);
        self.cycles += match op {
            Float2::Add | Float2::Sub | Float2::Mul | Float2::NegMul => 0,
            Float2::Div => 13,
            _ => 2,
        };
    }

    fn float1(&mut self, op: Float1, d: u8, m: u8) {
        let registers = &mut self.registers;
        let x = registers.single(m);
        let flags = &mut registers.fpscr;
        let value = match op {
            Float1::Move => x,
            Float1::Abs => x & !(1 << 31),
            Float1::Neg => x ^ 1 << 31,
            Float1::Sqrt => number::sqrt(x, flags),
            Float1::FromSigned => number::from_fixed(i64::from(x as i32), 0, flags),
            Float1::FromUnsigned => number::from_fixed(x.into(), 0, flags),
            Float1::ToSigned { to_zero } => number::to_fixed(x, 0, true, 32, to_zero, flags),
            Float1::ToUnsigned { to_zero } => number::to_fixed(x, 0, false, 32, to_zero, flags),
            Float1::FromFixed { signed, half, fraction } => {
                let fixed = match (signed, half) {
                    (true, true) => i64::from(x as i16),
                    (false, true) => i64::from(x as u16),
                    (true, false) => i64::from(x as i32),
                    (false, false) => i64::from(x),
                };
                number::from_fixed(fixed, fraction, flags)
            }
            Float1::ToFixed { signed, half, fraction } => {
                number::to_fixed(x, fraction, signed, if half { 16 } else { 32 }, true, flags)
            }
            Float1::FromHalf { top } => number::from_half((if top { x >> 16 } else { x }) as u16, flags),
            Float1::ToHalf { top } => {
                let half = u32::from(number::to_half(x, flags));
                let old = registers.single(d);
                if top { old & 0xffff | half << 16 } else { old & 0xffff_0000 | half }
            }
        };
        registers.set_single(d, value);
        self.cycles += if op == Float1::Sqrt { 13 } else { 0 };
    }
}
