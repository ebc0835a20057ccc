//! Structure-preserving doubling: the one iteration behind both Riccati equations.

use crate::numerics::{Lu, Matrix, Real};

/// The iteration broke down; the caller tries another shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Breakdown;

/// The stabilising solution `X` of `X = Aᵀ X (I + G X)⁻¹ A + H` with symmetric `G` and `H`.
///
/// SDA (Chu, Fan, Lin, Wang, *Int. J. Control* 77, 2004): with `W = I + G H`,
///
/// ```text
/// A⁺ = A W⁻¹ A,   G⁺ = G + A W⁻¹ G Aᵀ,   H⁺ = H + Aᵀ H W⁻¹ A,   H → X
/// ```
///
/// Each step squares the closed loop, so the error falls as ρ^(2^k).
pub(super) fn doubling<R: Real>(a: &Matrix<R>, g: &Matrix<R>, h: &Matrix<R>) -> Result<Matrix<R>, Breakdown> {
    // 80 doublings resolve a closed loop within 2^-70 of the stability boundary; a loop on the boundary gains one
    // bit a step and never gets there.
    const MOST_DOUBLINGS: usize = 80;
    let identity = Matrix::identity(a.rows());
    let (mut a, mut g, mut h) = (a.clone(), g.clone(), h.clone());
    let tolerance = R::epsilon().scale_by_power_of_two(4);
    for _ in 0..MOST_DOUBLINGS {
        let w = Lu::new(&(&identity + &(&g * &h))).map_err(|_| Breakdown)?;
        let w_a = w.solve(&a);
        let w_g = w.solve(&g);
        let a_transposed = a.transpose();
        let increment = (&a_transposed * &h).symmetric_product(&w_a);
        g = &g + &(&a * &w_g).symmetric_product(&a_transposed);
        a = &a * &w_a;
        h = &h + &increment;
        if !(h.is_finite() && g.is_finite() && a.is_finite()) {
            return Err(Breakdown);
        }
        // The next increment is of the order of (‖A⁺‖ / ‖A‖)² of this one: this test is already conservative.
        if increment.norm() <= h.norm() * &tolerance {
            return Ok(h);
        }
    }
    Err(Breakdown)
}

/// Whether every eigenvalue of `a` lies strictly inside the unit circle: some power `2^k` has norm below 1/2.
pub(super) fn powers_vanish<R: Real>(a: &Matrix<R>) -> bool {
    let half = R::from_f64(0.5);
    let hopeless = R::one().scale_by_power_of_two(R::bits() as i32);
    let mut power = a.clone();
    for _ in 0..90 {
        let norm = power.norm();
        if norm < half {
            return true;
        }
        if !norm.is_finite() || norm > hopeless {
            return false;
        }
        power = &power * &power;
    }
    false
}

/// Symmetric shifts `c I` of the unknown to try, starting with zero: a shift makes a singular control weight or a
/// weightless unstable mode harmless without changing the solution.
pub(super) fn solution_shifts<R: Real>(size: usize) -> impl Iterator<Item = Matrix<R>> {
    [0.0, 0.37, 23.0, 0.0047].into_iter().map(move |c| Matrix::identity(size).scaled(&R::from_f64(c)))
}
