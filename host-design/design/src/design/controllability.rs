//! Controllability: which modes the inputs can reach.

use crate::numerics::{Complex, Matrix, NoConvergence, Real, eigenvalues};

/// The state space, split into the controllable subspace and the rest.
#[derive(Debug, Clone)]
#[doc(alias = "ctrb")]
#[doc(alias = "obsv")]
#[doc(alias = "controllability")]
#[doc(alias = "staircase")]
pub struct Reach<R> {
    /// Dimension of the controllable subspace.
    pub dimension: usize,
    /// `A` restricted to the rest: its eigenvalues are the modes no input moves.
    unreachable: Matrix<R>,
}

impl<R: Real> Reach<R> {
    /// The controllable subspace of (A, B), grown one orthogonalised direction at a time from the columns of B (the
    /// staircase algorithm of Rosenbrock, in its Krylov form).
    ///
    /// A direction counts as new when orthogonalisation leaves more than `2^(-bits/2)` of it; unlike the rank of
    /// `[B AB A²B …]` this does not decay with the number of states.
    pub fn of(a: &Matrix<R>, b: &Matrix<R>) -> Self {
        let states = a.rows();
        let threshold = R::one().scale_by_power_of_two(-(R::bits() as i32) / 2);
        let mut basis: Vec<Matrix<R>> = Vec::new();
        let input_floor = b.norm() * &threshold;
        for j in 0..b.cols() {
            extend(&mut basis, b.block(0, j, states, 1), &input_floor);
        }
        let state_floor = a.norm() * &threshold;
        let mut next = 0;
        while next < basis.len() && basis.len() < states {
            let image = a * &basis[next];
            extend(&mut basis, image, &state_floor);
            next += 1;
        }
        let dimension = basis.len();
        // Unit vectors complete the basis; the last columns span the rest.
        for i in 0..states {
            let unit = Matrix::from_fn(states, 1, |row, _| if row == i { R::one() } else { R::zero() });
            extend(&mut basis, unit, &threshold);
        }
        let rest =
            Matrix::from_fn(states, basis.len() - dimension, |i, j| basis[dimension + j][(i, 0)].clone());
        let unreachable = &(&rest.transpose() * a) * &rest;
        Self { dimension, unreachable }
    }

    /// The eigenvalues of A that no input moves.
    ///
    /// # Errors
    /// [`NoConvergence`] if the eigenvalue iteration fails.
    pub fn unreachable_modes(&self) -> Result<Vec<Complex<R>>, NoConvergence> {
        eigenvalues(&self.unreachable)
    }
}

/// Adds the normalised part of `candidate` that is orthogonal to `basis`, if more than `floor` is left of it.
fn extend<R: Real>(basis: &mut Vec<Matrix<R>>, candidate: Matrix<R>, floor: &R) {
    let mut rest = candidate;
    for _ in 0..2 {
        for direction in basis.iter() {
            let overlap = &direction.transpose() * &rest;
            rest = &rest - &direction.scaled(&overlap[(0, 0)]);
        }
    }
    let length = (&rest.transpose() * &rest)[(0, 0)].sqrt();
    if length > *floor {
        basis.push(rest.map(|entry| entry.clone() / &length));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Wide;

    type W = Wide;

    #[test]
    fn a_chain_of_integrators_is_reached_from_its_end_only() {
        let n = 30;
        let chain = Matrix::<W>::from_fn(n, n, |i, j| if j == i + 1 { W::one() } else { W::zero() });
        let at = |k: usize| Matrix::<W>::from_fn(n, 1, |i, _| if i == k { W::one() } else { W::zero() });
        assert_eq!(Reach::of(&chain, &at(n - 1)).dimension, n);
        assert_eq!(Reach::of(&chain, &at(4)).dimension, 5);
    }

    #[test]
    fn the_mode_out_of_reach_is_named() {
        let a = Matrix::<W>::from_f64_rows(&[vec![1.0, 2.0], vec![2.0, 1.0]]); // modes 3 along (1,1), -1 along (1,-1)
        let reach = Reach::of(&a, &Matrix::from_f64_rows(&[vec![1.0], vec![-1.0]]));
        let modes = reach.unreachable_modes().unwrap();
        assert_eq!((reach.dimension, modes[0].re.round_to_f64()), (1, 3.0));
    }
}
