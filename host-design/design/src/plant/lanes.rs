//! Numbers of several plants side by side in one SIMD vector.

// Iterators are not inlined everywhere, and vectors are fast only in a function that is compiled for them.
#![allow(clippy::needless_range_loop)]

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};
use core::slice::from_ref;

use pulp::{Simd, bytemuck};
use upright::plant::{LARGEST_RAD, in_quadrant};
use upright::table::Number;

/// A SIMD vector of `f64`, one number per plant. Every operation has in each lane the same bits as the operation on an
/// `f64`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    values: S::f64s,
}

impl<S: Simd> Lanes<S> {
    /// `value` in all lanes.
    #[inline(always)]
    pub(super) fn splat(simd: S, value: f64) -> Self {
        Self { simd, values: simd.splat_f64s(value) }
    }

    /// Loads a vector from `numbers`, starting at index `first`. Panics if fewer numbers than lanes are left.
    #[inline(always)]
    pub(super) fn load(simd: S, numbers: &[f64], first: usize) -> Self {
        Self { simd, values: S::as_simd_f64s(&numbers[first..first + S::F64_LANES]).0[0] }
    }

    /// Stores the vector in `numbers`, starting at index `first`. Panics if fewer numbers than lanes are left.
    #[inline(always)]
    pub(super) fn store(self, numbers: &mut [f64], first: usize) {
        S::as_mut_simd_f64s(&mut numbers[first..first + S::F64_LANES]).0[0] = self.values;
    }

    fn as_slice(&self) -> &[f64] {
        bytemuck::cast_slice(from_ref(&self.values))
    }

    /// Sine and cosine, and flags that are 0 in the lanes where both are valid: the angle is at most [`LARGEST_RAD`].
    #[inline(always)]
    fn sine_and_cosine(self) -> (Self, Self, S::u64s) {
        let simd = self.simd;
        let (quadrant, sine, cosine) = in_quadrant(self);
        let bits = |lanes: Self| simd.transmute_u64s_f64s(lanes.values);
        let numbers = |bits| Self { simd, values: simd.transmute_f64s_u64s(bits) };
        let (one, two) = (simd.splat_u64s(1), simd.splat_u64s(2));
        let (none, sign) = (simd.splat_u64s(0), simd.splat_u64s(1 << 63));
        let quadrant = bits(quadrant);
        // `then` in the lanes where this bit of the number is set.
        let where_set = |number, bit, then| {
            simd.select_u64s(simd.equal_u64s(simd.and_u64s(number, bit), bit), then, none)
        };
        let exchange = where_set(quadrant, one, simd.xor_u64s(bits(sine), bits(cosine)));
        let sine = simd.xor_u64s(simd.xor_u64s(bits(sine), exchange), where_set(quadrant, two, sign));
        let next = simd.add_u64s(quadrant, one);
        let cosine = simd.xor_u64s(simd.xor_u64s(bits(cosine), exchange), where_set(next, two, sign));
        let magnitude = simd.transmute_f64s_u64s(simd.and_u64s(bits(self), simd.splat_u64s(u64::MAX >> 1)));
        // The comparison is false for NaN, so NaN counts as out of range.
        let in_range = simd.less_than_or_equal_f64s(magnitude, simd.splat_f64s(LARGEST_RAD));
        (numbers(sine), numbers(cosine), simd.select_u64s(in_range, none, one))
    }
}

impl<S: Simd> PartialEq for Lanes<S> {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

macro_rules! operation {
    ($trait:ident, $name:ident, $of_simd:ident $(, $assign_trait:ident, $assign:ident)?) => {
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { simd: self.simd, values: self.simd.$of_simd(self.values, other.values) }
            }
        }

        $(impl<S: Simd> $assign_trait for Lanes<S> {
            #[inline(always)]
            fn $assign(&mut self, other: Self) {
                self.values = self.simd.$of_simd(self.values, other.values);
            }
        })?
    };
}

operation!(Add, add, add_f64s, AddAssign, add_assign);
operation!(Sub, sub, sub_f64s, SubAssign, sub_assign);
operation!(Mul, mul, mul_f64s, MulAssign, mul_assign);
operation!(Div, div, div_f64s);

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let sign = self.simd.splat_u64s(1 << 63);
        let bits = self.simd.xor_u64s(self.simd.transmute_u64s_f64s(self.values), sign);
        Self { values: self.simd.transmute_f64s_u64s(bits), ..self }
    }
}

impl<S: Simd> Number for Lanes<S> {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn sines_and_cosines<const N: usize>(angles: &[Self; N]) -> ([Self; N], [Self; N]) {
        let (mut sines, mut cosines) = (*angles, *angles);
        let Some(first) = angles.first() else { return (sines, cosines) };
        let mut beyond = first.simd.splat_u64s(0);
        for j in 0..N {
            let (sine, cosine, wrong) = angles[j].sine_and_cosine();
            (sines[j], cosines[j]) = (sine, cosine);
            beyond = first.simd.or_u64s(beyond, wrong);
        }
        let beyond: &[u64] = bytemuck::cast_slice(from_ref(&beyond));
        let mut any = 0;
        for lane in 0..S::F64_LANES {
            any |= beyond[lane];
        }
        if any != 0 {
            one_by_one(angles, &mut sines, &mut cosines);
        }
        (sines, cosines)
    }
}

/// Fallback for angles out of range: computes each lane as an `f64`.
#[cold]
#[inline(never)]
fn one_by_one<S: Simd, const N: usize>(
    angles: &[Lanes<S>; N],
    sines: &mut [Lanes<S>; N],
    cosines: &mut [Lanes<S>; N],
) {
    for lane in 0..S::F64_LANES {
        let (sine, cosine) = f64::sines_and_cosines(&angles.map(|angle| angle.as_slice()[lane]));
        for j in 0..N {
            bytemuck::cast_slice_mut::<_, f64>(core::slice::from_mut(&mut sines[j].values))[lane] = sine[j];
            bytemuck::cast_slice_mut::<_, f64>(core::slice::from_mut(&mut cosines[j].values))[lane] =
                cosine[j];
        }
    }
}
