//! The scalar type of the numeric routines.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A real number at some working precision: `f64`, or [`Wide`](super::Wide) at the thread's working precision.
///
/// Operands on the right are taken by reference, so that a formula reads `a.clone() * b + c` for big
/// floats and costs nothing for `f64`.
pub trait Real:
    Clone
    + Debug
    + PartialOrd
    + Neg<Output = Self>
    + for<'a> Add<&'a Self, Output = Self>
    + for<'a> Sub<&'a Self, Output = Self>
    + for<'a> Mul<&'a Self, Output = Self>
    + for<'a> Div<&'a Self, Output = Self>
{
    /// Bits in the significand.
    fn bits() -> usize;

    /// The exact value of `x`.
    fn from_f64(x: f64) -> Self;
    /// The nearest `f64`, ties to even; overflows to infinity.
    fn to_f64(&self) -> f64;
    /// Square root.
    fn sqrt(&self) -> Self;
    /// `e^self`.
    fn exp(&self) -> Self;
    /// Natural logarithm.
    fn ln(&self) -> Self;
    /// Sine of an angle in radians.
    fn sin(&self) -> Self;
    /// Cosine of an angle in radians.
    fn cos(&self) -> Self;
    /// π at working precision.
    fn pi() -> Self;
    /// Whether the number is neither infinite nor NaN.
    fn is_finite(&self) -> bool;
    /// `self · 2^power`, exact unless it overflows or underflows.
    fn scale_by_power_of_two(&self, power: i32) -> Self;

    /// `self · other`, without the copy that the operator needs.
    #[inline]
    fn times(&self, other: &Self) -> Self {
        self.clone() * other
    }
    /// `self - other`, without the copy that the operator needs.
    #[inline]
    fn minus(&self, other: &Self) -> Self {
        self.clone() - other
    }
    /// 0.
    #[inline]
    fn zero() -> Self {
        Self::from_f64(0.0)
    }
    /// 1.
    fn one() -> Self {
        Self::from_f64(1.0)
    }
    /// `2^(1 - bits)`, the distance from 1 to the next larger number.
    fn epsilon() -> Self {
        Self::one().scale_by_power_of_two(1 - Self::bits() as i32)
    }
    /// Absolute value.
    #[inline]
    fn abs(&self) -> Self {
        if *self < Self::zero() { -self.clone() } else { self.clone() }
    }
    /// Whether the number is exactly zero.
    #[inline]
    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
    /// The larger of two numbers.
    fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }
}

impl Real for f64 {
    fn bits() -> usize {
        53
    }

    #[inline]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline]
    fn to_f64(&self) -> f64 {
        *self
    }
    fn sqrt(&self) -> Self {
        libm::sqrt(*self)
    }
    fn exp(&self) -> Self {
        libm::exp(*self)
    }
    fn ln(&self) -> Self {
        libm::log(*self)
    }
    fn sin(&self) -> Self {
        libm::sin(*self)
    }
    fn cos(&self) -> Self {
        libm::cos(*self)
    }
    fn pi() -> Self {
        core::f64::consts::PI
    }
    #[inline]
    fn is_finite(&self) -> bool {
        f64::is_finite(*self)
    }
    #[inline]
    fn scale_by_power_of_two(&self, power: i32) -> Self {
        match power {
            // The usual case without a call.
            -1 => 0.5 * self,
            power => libm::scalbn(*self, power),
        }
    }
}
