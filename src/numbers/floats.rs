//! The numbers of the firmware, `f32`, and of the host, `f64`.

use super::number::{Number, Scalar};
use super::{double, single};

macro_rules! scalar {
    ($type:ty, $sines_and_cosines:path) => {
        impl Number for $type {
            #[inline(always)]
            fn constant(self, value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn sines_and_cosines<const N: usize>(angles: &[Self; N]) -> ([Self; N], [Self; N]) {
                $sines_and_cosines(angles)
            }
        }

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

scalar!(f32, single::sines_and_cosines);
scalar!(f64, double::sines_and_cosines);
