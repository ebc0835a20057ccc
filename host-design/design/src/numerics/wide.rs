//! Extended precision: a pure-Rust big float whose number of bits is set per thread, for the duration of a call.

use core::cmp::Ordering;
use core::ops::{Add, Div, Mul, Neg, Sub};
use std::cell::{Cell, RefCell};

use astro_float_num::{BigFloat, Consts, RoundingMode, Sign, WORD_BIT_SIZE};

use super::Real;

const ROUNDING: RoundingMode = RoundingMode::ToEven;

thread_local! {
    /// Digits of π, ln 2 … computed once per thread.
    static CONSTANTS: RefCell<Option<Consts>> = const { RefCell::new(None) };
    /// Bits that [`with_precision`] set.
    static PRECISION_BITS: Cell<usize> = const { Cell::new(256) };
}

/// Runs `calculate` on this thread with significands of `bits` bits (a multiple of 64) instead of 256. Threads that
/// `calculate` starts use 256 bits again.
pub fn with_precision<T>(bits: usize, calculate: impl FnOnce() -> T) -> T {
    struct Restore(usize);
    impl Drop for Restore {
        fn drop(&mut self) {
            PRECISION_BITS.set(self.0);
        }
    }
    let _restore = Restore(PRECISION_BITS.replace(bits));
    calculate()
}

/// A real number in extended precision. Each operation rounds its result to the thread's working precision
/// ([`with_precision`]), to nearest with ties to even.
///
/// The precision is not a type parameter, because the whole design would then be compiled once per precision.
#[derive(Clone, Debug)]
pub struct Wide(BigFloat);

impl Wide {
    /// Rounds away the last quarter of the significand, where a long calculation leaves its rounding errors. A result
    /// that is exactly a short number then comes out as that number.
    fn without_noise(&self) -> BigFloat {
        let mut short = self.0.clone();
        // Fails only for a precision out of range, which a shorter precision never is.
        let _ = short.set_precision(Self::bits() - Self::bits() / 4, ROUNDING);
        short
    }

    /// The nearest `f64`, after the calculation's rounding errors are dropped.
    pub fn round_to_f64(&self) -> f64 {
        f64::from_bits(nearest(&self.without_noise(), &DOUBLE))
    }

    /// The nearest `f32`, after the calculation's rounding errors are dropped: rounded once, never through `f64`.
    pub fn round_to_f32(&self) -> f32 {
        f32::from_bits(nearest(&self.without_noise(), &SINGLE) as u32)
    }

    fn with_constants(&self, f: impl FnOnce(&BigFloat, &mut Consts) -> BigFloat) -> Self {
        CONSTANTS.with_borrow_mut(|slot| {
            if slot.is_none() {
                *slot = Consts::new().ok();
            }
            Self(match slot {
                Some(constants) => f(&self.0, constants),
                // Out of memory: the caller sees a value that is not finite.
                None => BigFloat::nan(None),
            })
        })
    }
}

impl PartialEq for Wide {
    fn eq(&self, other: &Self) -> bool {
        self.partial_cmp(other) == Some(Ordering::Equal)
    }
}

impl PartialOrd for Wide {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.0.cmp(&other.0).map(|sign| sign.cmp(&0))
    }
}

impl Neg for Wide {
    type Output = Self;
    fn neg(mut self) -> Self {
        self.0.inv_sign();
        self
    }
}

impl Add<&Self> for Wide {
    type Output = Self;
    fn add(self, other: &Self) -> Self {
        Self(self.0.add(&other.0, Self::bits(), ROUNDING))
    }
}

impl Sub<&Self> for Wide {
    type Output = Self;
    fn sub(self, other: &Self) -> Self {
        self.minus(other)
    }
}

impl Mul<&Self> for Wide {
    type Output = Self;
    fn mul(self, other: &Self) -> Self {
        self.times(other)
    }
}

impl Div<&Self> for Wide {
    type Output = Self;
    fn div(self, other: &Self) -> Self {
        Self(self.0.div(&other.0, Self::bits(), ROUNDING))
    }
}

impl Real for Wide {
    fn bits() -> usize {
        PRECISION_BITS.get()
    }

    fn from_f64(x: f64) -> Self {
        if x.is_subnormal() {
            // astro-float-num 0.3.7 reads subnormal numbers as half their value.
            let normal = x * f64::from_bits((1023 + 64) << 52);
            return Self(BigFloat::from_f64(normal, Self::bits())).scale_by_power_of_two(-64);
        }
        Self(BigFloat::from_f64(x, Self::bits()))
    }
    fn to_f64(&self) -> f64 {
        f64::from_bits(nearest(&self.0, &DOUBLE))
    }
    fn sqrt(&self) -> Self {
        Self(self.0.sqrt(Self::bits(), ROUNDING))
    }
    fn exp(&self) -> Self {
        self.with_constants(|x, constants| x.exp(Self::bits(), ROUNDING, constants))
    }
    fn ln(&self) -> Self {
        self.with_constants(|x, constants| x.ln(Self::bits(), ROUNDING, constants))
    }
    fn sin(&self) -> Self {
        self.with_constants(|x, constants| x.sin(Self::bits(), ROUNDING, constants))
    }
    fn cos(&self) -> Self {
        self.with_constants(|x, constants| x.cos(Self::bits(), ROUNDING, constants))
    }
    fn pi() -> Self {
        Self::zero().with_constants(|_, constants| constants.pi(Self::bits(), ROUNDING))
    }
    fn times(&self, other: &Self) -> Self {
        Self(self.0.mul(&other.0, Self::bits(), ROUNDING))
    }
    fn minus(&self, other: &Self) -> Self {
        Self(self.0.sub(&other.0, Self::bits(), ROUNDING))
    }
    fn abs(&self) -> Self {
        Self(self.0.abs())
    }
    fn is_zero(&self) -> bool {
        self.0.is_zero()
    }
    fn is_finite(&self) -> bool {
        !(self.0.is_nan() || self.0.is_inf())
    }
    fn scale_by_power_of_two(&self, power: i32) -> Self {
        let mut scaled = self.0.clone();
        if let Some(exponent) = scaled.exponent()
            && !scaled.is_zero()
        {
            scaled.set_exponent(exponent.saturating_add(power));
        }
        Self(scaled)
    }
}

/// An IEEE 754 binary interchange format of at most 64 bits.
struct Format {
    significand_bits: i64,
    /// Exponent `e` of the largest finite number, as in `1.f · 2^e`.
    max_exponent: i64,
    sign_shift: u32,
}

const DOUBLE: Format = Format { significand_bits: 53, max_exponent: 1023, sign_shift: 63 };
const SINGLE: Format = Format { significand_bits: 24, max_exponent: 127, sign_shift: 31 };

/// The bits of the number nearest to `x` in `format`: ties to even, gradual underflow, overflow to infinity.
fn nearest(x: &BigFloat, format: &Format) -> u64 {
    let fraction_bits = format.significand_bits - 1;
    let infinity = ((2 * format.max_exponent + 1) as u64) << fraction_bits;
    let sign = u64::from(x.sign() == Some(Sign::Neg)) << format.sign_shift;
    if x.is_inf() {
        return sign | infinity;
    }
    let Some((words, _, _, exponent, _)) = x.as_raw_parts() else {
        return infinity | 1 << (fraction_bits - 1); // NaN
    };
    if x.is_zero() {
        return sign;
    }
    // x = 0.w · 2^exponent with the top bit of the last word set: 1.f · 2^(exponent - 1). Words have 64 bits, or 32.
    let (rest, high) = words.split_at(words.len().saturating_sub(64 / WORD_BIT_SIZE));
    #[allow(clippy::unnecessary_cast, reason = "a word has 32 bits in a browser")]
    let top = high.iter().rfold(0, |top: u64, &word| top.unbounded_shl(WORD_BIT_SIZE as u32) | word as u64);
    let sticky = rest.iter().any(|&word| word != 0);
    let exponent = i64::from(exponent) - 1;
    let min_exponent = 1 - format.max_exponent;
    // Subnormal numbers keep fewer bits.
    let kept = format.significand_bits - (min_exponent - exponent).max(0);
    if kept < 0 {
        return sign;
    }
    let dropped = 64 - kept as u32;
    let (mut significand, remainder) = if dropped == 64 {
        (0, u128::from(top))
    } else {
        (top >> dropped, u128::from(top & ((1 << dropped) - 1)))
    };
    let half = 1u128 << (dropped - 1);
    let round_up = remainder > half || (remainder == half && (sticky || significand & 1 == 1));
    significand += u64::from(round_up);
    if exponent < min_exponent {
        // A carry into the hidden bit gives the smallest normal number, with the right encoding.
        return sign | significand;
    }
    // Adding (not or-ing) lets a carry out of the significand raise the exponent.
    let biased = (exponent + format.max_exponent - 1) as u64;
    let bits = (biased << fraction_bits) + significand;
    sign | bits.min(infinity)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type W = Wide;

    proptest! {
        #[test]
        fn every_double_survives_the_way_through_extended_precision(bits: u64) {
            let x = f64::from_bits(bits);
            prop_assume!(x.is_finite());
            prop_assert_eq!(W::from_f64(x).to_f64().to_bits(), x.to_bits());
        }

        #[test]
        fn conversion_rounds_as_the_processor_does(a in -1e30..1e30f64, b in 1e-30..1e30f64) {
            // One IEEE division is correctly rounded; so is the wide quotient rounded once.
            prop_assert_eq!((W::from_f64(a) / &W::from_f64(b)).to_f64(), a / b);
            prop_assert_eq!(W::from_f64(b).sqrt().to_f64(), b.sqrt());
            prop_assert_eq!(W::from_f64(a).round_to_f32(), a as f32);
        }

        #[test]
        fn tiny_numbers_round_into_the_subnormal_range(bits in 0u64..1 << 54, divisor in 1.0..1e6f64) {
            let x = f64::from_bits(bits);
            prop_assert_eq!((W::from_f64(x) / &W::from_f64(divisor)).to_f64(), x / divisor);
        }
    }

    #[test]
    fn overflow_becomes_infinity_and_infinity_stays() {
        let huge = W::from_f64(f64::MAX) * &W::from_f64(2.0);
        assert_eq!(huge.to_f64(), f64::INFINITY);
        assert_eq!((-huge).to_f64(), f64::NEG_INFINITY);
        assert_eq!(W::from_f64(f64::INFINITY).to_f64(), f64::INFINITY);
        assert_eq!(W::from_f64(1e300).round_to_f32(), f32::INFINITY);
        assert!(W::from_f64(f64::NAN).to_f64().is_nan());
    }

    #[test]
    fn transcendental_functions_agree_with_known_digits() {
        assert_eq!(W::pi().to_f64(), core::f64::consts::PI);
        assert_eq!(W::one().exp().to_f64(), core::f64::consts::E);
        assert_eq!(W::from_f64(2.0).ln().to_f64(), core::f64::consts::LN_2);
        let x = W::from_f64(0.7);
        let one = x.sin() * &x.sin() + &(x.cos() * &x.cos());
        assert!((one - &W::one()).abs() < W::epsilon().scale_by_power_of_two(4));
    }

    #[test]
    fn noise_in_the_last_quarter_is_dropped_before_rounding() {
        let exact_tie = W::from_f64(1.0 + f64::from(f32::EPSILON) / 2.0);
        let noisy = exact_tie.clone() + &W::one().scale_by_power_of_two(-250);
        assert_eq!(noisy.round_to_f32(), 1.0);
        assert_eq!(noisy.to_f64(), 1.0 + f64::from(f32::EPSILON) / 2.0);
    }

    #[test]
    fn the_precision_holds_for_its_stretch_of_this_thread_alone() {
        let third = || W::one() / &W::from_f64(3.0);
        let error = |x: W| (x * &W::from_f64(3.0) - &W::one()).abs();
        let (coarse, elsewhere) =
            with_precision(128, || (third(), std::thread::scope(|scope| scope.spawn(third).join().unwrap())));
        with_precision(512, || {
            assert!(error(coarse) > W::one().scale_by_power_of_two(-130));
            assert!(error(elsewhere) < W::one().scale_by_power_of_two(-254));
            assert!(error(third()) < W::one().scale_by_power_of_two(-510));
        });
        assert_eq!(W::bits(), 256);
        let panicked = std::panic::catch_unwind(|| with_precision(64, || panic!("on purpose")));
        assert!(panicked.is_err());
        assert_eq!(W::bits(), 256);
    }
}
