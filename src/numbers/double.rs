//! Sines and cosines in `f64`, within 1 ulp.

use crate::numbers::number::Number;

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

/// Up to this angle (rad) the multiple of π/2 is below 2^20, and [`in_quadrant`] is valid.
pub const LARGEST_RAD: f64 = 1e6;

/// Sines and cosines of `angles` (rad).
///
/// Mirrored angles give exactly mirrored results. Angles beyond ±1e6 rad take a slower path.
#[inline(always)]
pub(crate) fn sines_and_cosines<const N: usize>(angles: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    for (j, x) in angles.iter().enumerate() {
        (sines[j], cosines[j]) = within_range(*x);
    }
    // NaN must take this path, too.
    if !angles.iter().all(|x| x.abs() <= LARGEST_RAD) {
        for (j, x) in angles.iter().enumerate() {
            (sines[j], cosines[j]) = libm::sincos(*x);
        }
    }
    (sines, cosines)
}

#[inline(always)]
fn within_range(x: f64) -> (f64, f64) {
    let (shifted, sine, cosine) = in_quadrant(x);
    let quadrant = shifted.to_bits();
    let odd = quadrant & 1 == 1;
    let (s, c) = if odd { (cosine, sine) } else { (sine, cosine) };
    let sign_of_sine = (quadrant & 2) << 62;
    let sign_of_cosine = (quadrant.wrapping_add(1) & 2) << 62;
    (f64::from_bits(s.to_bits() ^ sign_of_sine), f64::from_bits(c.to_bits() ^ sign_of_cosine))
}

/// Reduces the angle `x = k π/2 + y` with `|y| <= π/4`. Returns a number whose lowest two bits are those of k, then
/// sin y, then cos y. The sine of x is sin y, or, for odd k, cos y, with the opposite sign if `k & 2`; the cosine is
/// the other one, with the opposite sign if `(k + 1) & 2`.
#[inline(always)]
pub fn in_quadrant<T: Number>(x: T) -> (T, T, T) {
    let of = |value: f64| x.constant(value);
    // x = k π/2 + y + e with e the part that does not fit into y.
    let shifted = x * of(TWO_OVER_PI) + of(ROUND);
    let k = shifted - of(ROUND);
    let first = x - k * of(HALF_PI_1);
    let step = k * of(HALF_PI_2);
    let second = first - step;
    let lost = k * of(HALF_PI_3) - ((first - second) - step);
    let y = second - lost;
    let e = (second - y) - lost;

    // sin(y + e) = y + y³ p(y²) + e (1 - y²/2),  cos(y + e) = 1 - y²/2 + y⁴ q(y²) - y e
    let z = y * y;
    let p = of(S[1]) + z * (of(S[2]) + z * (of(S[3]) + z * (of(S[4]) + z * of(S[5]))));
    let y3 = z * y;
    let sine = y - ((z * (of(0.5) * e - y3 * p) - e) - y3 * of(S[0]));
    let q = z * (of(C[0]) + z * (of(C[1]) + z * (of(C[2]) + z * (of(C[3]) + z * (of(C[4]) + z * of(C[5]))))));
    let half = of(0.5) * z;
    let w = of(1.0) - half;
    let cosine = w + (((of(1.0) - w) - half) + (z * q - y * e));
    (shifted, sine, cosine)
}
