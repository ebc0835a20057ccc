//! Continuous and sampled algebraic Riccati equations with any number of inputs, full Q, R and a cross term S.

use super::doubling::{Breakdown, doubling, powers_vanish, solution_shifts};
use crate::numerics::{Matrix, Real, solve, solve_right};

/// The quadratic cost of s states x and m inputs u: `xᵀ Q x + 2 xᵀ S u + uᵀ R u`.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost<R> {
    /// Symmetric, s×s.
    pub q: Matrix<R>,
    /// Symmetric, m×m.
    pub r: Matrix<R>,
    /// Cross term, s×m.
    pub s: Matrix<R>,
}

impl<R: Real> Cost<R> {
    /// A cost without cross term.
    pub fn new(q: Matrix<R>, r: Matrix<R>) -> Self {
        let s = Matrix::zeros(q.rows(), r.rows());
        Self { q, r, s }
    }
}

/// A stabilising solution: the cost-to-go matrix and the optimal feedback `u = -K x`.
#[derive(Debug, Clone, PartialEq)]
pub struct Regulator<R> {
    /// Solution of the Riccati equation, symmetric, s×s.
    pub x: Matrix<R>,
    /// Feedback gain, m×s.
    pub k: Matrix<R>,
    /// Residual of the equation at X, relative to the size of its terms.
    pub residual: R,
}

/// No attempt gave a solution that both satisfies the equation and stabilises the loop.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the Riccati equation has no stabilising solution that working precision can resolve")]
pub struct NoStabilisingSolution;

/// Solves the continuous equation `Aᵀ X + X A - (X B + S) R⁻¹ (Bᵀ X + Sᵀ) + Q = 0` for the X with
/// `A - B K` stable, `K = R⁻¹ (Bᵀ X + Sᵀ)`.
///
/// A is s×s, B is s×m. R must be invertible. Method: Cayley transform with shift γ and doubling (Chu, Fan, Lin,
/// *Linear Algebra Appl.* 396, 2005).
///
/// # Errors
/// [`NoStabilisingSolution`]: the pair is not stabilisable, the loop lies on the imaginary axis, R is singular, or
/// this precision does not suffice.
#[doc(alias = "lqr")]
#[doc(alias = "are")]
#[doc(alias = "continuous_are")]
pub fn care<R: Real>(
    a: &Matrix<R>,
    b: &Matrix<R>,
    cost: &Cost<R>,
) -> Result<Regulator<R>, NoStabilisingSolution> {
    let r_inverse = solve(&cost.r, &Matrix::identity(cost.r.rows())).map_err(|_| NoStabilisingSolution)?;
    // Remove the cross term: A - B R⁻¹ Sᵀ and Q - S R⁻¹ Sᵀ.
    let s_r = &cost.s * &r_inverse;
    let a_free = a - &(&(b * &r_inverse) * &cost.s.transpose());
    let q_free = &cost.q - &(&s_r * &cost.s.transpose());
    let g = (&(b * &r_inverse) * &b.transpose()).symmetric_part();

    for x_0 in solution_shifts::<R>(a.rows()) {
        // With X = X₀ + Y, only the linear and constant terms change.
        let g_x = &g * &x_0;
        let a_shifted = &a_free - &g_x;
        let q_shifted = &(&q_free + &(&a_free.transpose() * &x_0)) + &(&(&x_0 * &a_free) - &(&x_0 * &g_x));
        for gamma in cayley_shifts(&a_shifted, &g, &q_shifted) {
            let Ok(y) = care_attempt(&a_shifted, &g, &q_shifted, &gamma) else { continue };
            let x = &x_0 + &y;
            let k = &r_inverse * &(&(&b.transpose() * &x) + &cost.s.transpose());
            let residual = care_residual(&a_free, &g, &q_free, &x);
            if accurate(&residual) && is_stable(&(a - &(b * &k))) {
                return Ok(Regulator { x, k, residual });
            }
        }
    }
    Err(NoStabilisingSolution)
}

/// Shifts γ > 0 around the size of the Hamiltonian's eigenvalues. A round number can equal an eigenvalue exactly (a
/// shift of 1 does, on textbook examples); these odd factors do not.
fn cayley_shifts<R: Real>(a: &Matrix<R>, g: &Matrix<R>, q: &Matrix<R>) -> Vec<R> {
    let product = (g.norm() * &q.norm()).sqrt();
    let size = a.norm().max(product);
    let size = if size.is_zero() { R::one() } else { size };
    [0.337_21, 0.041_93, 1.717_3, 0.000_613_7, 13.93]
        .iter()
        .map(|&f| size.clone() * &R::from_f64(f))
        .collect()
}

fn care_attempt<R: Real>(
    a: &Matrix<R>,
    g: &Matrix<R>,
    q: &Matrix<R>,
    gamma: &R,
) -> Result<Matrix<R>, Breakdown> {
    let identity = Matrix::identity(a.rows());
    let two_gamma = gamma.scale_by_power_of_two(1);
    // Aγ = A - γ I,  Wγ = Aγᵀ + Q Aγ⁻¹ G
    let a_gamma = a - &identity.scaled(gamma);
    let a_inverse = solve(&a_gamma, &identity).map_err(|_| Breakdown)?;
    let w = &a_gamma.transpose() + &(&(q * &a_inverse) * g);
    let w_inverse = solve(&w, &identity).map_err(|_| Breakdown)?;
    // A₀ = I + 2γ Wγ⁻ᵀ,  G₀ = 2γ Aγ⁻¹ G Wγ⁻¹,  H₀ = 2γ Wγ⁻¹ Q Aγ⁻¹
    let a_0 = &identity + &w_inverse.transpose().scaled(&two_gamma);
    let g_0 = (&(&a_inverse * g) * &w_inverse).scaled(&two_gamma).symmetric_part();
    let h_0 = (&(&w_inverse * q) * &a_inverse).scaled(&two_gamma).symmetric_part();
    doubling(&a_0, &g_0, &h_0)
}

fn care_residual<R: Real>(a: &Matrix<R>, g: &Matrix<R>, q: &Matrix<R>, x: &Matrix<R>) -> R {
    let linear = &(&a.transpose() * x) + &(x * a);
    let quadratic = &(x * g) * x;
    let left = &(&linear - &quadratic) + q;
    relative(&left, &[&linear, &quadratic, q])
}

/// Solves the sampled equation `X = Aᵀ X A - (Aᵀ X B + S) (R + Bᵀ X B)⁻¹ (Bᵀ X A + Sᵀ) + Q` for the X with
/// `A - B K` stable, `K = (R + Bᵀ X B)⁻¹ (Bᵀ X A + Sᵀ)`.
///
/// A is s×s, B is s×m. R may be singular (even zero) as long as `R + Bᵀ X B` is not.
///
/// # Errors
/// [`NoStabilisingSolution`] as for [`care`], with the unit circle in place of the imaginary axis.
#[doc(alias = "dlqr")]
#[doc(alias = "discrete_are")]
pub fn dare<R: Real>(
    a: &Matrix<R>,
    b: &Matrix<R>,
    cost: &Cost<R>,
) -> Result<Regulator<R>, NoStabilisingSolution> {
    let (a_t, b_t) = (a.transpose(), b.transpose());
    for x_0 in solution_shifts::<R>(a.rows()) {
        // With X = X₀ + Y, Y solves the same equation with other weights.
        let shifted = Cost {
            q: &(&cost.q + &(&(&a_t * &x_0) * a)) - &x_0,
            r: &cost.r + &(&(&b_t * &x_0) * b),
            s: &cost.s + &(&(&a_t * &x_0) * b),
        };
        let Ok(y) = dare_attempt(a, b, &shifted) else { continue };
        let x = &x_0 + &y;
        let x_a = &x * a;
        let innovation_weight = &cost.r + &(&b_t * &(&x * b));
        let coupling = &(&b_t * &x_a) + &cost.s.transpose();
        let Ok(k) = solve(&innovation_weight, &coupling) else { continue };
        // X - Q - Aᵀ X A + couplingᵀ K = 0
        let moved = &a_t * &x_a;
        let saved = &coupling.transpose() * &k;
        let left = &(&(&x - &cost.q) - &moved) + &saved;
        let residual = relative(&left, &[&x, &cost.q, &moved, &saved]);
        if accurate(&residual) && powers_vanish(&(a - &(b * &k))) {
            return Ok(Regulator { x, k, residual });
        }
    }
    Err(NoStabilisingSolution)
}

fn dare_attempt<R: Real>(a: &Matrix<R>, b: &Matrix<R>, cost: &Cost<R>) -> Result<Matrix<R>, Breakdown> {
    let r_inverse = solve(&cost.r, &Matrix::identity(cost.r.rows())).map_err(|_| Breakdown)?;
    let s_t = cost.s.transpose();
    let b_r = b * &r_inverse;
    let a_free = a - &(&b_r * &s_t);
    let q_free = (&cost.q - &(&(&cost.s * &r_inverse) * &s_t)).symmetric_part();
    let g = (&b_r * &b.transpose()).symmetric_part();
    doubling(&a_free, &g, &q_free)
}

fn relative<R: Real>(left: &Matrix<R>, terms: &[&Matrix<R>]) -> R {
    let size = terms.iter().fold(R::zero(), |sum, term| sum + &term.norm());
    if size.is_zero() { left.norm() } else { left.norm() / &size }
}

/// Whether at least half of the working bits are correct: enough to tell a solution from a failed iteration. Whether a
/// gain is correct to the last bit of an `f64` is decided by repeating the design at twice the precision.
fn accurate<R: Real>(residual: &R) -> bool {
    *residual <= R::one().scale_by_power_of_two(-(R::bits() as i32) / 2)
}

/// Whether every eigenvalue of `a` has a negative real part: its Cayley transform
/// `(γ I + A) (γ I - A)⁻¹` maps the left half plane into the unit disk for any γ > 0.
pub fn is_stable<R: Real>(a: &Matrix<R>) -> bool {
    let norm = a.norm();
    let gamma = if norm.is_zero() { R::one() } else { norm * &R::from_f64(0.177_3) };
    let shift = Matrix::identity(a.rows()).scaled(&gamma);
    solve_right(&(&shift + a), &(&shift - a)).is_ok_and(|transformed| powers_vanish(&transformed))
}

/// Whether every eigenvalue of `a` lies strictly inside the unit circle.
pub fn is_stable_sampled<R: Real>(a: &Matrix<R>) -> bool {
    powers_vanish(a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Wide;

    type W = Wide;

    fn matrix(rows: &[&[f64]]) -> Matrix<W> {
        Matrix::from_f64_rows(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())
    }

    fn rounded(m: &Matrix<W>) -> Vec<f64> {
        m.entries().iter().map(Wide::round_to_f64).collect()
    }

    #[test]
    fn double_integrator_has_the_textbook_gain() {
        // Q = I, R = 1: X = [√3 1; 1 √3], K = [1 √3].
        let (a, b) = (matrix(&[&[0.0, 1.0], &[0.0, 0.0]]), matrix(&[&[0.0], &[1.0]]));
        let regulator = care(&a, &b, &Cost::new(Matrix::identity(2), Matrix::identity(1))).unwrap();
        assert_eq!(rounded(&regulator.k), [1.0, 3f64.sqrt()]);
        assert_eq!(rounded(&regulator.x), [3f64.sqrt(), 1.0, 1.0, 3f64.sqrt()]);
    }

    #[test]
    fn a_weightless_unstable_mode_is_mirrored() {
        // ẋ = x + u at no state cost: the cheapest stabilising gain moves the pole from 1 to -1.
        let regulator =
            care(&matrix(&[&[1.0]]), &matrix(&[&[1.0]]), &Cost::new(matrix(&[&[0.0]]), matrix(&[&[1.0]])));
        assert_eq!(rounded(&regulator.unwrap().k), [2.0]);
    }

    #[test]
    fn a_weightless_marginal_mode_has_no_solution() {
        let (a, b) = (matrix(&[&[0.0, 1.0], &[0.0, 0.0]]), matrix(&[&[0.0], &[1.0]]));
        let cost = Cost::new(matrix(&[&[0.0, 0.0], &[0.0, 1.0]]), Matrix::identity(1));
        assert_eq!(care(&a, &b, &cost).err(), Some(NoStabilisingSolution));
    }

    #[test]
    fn a_cross_term_is_the_same_as_feeding_back_first() {
        let (a, b) = (matrix(&[&[0.5, 1.0], &[2.0, -3.0]]), matrix(&[&[1.0], &[0.25]]));
        let with_cross = Cost {
            s: matrix(&[&[0.25], &[0.5]]),
            ..Cost::new(matrix(&[&[4.0, 1.0], &[1.0, 3.0]]), matrix(&[&[2.0]]))
        };
        // u = v - R⁻¹ Sᵀ x
        let first = &with_cross.s.transpose().scaled(&W::from_f64(0.5));
        let without = Cost::new(&with_cross.q - &(&with_cross.s * first), with_cross.r.clone());
        let (direct, inner) =
            (care(&a, &b, &with_cross).unwrap(), care(&(&a - &(&b * first)), &b, &without).unwrap());
        assert_eq!(rounded(&direct.k), rounded(&(&inner.k + first)));
        let (direct, inner) =
            (dare(&a, &b, &with_cross).unwrap(), dare(&(&a - &(&b * first)), &b, &without).unwrap());
        assert_eq!(rounded(&direct.k), rounded(&(&inner.k + first)));
    }

    #[test]
    fn the_golden_ratio_solves_the_scalar_sampled_equation() {
        // x = x - x²/(1+x) + 1 has the root (1 + √5)/2.
        let one = matrix(&[&[1.0]]);
        let regulator = dare(&one, &one, &Cost::new(one.clone(), one.clone())).unwrap();
        assert_eq!(rounded(&regulator.x), [(1.0 + 5f64.sqrt()) / 2.0]);
    }

    #[test]
    fn a_free_control_makes_the_loop_deadbeat() {
        let (a, b) = (matrix(&[&[2.0, 1.0], &[0.0, 1.0]]), matrix(&[&[0.0], &[1.0]]));
        let cost = Cost::new(matrix(&[&[1.0, 0.0], &[0.0, 0.0]]), matrix(&[&[0.0]]));
        let regulator = dare(&a, &b, &cost).unwrap();
        assert_eq!(rounded(&regulator.k), [4.0, 3.0]);
    }

    #[test]
    fn an_uncontrollable_unstable_mode_has_no_solution() {
        let (a, b) = (matrix(&[&[1.5, 0.0], &[0.0, 0.5]]), matrix(&[&[0.0], &[1.0]]));
        let cost = Cost::new(Matrix::identity(2), Matrix::identity(1));
        assert!(care(&a, &b, &cost).is_err() && dare(&a, &b, &cost).is_err());
    }
}
