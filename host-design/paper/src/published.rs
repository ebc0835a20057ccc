//! What the paper prints: F. J. Ticona Coaquira, "Design and comparison of two linear controllers with precompensation
//! gain for the Quadruple inverted pendulum". All code takes these numbers from here.

use upright::table::Law;

/// A of the paper, by rows: six significant digits (without insignificant zeros).
pub const A: [[&str; 10]; 10] = [
    ["0", "1", "0", "0", "0", "0", "0", "0", "0", "0"],
    ["0", "0", "28.2528", "0", "-5.53284", "0", "0.94176", "0", "-0.11772", "0"],
    ["0", "0", "0", "1", "0", "0", "0", "0", "0", "0"],
    ["0", "0", "1608.84", "0", "-1659.85", "0", "282.528", "0", "-35.316", "0"],
    ["0", "0", "0", "0", "0", "1", "0", "0", "0", "0"],
    ["0", "0", "-1932.57", "0", "3375.62", "0", "-1200.74", "0", "150.093", "0"],
    ["0", "0", "0", "0", "0", "0", "0", "1", "0", "0"],
    ["0", "0", "374.181", "0", "-1983.16", "0", "1634.63", "0", "-361.989", "0"],
    ["0", "0", "0", "0", "0", "0", "0", "0", "0", "1"],
    ["0", "0", "-62.2234", "0", "329.784", "0", "-883.573", "0", "599.195", "0"],
];

/// B of the paper: six significant digits.
pub const B: [&str; 10] = ["0", "7.76", "0", "328", "0", "-394", "0", "76.2857", "0", "-12.6857"];

/// K (two decimals) and N (four decimals) of a law.
pub fn gains(law: Law) -> (&'static [&'static str; 10], &'static str) {
    match law {
        Law::Lqr => (&LQR_K, LQR_N),
        Law::PolePlacement => (&PLACEMENT_K, PLACEMENT_N),
    }
}

/// K of the LQR, two decimals.
pub const LQR_K: [&str; 10] =
    ["3.16", "3.68", "-14.60", "-5.75", "-163.85", "-5.33", "529.74", "1.78", "-578.51", "-25.21"];

/// N of the LQR, four decimals.
pub const LQR_N: &str = "3.1623";

/// K of the pole placement, two decimals.
pub const PLACEMENT_K: [&str; 10] =
    ["11.01", "24.56", "-205.41", "-38.72", "-262.18", "-37.70", "147.26", "-35.33", "-1056.26", "-55.37"];

/// N of the pole placement, four decimals.
pub const PLACEMENT_N: &str = "11.0072";

/// The diagonal of Q as printed: 15 entries for 10 states.
pub const Q_DIAGONAL: [f64; 15] =
    [10.0, 1.0, 10.0, 1.0, 1.0, 10.0, 1.0, 1.0, 10.0, 1.0, 1.0, 10.0, 1.0, 10.0, 1.0];

/// Overshoot wanted from the dominant pair (%).
pub const OVERSHOOT_PERCENT: f64 = 1.0;

/// Settling time wanted from the dominant pair (s).
pub const SETTLING_TIME_S: f64 = 6.0;

/// Table 2: settling time asked for (s), and whether the paper calls the response stabilised.
pub const TABLE_2: [(f64, bool); 7] =
    [(3.0, false), (4.0, false), (5.0, true), (6.0, true), (7.0, true), (8.0, false), (9.0, false)];

/// Variance of the disturbing force (N²).
pub const FORCE_VARIANCE_N2: f64 = 0.01;

/// Variance of the disturbing torque at each joint ((N·m)²).
pub const TORQUE_VARIANCE_N2_M2: f64 = 1e-9;
