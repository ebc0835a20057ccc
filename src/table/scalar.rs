//! The scalar type of tables and of the control law.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A floating-point type for the control law: `f32` in the firmware, `f64` on the host, which compares the firmware
/// with the same law in double precision.
pub trait Scalar:
    nalgebra::Scalar
    + Copy
    + Default
    + PartialOrd
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// Converts from `f32`, exactly.
    fn from_f32(value: f32) -> Self;

    /// Converts encoder counts, rounded to this type.
    fn from_counts(counts: i32) -> Self;

    /// Converts to `f32` for the power stage, rounded.
    fn to_f32(self) -> f32;

    /// Whether the value is neither infinite nor NaN.
    fn is_finite(self) -> bool;
}

macro_rules! scalar {
    ($type:ty) => {
        impl Scalar for $type {
            #[inline(always)]
            fn from_f32(value: f32) -> Self {
                value.into()
            }

            #[inline(always)]
            fn from_counts(counts: i32) -> Self {
                counts as Self
            }

            #[inline(always)]
            fn to_f32(self) -> f32 {
                self as f32
            }

            #[inline(always)]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
        }
    };
}

scalar!(f32);
scalar!(f64);
