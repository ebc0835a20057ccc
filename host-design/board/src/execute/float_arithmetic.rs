//! Single-precision arithmetic as ARM defines it (A2.5): round to nearest, this processor's NaNs, cumulative flags.
//!
//! Values come from the host's own IEEE arithmetic; NaNs, in which hosts differ, are computed here.

const INVALID: u32 = 1;
const DIVIDED_BY_ZERO: u32 = 1 << 1;
const OVERFLOW: u32 = 1 << 2;
const UNDERFLOW: u32 = 1 << 3;
const INEXACT: u32 = 1 << 4;
/// Result of an invalid operation.
const DEFAULT_NAN: u32 = 0x7fc0_0000;
/// The smallest normal single.
const SMALLEST: f64 = f32::MIN_POSITIVE as f64;

fn is_nan(x: u32) -> bool {
    x & 0x7fff_ffff > 0x7f80_0000
}

fn is_signalling(x: u32) -> bool {
    is_nan(x) && x & 0x0040_0000 == 0
}

/// The resulting NaN if an operand is a NaN: the first signalling one (made quiet), else the first quiet one.
fn nan_of(operands: &[u32], flags: &mut u32) -> Option<u32> {
    if let Some(&nan) = operands.iter().find(|&&x| is_signalling(x)) {
        *flags |= INVALID;
        return Some(nan | 0x0040_0000);
    }
    operands.iter().copied().find(|&x| is_nan(x))
}

fn value(x: u32) -> f32 {
    f32::from_bits(x)
}

fn wide(x: u32) -> f64 {
    f64::from(value(x))
}

/// Sets the flags of a result rounded from a finite value; `exact` is accurate enough to tell whether it is tiny.
fn rounded(result: f32, exact: f64, is_exact: bool, flags: &mut u32) -> u32 {
    if result.is_infinite() {
        *flags |= OVERFLOW | INEXACT;
    } else if !is_exact {
        *flags |= INEXACT;
        if exact.abs() < SMALLEST {
            *flags |= UNDERFLOW;
        }
    }
    result.to_bits()
}

/// Common handling of special operands and results. `finite` is called for finite operands only.
fn operation(
    operands: &[u32],
    result: f32,
    flags: &mut u32,
    finite: impl FnOnce(f32, &mut u32) -> u32,
) -> u32 {
    if result.is_nan() {
        return nan_of(operands, flags).unwrap_or_else(|| {
            *flags |= INVALID;
            DEFAULT_NAN
        });
    }
    if operands.iter().any(|&x| !value(x).is_finite()) {
        return result.to_bits();
    }
    finite(result, flags)
}

#[inline]
pub(super) fn add(x: u32, y: u32, flags: &mut u32) -> u32 {
    let result = value(x) + value(y);
    // A finite sum can raise no flag but "inexact", since tiny sums are exact.
    if *flags & INEXACT != 0 && result.is_finite() {
        return result.to_bits();
    }
    operation(&[x, y], result, flags, |result, flags| {
        let sum = wide(x) + wide(y);
        // The sum of two singles may need more than 53 bits; `missing` is its rounding error (Knuth's two-sum).
        let other = sum - wide(x);
        let missing = (wide(x) - (sum - other)) + (wide(y) - other);
        rounded(result, sum, f64::from(result) == sum && missing == 0.0, flags)
    })
}

pub(super) fn sub(x: u32, y: u32, flags: &mut u32) -> u32 {
    // A NaN keeps its sign, so this case is not a sum with a negated operand.
    if is_nan(x) || is_nan(y) {
        return nan_of(&[x, y], flags).unwrap_or(DEFAULT_NAN);
    }
    add(x, y ^ 1 << 31, flags)
}

#[inline]
pub(super) fn mul(x: u32, y: u32, flags: &mut u32) -> u32 {
    let result = value(x) * value(y);
    operation(&[x, y], result, flags, |result, flags| {
        let product = wide(x) * wide(y);
        rounded(result, product, f64::from(result) == product, flags)
    })
}

pub(super) fn div(x: u32, y: u32, flags: &mut u32) -> u32 {
    let result = value(x) / value(y);
    operation(&[x, y], result, flags, |result, flags| {
        if value(y) == 0.0 {
            *flags |= DIVIDED_BY_ZERO;
            return result.to_bits();
        }
        let exact = f64::from(result) * wide(y) == wide(x);
        rounded(result, wide(x) / wide(y), exact, flags)
    })
}

pub(super) fn sqrt(x: u32, flags: &mut u32) -> u32 {
    let result = value(x).sqrt();
    operation(&[x], result, flags, |result, flags| {
        let exact = f64::from(result) * f64::from(result) == wide(x);
        rounded(result, f64::from(result), exact, flags)
    })
}

/// a + x·y, rounded once.
pub(super) fn fused(a: u32, x: u32, y: u32, flags: &mut u32) -> u32 {
    let result = value(x).mul_add(value(y), value(a));
    let zero_times_infinity =
        (value(x) == 0.0 && value(y).is_infinite()) || (value(y) == 0.0 && value(x).is_infinite());
    if zero_times_infinity && is_nan(a) && !is_signalling(a) {
        *flags |= INVALID;
        return DEFAULT_NAN;
    }
    operation(&[a, x, y], result, flags, |result, flags| {
        let product = wide(x) * wide(y);
        let sum = product + wide(a);
        let other = sum - product;
        let missing = (product - (sum - other)) + (wide(a) - other);
        rounded(result, sum, f64::from(result) == sum && missing == 0.0, flags)
    })
}

/// N, Z, C, V of a comparison.
pub(super) fn compare(x: u32, y: u32, signal: bool, flags: &mut u32) -> u32 {
    if is_nan(x) || is_nan(y) {
        if signal || is_signalling(x) || is_signalling(y) {
            *flags |= INVALID;
        }
        return 0b0011;
    }
    let (x, y) = (value(x), value(y));
    if x == y {
        0b0110
    } else if x < y {
        0b1000
    } else {
        0b0010
    }
}

/// A fixed-point number as a single.
pub(super) fn from_fixed(fixed: i64, fraction: u8, flags: &mut u32) -> u32 {
    let exact = fixed as f64 / (1u64 << fraction) as f64;
    let result = exact as f32;
    rounded(result, exact, f64::from(result) == exact, flags)
}

/// A single as a fixed-point number of `bits`, in 32 bits.
pub(super) fn to_fixed(x: u32, fraction: u8, signed: bool, bits: u32, to_zero: bool, flags: &mut u32) -> u32 {
    if is_nan(x) {
        *flags |= INVALID;
        return 0;
    }
    let scaled = wide(x) * (1u64 << fraction) as f64;
    let whole = if to_zero { scaled.trunc() } else { scaled.round_ties_even() };
    let (low, high) =
        if signed { (-(1i64 << (bits - 1)), (1i64 << (bits - 1)) - 1) } else { (0, (1i64 << bits) - 1) };
    // Rust's conversion to `i64` saturates.
    let cut = (whole as i64).clamp(low, high);
    if whole < low as f64 || whole > high as f64 {
        *flags |= INVALID;
    } else if whole != scaled {
        *flags |= INEXACT;
    }
    cut as u32
}

/// A half-precision number as a single.
pub(super) fn from_half(half: u16, flags: &mut u32) -> u32 {
    let sign = u32::from(half & 0x8000) << 16;
    let (exponent, fraction) = (u32::from(half >> 10 & 31), u32::from(half & 0x3ff));
    match (exponent, fraction) {
        (31, 0) => sign | 0x7f80_0000,
        (31, _) => {
            if fraction & 0x200 == 0 {
                *flags |= INVALID;
            }
            sign | 0x7fc0_0000 | fraction << 13
        }
        (0, _) => sign | (fraction as f32 / (1u32 << 24) as f32).to_bits(),
        _ => sign | (exponent + 112) << 23 | fraction << 13,
    }
}

/// A single as a half-precision number.
pub(super) fn to_half(x: u32, flags: &mut u32) -> u16 {
    let sign = (x >> 16 & 0x8000) as u16;
    if is_nan(x) {
        if is_signalling(x) {
            *flags |= INVALID;
        }
        return sign | 0x7e00 | (x >> 13 & 0x1ff) as u16;
    }
    let magnitude = f64::from(value(x & 0x7fff_ffff));
    if magnitude.is_infinite() {
        return sign | 0x7c00;
    }
    // Eleven significant bits, or steps of 2⁻²⁴.
    let exponent = ((x >> 23 & 0xff) as i32 - 127).max(-14);
    let step = f64::powi(2.0, exponent - 10);
    let steps = (magnitude / step).round_ties_even();
    let rounded = steps * step;
    if rounded >= 65_536.0 {
        *flags |= OVERFLOW | INEXACT;
        return sign | 0x7c00;
    }
    if rounded != magnitude {
        *flags |= INEXACT;
        if magnitude < f64::powi(2.0, -14) {
            *flags |= UNDERFLOW;
        }
    }
    // The step's exponent and the number of steps add up to the encoding, carries included.
    let coded = if steps < 1024.0 { steps as u16 } else { ((exponent + 14) as u16) * 1024 + steps as u16 };
    sign | coded
}
