//! Sine and cosine of several angles at once, without branches, so that the compiler can vectorise it.

// 2/π, and π/2 as a sum of three parts. The first two have 33 bits, so an integer below 2^20 times such a part is
// exact (W. J. Cody and W. Waite, Software Manual for the Elementary Functions, 1980). The values and the minimax
// coefficients on [-π/4, π/4] below are those of fdlibm (Sun Microsystems, 1993).
const TWO_OVER_PI: f64 = core::f64::consts::FRAC_2_PI;
const HALF_PI_1: f64 = 1.5707963267341256;
const HALF_PI_2: f64 = 6.077100506303966e-11;
const HALF_PI_3: f64 = 2.0222662487959506e-21;

const S: [f64; 6] = [
    -0.16666666666666632,
    0.00833333333332249,
    -0.0001984126982985795,
    2.7557313707070068e-06,
    -2.5050760253406863e-08,
    1.58969099521155e-10,
];
const C: [f64; 6] = [
    0.0416666666666666,
    -0.001388888888887411,
    2.480158728947673e-05,
    -2.7557314351390663e-07,
    2.087572321298175e-09,
    -1.1359647557788195e-11,
];

/// Adding and then subtracting this rounds to the nearest integer, ties to even, so both signs round alike. The lowest
/// bits of the sum are those of that integer (in two's complement).
const ROUND: f64 = 1.5 * (1u64 << 52) as f64;

/// Up to this angle (rad) the multiple of π/2 is below 2^20.
const LARGEST: f64 = 1e6;

/// Sines and cosines of `angles` (rad), as (sines, cosines), within 1 ulp.
///
/// Mirrored angles give exactly mirrored results. Angles beyond ±1e6 rad take a slower path.
#[inline]
pub fn sin_cos<const N: usize>(angles: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    for ((x, sine), cosine) in angles.iter().zip(&mut sines).zip(&mut cosines) {
        (*sine, *cosine) = within_range(*x);
    }
    // NaN must take this path, too.
    if !angles.iter().all(|x| x.abs() <= LARGEST) {
        for ((x, sine), cosine) in angles.iter().zip(&mut sines).zip(&mut cosines) {
            (*sine, *cosine) = libm::sincos(*x);
        }
    }
    (sines, cosines)
}

#[inline(always)]
fn within_range(x: f64) -> (f64, f64) {
    // x = k π/2 + y + e with |y| <= π/4 and e the part that does not fit into y.
    let shifted = x * TWO_OVER_PI + ROUND;
    let k = shifted - ROUND;
    let quadrant = shifted.to_bits();
    let first = x - k * HALF_PI_1;
    let step = k * HALF_PI_2;
    let second = first - step;
    let lost = k * HALF_PI_3 - ((first - second) - step);
    let y = second - lost;
    let e = (second - y) - lost;

    // sin(y + e) = y + y³ p(y²) + e (1 - y²/2),  cos(y + e) = 1 - y²/2 + y⁴ q(y²) - y e
    let z = y * y;
    let p = S[1] + z * (S[2] + z * (S[3] + z * (S[4] + z * S[5])));
    let y3 = z * y;
    let sine = y - ((z * (0.5 * e - y3 * p) - e) - y3 * S[0]);
    let q = z * (C[0] + z * (C[1] + z * (C[2] + z * (C[3] + z * (C[4] + z * C[5])))));
    let half = 0.5 * z;
    let w = 1.0 - half;
    let cosine = w + (((1.0 - w) - half) + (z * q - y * e));

    let odd = quadrant & 1 == 1;
    let (s, c) = if odd { (cosine, sine) } else { (sine, cosine) };
    let sign_of_sine = (quadrant & 2) << 62;
    let sign_of_cosine = (quadrant.wrapping_add(1) & 2) << 62;
    (f64::from_bits(s.to_bits() ^ sign_of_sine), f64::from_bits(c.to_bits() ^ sign_of_cosine))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{Real, Wide};
    use proptest::prelude::*;

    /// Units in the last place between two results of the same sign.
    fn ulps(a: f64, b: f64) -> u64 {
        if a == b { 0 } else { (a.to_bits() as i64).abs_diff(b.to_bits() as i64) }
    }

    fn worst_ulps(x: f64) -> u64 {
        let ([s], [c]) = sin_cos(&[x]);
        ulps(s, libm::sin(x)).max(ulps(c, libm::cos(x)))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn results_agree_with_libm_to_the_last_place(x in -1.2e6..1.2e6f64, small in -10.0..10.0f64, exponent in -40..1) {
            prop_assert!(worst_ulps(x) <= 1);
            prop_assert!(worst_ulps(small) <= 1);
            prop_assert!(worst_ulps(libm::scalbn(small, exponent)) <= 1);
        }

        #[test]
        fn results_near_a_multiple_of_a_right_angle_keep_their_last_place(k in -600_000..600_000i32, offset in -3..4i64) {
            let x = f64::from_bits((f64::from(k) * core::f64::consts::FRAC_PI_2).to_bits().wrapping_add_signed(offset));
            prop_assert!(k == 0 || worst_ulps(x) <= 1);
        }

        #[test]
        fn mirrored_angles_give_mirrored_results(x in -1e6..1e6f64) {
            let (s, c) = sin_cos(&[x, -x]);
            prop_assert_eq!(s[0].to_bits(), (-s[1]).to_bits());
            prop_assert_eq!(c[0].to_bits(), c[1].to_bits());
        }
    }

    #[test]
    fn nearly_all_results_are_the_correctly_rounded_ones() {
        let mut rounded_wrongly = 0;
        for i in -2000..2000 {
            let x = f64::from(i) * 0.37 + 1e-3;
            let exact = Wide::from_f64(x);
            let ([s], [c]) = sin_cos(&[x]);
            let errors = [ulps(s, exact.sin().to_f64()), ulps(c, exact.cos().to_f64())];
            assert!(errors.iter().all(|&error| error <= 1), "at {x}");
            rounded_wrongly += errors.iter().sum::<u64>();
        }
        // 247 of 8000; without the correction e in the cosine, 432.
        assert!(rounded_wrongly < 300, "{rounded_wrongly}");
    }

    #[test]
    fn special_angles_are_exact() {
        let (s, c) = sin_cos(&[0.0, 1e300, f64::INFINITY, f64::NAN]);
        assert_eq!((s[0], c[0]), (0.0, 1.0));
        assert_eq!((s[1], c[1]), (libm::sin(1e300), libm::cos(1e300)));
        assert!(s[2].is_nan() && c[2].is_nan() && s[3].is_nan() && c[3].is_nan());
    }
}
