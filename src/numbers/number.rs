//! The scalar type of tables and of the control law.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A number of the equations of motion: a [`Scalar`], or on the host a vector with one number for each of several
/// plants.
pub trait Number:
    nalgebra::Scalar
    + Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// `value`, rounded to this type; for a vector, the same value in each of as many entries as `self` has.
    fn constant(self, value: f64) -> Self;

    /// Sines and cosines of `angles` (rad), with the same bits on every machine; mirrored angles give exactly mirrored
    /// results.
    fn sines_and_cosines<const N: usize>(angles: &[Self; N]) -> ([Self; N], [Self; N]);
}

/// A number of the control law and the equations of motion: `f32` in the firmware; on the host also `f64`, to compare
/// the firmware with the same law in double precision and to simulate.
pub trait Scalar: Number + Default + PartialOrd {
    /// Converts from `f32`, exactly.
    fn from_f32(value: f32) -> Self;

    /// Converts encoder counts, rounded to this type.
    fn from_counts(counts: i32) -> Self;

    /// Converts to `f32` for the power stage, rounded.
    fn to_f32(self) -> f32;

    /// Whether the value is neither infinite nor NaN.
    fn is_finite(self) -> bool;
}
