//! The control law and its limit.

use nalgebra::SVector;

/// State feedback with precompensation, `u = N r - K x` (the paper's control law).
///
/// `k` has one gain per state: N/m, N·s/m, N/rad, N·s/rad …; `n` is in N per unit of the set-point `r`.
/// The terms are added in the order of the states, so that every machine gets the same bits.
pub fn state_feedback<const NX: usize>(n: f32, r: f32, k: &SVector<f32, NX>, x: &SVector<f32, NX>) -> f32 {
    let mut u = n * r;
    for (k, x) in k.iter().zip(x.iter()) {
        u -= k * x;
    }
    u
}

/// `u` limited to ±`limit`; 0 if `u` is not a number, because a motor must never be driven by one.
pub fn saturate(u: f32, limit: f32) -> f32 {
    if u > limit {
        limit
    } else if u < -limit {
        -limit
    } else if u.is_nan() {
        0.0
    } else {
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    #[test]
    fn the_law_is_n_r_minus_k_x() {
        assert_eq!(state_feedback(3.0, 2.0, &vector![1.0, 0.5], &vector![4.0, -2.0]), 3.0);
    }

    #[test]
    fn the_limit_holds_on_both_sides_and_not_a_number_means_no_force() {
        assert_eq!(saturate(7.0, 5.0), 5.0);
        assert_eq!(saturate(-7.0, 5.0), -5.0);
        assert_eq!(saturate(4.0, 5.0), 4.0);
        assert_eq!(saturate(f32::INFINITY, 5.0), 5.0);
        assert_eq!(saturate(f32::NAN, 5.0), 0.0);
    }
}
