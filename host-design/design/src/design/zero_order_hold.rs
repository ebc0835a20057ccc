//! Exact conversion from continuous time to the tick: plant, cost and noise.

use super::riccati::Cost;
use crate::numerics::{Matrix, Real, exponential};

/// `x⁺ = Ad x + Bd u` for an input held over one period `t` (s):
/// `e^([A B; 0 0] t) = [Ad Bd; 0 I]` (Van Loan, *IEEE Trans. Automatic Control* 23, 1978).
#[doc(alias = "c2d")]
#[doc(alias = "cont2discrete")]
#[doc(alias = "zoh")]
pub fn zero_order_hold<R: Real>(a: &Matrix<R>, b: &Matrix<R>, t: &R) -> (Matrix<R>, Matrix<R>) {
    let (states, inputs) = (a.rows(), b.cols());
    let transition = exponential(&held(a, b).scaled(t));
    (transition.block(0, 0, states, states), transition.block(0, states, states, inputs))
}

/// `[A B; 0 0]`: the plant with its held inputs as further states.
fn held<R: Real>(a: &Matrix<R>, b: &Matrix<R>) -> Matrix<R> {
    let size = a.rows() + b.cols();
    Matrix::zeros(size, size).with_block(0, 0, a).with_block(0, a.rows(), b)
}

/// `∫₀ᵗ e^(Aᵀτ) Q e^(Aτ) dτ` from one exponential (Van Loan 1978, theorem 1):
/// `e^([-Aᵀ Q; 0 A] t) = [· G; 0 F]` gives `Fᵀ G`.
pub fn integrated_quadratic<R: Real>(a: &Matrix<R>, q: &Matrix<R>, t: &R) -> Matrix<R> {
    let n = a.rows();
    let stacked = Matrix::zeros(2 * n, 2 * n)
        .with_block(0, 0, &-&a.transpose())
        .with_block(0, n, q)
        .with_block(n, n, a);
    let transition = exponential(&stacked.scaled(t));
    (&transition.block(n, n, n, n).transpose() * &transition.block(0, n, n, n)).symmetric_part()
}

/// The cost of one tick in terms of the state at its start and the held input. The sampled sum then equals the
/// continuous integral. This is where the cross term comes from.
#[doc(alias = "lqrd")]
#[doc(alias = "van_loan")]
pub fn sampled_cost<R: Real>(a: &Matrix<R>, b: &Matrix<R>, cost: &Cost<R>, t: &R) -> Cost<R> {
    let (states, inputs) = (a.rows(), b.cols());
    let weights = cost.q.beside(&cost.s).above(&cost.s.transpose().beside(&cost.r));
    let integrated = integrated_quadratic(&held(a, b), &weights, t);
    Cost {
        q: integrated.block(0, 0, states, states),
        r: integrated.block(states, states, inputs, inputs),
        s: integrated.block(0, states, states, inputs),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Wide;

    type W = Wide;

    #[test]
    fn a_double_integrator_is_held_and_integrated_in_closed_form() {
        let a = Matrix::<W>::from_f64_rows(&[vec![0.0, 1.0], vec![0.0, 0.0]]);
        let b = Matrix::<W>::from_f64_rows(&[vec![0.0], vec![1.0]]);
        let t = W::from_f64(0.5);
        let (ad, bd) = zero_order_hold(&a, &b, &t);
        assert_eq!(ad.to_f64_rows(), [[1.0, 0.5], [0.0, 1.0]]);
        assert_eq!(bd.to_f64_rows(), [[0.125], [0.5]]);
        // x1(τ) = x1 + τ x2 + τ²/2 u, with Q = diag(1, 0), R = 1.
        let cost = Cost::new(Matrix::from_diagonal(&[W::one(), W::zero()]), Matrix::identity(1));
        let tick = sampled_cost(&a, &b, &cost, &t);
        let close = |x: &W, y: f64| (x.to_f64() - y).abs() < 1e-16;
        assert!(
            close(&tick.q[(0, 0)], 0.5)
                && close(&tick.q[(0, 1)], 0.125)
                && close(&tick.q[(1, 1)], 1.0 / 24.0)
        );
        assert!(close(&tick.s[(0, 0)], 1.0 / 48.0) && close(&tick.s[(1, 0)], 1.0 / 128.0));
        assert!(close(&tick.r[(0, 0)], 0.5 + 1.0 / 640.0));
    }
}
