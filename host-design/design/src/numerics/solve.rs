//! Linear equations by LU factorisation.

use super::{Matrix, Real};

/// `P A = L U` with row exchanges (Golub & Van Loan, *Matrix Computations*, algorithm 3.4.1).
pub struct Lu<R> {
    factors: Matrix<R>,
    row_order: Vec<usize>,
}

/// The matrix is singular at working precision.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the matrix is singular at working precision")]
pub struct Singular;

impl<R: Real> Lu<R> {
    /// Factorises a square matrix.
    ///
    /// # Errors
    /// [`Singular`] if a column has no usable pivot: zero, not finite, or `2^(8 - bits)` times smaller than its
    /// row was at the start.
    pub fn new(a: &Matrix<R>) -> Result<Self, Singular> {
        let n = a.rows();
        assert_eq!(n, a.cols(), "only a square matrix has an LU factorisation here");
        let mut lu = a.clone();
        let mut row_order: Vec<usize> = (0..n).collect();
        let noise = R::epsilon().scale_by_power_of_two(7);
        // Scaled pivoting keeps rows of very different size (stiff plants, badly chosen units) comparable.
        let mut row_size: Vec<R> =
            (0..n).map(|i| (0..n).map(|j| lu[(i, j)].abs()).fold(R::zero(), R::max)).collect();
        for k in 0..n {
            let mut pivot_row = k;
            let mut best = R::zero();
            for i in k..n {
                if row_size[i].is_zero() {
                    return Err(Singular);
                }
                let relative = lu[(i, k)].abs() / &row_size[i];
                if relative > best {
                    best = relative;
                    pivot_row = i;
                }
            }
            if !best.is_finite() || best <= noise {
                return Err(Singular);
            }
            if pivot_row != k {
                for j in 0..n {
                    let upper = lu[(k, j)].clone();
                    lu[(k, j)] = lu[(pivot_row, j)].clone();
                    lu[(pivot_row, j)] = upper;
                }
                row_order.swap(k, pivot_row);
                row_size.swap(k, pivot_row);
            }
            for i in k + 1..n {
                if lu[(i, k)].is_zero() {
                    continue;
                }
                let factor = lu[(i, k)].clone() / &lu[(k, k)];
                for j in k + 1..n {
                    if !lu[(k, j)].is_zero() {
                        let step = factor.times(&lu[(k, j)]);
                        lu[(i, j)] = lu[(i, j)].minus(&step);
                    }
                }
                lu[(i, k)] = factor;
            }
        }
        Ok(Self { factors: lu, row_order })
    }

    /// Solves `A X = B` for B with as many rows as A.
    pub fn solve(&self, b: &Matrix<R>) -> Matrix<R> {
        let n = self.factors.rows();
        let mut x = Matrix::from_fn(n, b.cols(), |i, j| b[(self.row_order[i], j)].clone());
        for column in 0..b.cols() {
            for i in 0..n {
                for k in 0..i {
                    self.eliminate(&mut x, i, k, column);
                }
            }
            for i in (0..n).rev() {
                for k in i + 1..n {
                    self.eliminate(&mut x, i, k, column);
                }
                x[(i, column)] = x[(i, column)].clone() / &self.factors[(i, i)];
            }
        }
        x
    }

    fn eliminate(&self, x: &mut Matrix<R>, i: usize, k: usize, column: usize) {
        let (factor, known) = (&self.factors[(i, k)], &x[(k, column)]);
        if !factor.is_zero() && !known.is_zero() {
            let step = known.times(factor);
            x[(i, column)] = x[(i, column)].minus(&step);
        }
    }
}

/// Solves `A X = B` for a square `A`.
///
/// # Errors
/// [`Singular`] as for [`Lu::new`].
pub fn solve<R: Real>(a: &Matrix<R>, b: &Matrix<R>) -> Result<Matrix<R>, Singular> {
    Ok(Lu::new(a)?.solve(b))
}

/// Solves `X A = B` for a square `A`.
///
/// # Errors
/// [`Singular`] as for [`Lu::new`].
pub fn solve_right<R: Real>(b: &Matrix<R>, a: &Matrix<R>) -> Result<Matrix<R>, Singular> {
    Ok(solve(&a.transpose(), &b.transpose())?.transpose())
}

#[cfg(test)]
mod tests {
    use super::super::Wide;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_solution_satisfies_its_equation(entries in prop::collection::vec(-1e3..1e3f64, 25), exponents in prop::collection::vec(-20..20i32, 5)) {
            type W = Wide;
            let a = Matrix::from_fn(5, 5, |i, j| W::from_f64(entries[5 * i + j]).scale_by_power_of_two(exponents[i]));
            let b = Matrix::<W>::identity(5);
            if let Ok(x) = solve(&a, &b) {
                let residual = &(&a * &x) - &b;
                let scale = a.norm() * &x.norm();
                prop_assert!(residual.norm() <= scale * &W::epsilon().scale_by_power_of_two(8));
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_refused() {
        let a = Matrix::<f64>::from_f64_rows(&[vec![1.0, 2.0], vec![2.0, 4.0]]);
        assert_eq!(Lu::new(&a).err(), Some(Singular));
    }
}
