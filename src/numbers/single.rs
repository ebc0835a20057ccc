//! Sines and cosines in `f32`, with an error of at most 1.2e-7.

// 2/π, and π/2 as a sum of three parts. The first two have 8 and 11 bits, so an integer below 2^13 times such a part is
// exact. The coefficients on [-π/4, π/4] are those of Cephes (S. L. Moshier, 1992).
const TWO_OVER_PI: f32 = core::f32::consts::FRAC_2_PI;
const HALF_PI_1: f32 = 1.5703125;
const HALF_PI_2: f32 = 4.837_513e-4;
const HALF_PI_3: f32 = 7.549_79e-8;

const S: [f32; 3] = [-0.166_666_55, 0.008_332_161, -0.000_195_152_96];
const C: [f32; 3] = [0.041_666_646, -0.001_388_731_6, 2.443_315_7e-5];

/// Adding and then subtracting this rounds to the nearest integer; the lowest bits of the sum are those of that
/// integer.
const ROUND: f32 = 1.5 * (1u32 << 23) as f32;

/// Up to this angle (rad) the multiple of π/2 is below 2^13.
const LARGEST: f32 = 8192.0;

/// Sines and cosines of `angles` (rad); NaN beyond ±8192 rad, where a reduced angle would have few correct digits.
///
/// Mirrored angles give exactly mirrored results.
#[inline]
pub(crate) fn sines_and_cosines<const N: usize>(angles: &[f32; N]) -> ([f32; N], [f32; N]) {
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    for (j, x) in angles.iter().enumerate() {
        (sines[j], cosines[j]) = sine_and_cosine(*x);
    }
    (sines, cosines)
}

#[inline(always)]
fn sine_and_cosine(x: f32) -> (f32, f32) {
    let x = if x.abs() <= LARGEST { x } else { f32::NAN };
    // x = k π/2 + y with |y| <= π/4.
    let shifted = x * TWO_OVER_PI + ROUND;
    let k = shifted - ROUND;
    let quadrant = shifted.to_bits();
    let y = ((x - k * HALF_PI_1) - k * HALF_PI_2) - k * HALF_PI_3;
    let z = y * y;
    let sine = y + y * z * (S[0] + z * (S[1] + z * S[2]));
    let cosine = 1.0 - 0.5 * z + z * z * (C[0] + z * (C[1] + z * C[2]));
    let (s, c) = if quadrant & 1 == 1 { (cosine, sine) } else { (sine, cosine) };
    let sign_of_sine = (quadrant & 2) << 30;
    let sign_of_cosine = (quadrant.wrapping_add(1) & 2) << 30;
    (f32::from_bits(s.to_bits() ^ sign_of_sine), f32::from_bits(c.to_bits() ^ sign_of_cosine))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn error(x: f32) -> f64 {
        let ([s], [c]) = sines_and_cosines(&[x]);
        let (sine, cosine) = libm::sincos(f64::from(x));
        (f64::from(s) - sine).abs().max((f64::from(c) - cosine).abs())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn results_are_those_of_double_precision(x in -8192.0..8192.0f32, small in -10.0..10.0f32) {
            prop_assert!(error(small) < 1.2e-7);
            prop_assert!(error(x) < 1.2e-7);
        }

        #[test]
        fn mirrored_angles_give_mirrored_results(x in -8192.0..8192.0f32) {
            let (s, c) = sines_and_cosines(&[x, -x]);
            prop_assert_eq!(s[0].to_bits(), (-s[1]).to_bits());
            prop_assert_eq!(c[0].to_bits(), c[1].to_bits());
        }
    }

    #[test]
    fn an_angle_that_cannot_be_reduced_gives_nan() {
        let (s, c) = sines_and_cosines(&[0.0, 8193.0, f32::INFINITY, f32::NAN]);
        assert_eq!((s[0], c[0]), (0.0, 1.0));
        assert!(s[1..].iter().chain(&c[1..]).all(|value| value.is_nan()));
    }
}
