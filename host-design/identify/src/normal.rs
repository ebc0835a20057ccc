//! Normal equations of least squares, in parameters that are scaled by their prior deviations.

use crate::rows::add_multiple;

/// `A δ = g` with `A = Σ w J Jᵀ` and `g = Σ w J e`.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    size: usize,
    /// A, row by row; the lower triangle is kept.
    matrix: Vec<f64>,
    pub(crate) gradient: Vec<f64>,
    /// Value of the cost function that is minimised.
    pub(crate) cost: f64,
    /// Sum of the squared residuals of each channel.
    pub(crate) squares: Vec<f64>,
    /// Sum of the squared residuals of each channel, each divided by its predicted variance.
    pub(crate) normalised: Vec<f64>,
    /// Number of residuals of each channel.
    pub(crate) count: usize,
    /// Residuals divided by their predicted deviations, one row of channels per sample; only from a filter that does
    /// not fit parameters.
    pub(crate) innovations: Vec<f64>,
}

impl Normal {
    pub(crate) fn new(size: usize, channels: usize) -> Self {
        Self {
            size,
            matrix: vec![0.0; size * size],
            gradient: vec![0.0; size],
            cost: 0.0,
            squares: vec![0.0; channels],
            normalised: vec![0.0; channels],
            count: 0,
            innovations: Vec::new(),
        }
    }

    /// Adds the residual `error`, measurement minus prediction, with the weight `weight`; `jacobian` holds the
    /// derivatives of the prediction by the parameters.
    pub(crate) fn add(&mut self, jacobian: &[f64], error: f64, weight: f64) {
        for (i, &of_i) in jacobian.iter().enumerate() {
            let factor = weight * of_i;
            if factor == 0.0 {
                continue;
            }
            self.gradient[i] += factor * error;
            let row = &mut self.matrix[i * self.size..][..i + 1];
            add_multiple(row, factor, jacobian);
        }
    }

    /// Adds all of `other`.
    pub(crate) fn merge(mut self, other: &Self) -> Self {
        let sum = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        sum(&mut self.matrix, &other.matrix);
        sum(&mut self.gradient, &other.gradient);
        sum(&mut self.squares, &other.squares);
        sum(&mut self.normalised, &other.normalised);
        self.cost += other.cost;
        self.count += other.count;
        self.innovations.extend(&other.innovations);
        self
    }

    /// Adds the prior, mean 0 and deviation 1 for each scaled parameter; `at` holds their current values.
    pub(crate) fn add_prior(&mut self, at: &[f64]) {
        self.cost += at.iter().map(|at| at * at).sum::<f64>();
        for (i, at) in at.iter().enumerate().take(self.size) {
            self.matrix[i * self.size + i] += 1.0;
            self.gradient[i] -= at;
        }
    }

    /// Entry of A.
    pub(crate) fn entry(&self, i: usize, j: usize) -> f64 {
        self.matrix[i.max(j) * self.size + i.min(j)]
    }

    /// Subtracts `value` from an entry of the lower triangle of A.
    pub(crate) fn subtract(&mut self, i: usize, j: usize, value: f64) {
        self.matrix[i * self.size + j] -= value;
    }

    /// Number of rows of A.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// The solution δ with the diagonal of A multiplied by 1 + `damping` and each `δ_i >= low_i`: an entry that would
    /// fall below is held there, and the others are solved again (active set). None if A is not positive definite.
    pub(crate) fn bounded_step(&self, damping: f64, low: &[f64]) -> Option<Vec<f64>> {
        let is_held = |(&low, &gradient): (&f64, &f64)| low >= 0.0 && gradient <= 0.0;
        let mut held: Vec<bool> = low.iter().zip(&self.gradient).map(is_held).collect();
        loop {
            let mut rest = self.clone();
            (0..self.size).filter(|&i| held[i]).for_each(|i| rest.hold(i, low[i]));
            let mut step = rest.gradient.clone();
            rest.factor(damping)?.solve(&mut step);
            (0..self.size).filter(|&i| held[i]).for_each(|i| step[i] = low[i]);
            let below: Vec<usize> = (0..self.size).filter(|&i| step[i] < low[i]).collect();
            if below.is_empty() {
                return Some(step);
            }
            below.into_iter().for_each(|i| held[i] = true);
        }
    }

    /// Replaces the equation of one unknown by `δ_index = value`.
    pub(crate) fn hold(&mut self, index: usize, value: f64) {
        for other in 0..self.size {
            let entry = self.entry(index, other);
            self.gradient[other] -= entry * value;
            self.matrix[index.max(other) * self.size + index.min(other)] = 0.0;
        }
        self.matrix[index * self.size + index] = 1.0;
        self.gradient[index] = value;
    }

    /// Square root of the diagonal of `A⁻¹ Σ g gᵀ A⁻¹` with the `gradients` g of parts of the data, where the unknowns
    /// `held` stay as they are. None if A is not positive definite.
    pub(crate) fn scatter(&self, gradients: &[Vec<f64>], held: &[usize]) -> Option<Vec<f64>> {
        let mut free = self.clone();
        held.iter().for_each(|&i| free.hold(i, 0.0));
        let factor = free.factor(0.0)?;
        let mut squares = vec![0.0; self.size];
        for gradient in gradients {
            let mut by = gradient.clone();
            held.iter().for_each(|&i| by[i] = 0.0);
            factor.solve(&mut by);
            squares.iter_mut().zip(by).for_each(|(sum, by)| *sum += by * by);
        }
        Some(squares.into_iter().map(f64::sqrt).collect())
    }

    /// Factor of A with its diagonal multiplied by 1 + `damping`; none if that is not positive definite.
    pub(crate) fn factor(&self, damping: f64) -> Option<Cholesky> {
        let n = self.size;
        let mut l = self.matrix.clone();
        for i in 0..n {
            l[i * n + i] *= 1.0 + damping;
            for j in 0..=i {
                let (row_i, row_j) = (&l[i * n..i * n + j], &l[j * n..j * n + j]);
                let known: f64 = row_i.iter().zip(row_j).map(|(a, b)| a * b).sum();
                let rest = l[i * n + j] - known;
                if i > j {
                    l[i * n + j] = rest / l[j * n + j];
                } else if rest > 0.0 && rest.is_finite() {
                    l[i * n + i] = rest.sqrt();
                } else {
                    return None;
                }
            }
        }
        Some(Cholesky { size: n, l })
    }
}

/// The lower triangular factor L of `A = L Lᵀ`.
#[derive(Debug, Clone)]
pub(crate) struct Cholesky {
    size: usize,
    l: Vec<f64>,
}

impl Cholesky {
    /// Replaces the right-hand side by the solution.
    pub(crate) fn solve(&self, b: &mut [f64]) {
        let n = self.size;
        for i in 0..n {
            let known: f64 = self.l[i * n..i * n + i].iter().zip(&*b).map(|(l, x)| l * x).sum();
            b[i] = (b[i] - known) / self.l[i * n + i];
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| self.l[k * n + i] * b[k]).sum();
            b[i] = (b[i] - known) / self.l[i * n + i];
        }
    }

    /// The inverse of A, row by row.
    pub(crate) fn inverse(&self) -> Vec<f64> {
        let n = self.size;
        let mut inverse = vec![0.0; n * n];
        for (i, row) in inverse.chunks_exact_mut(n).enumerate() {
            row[i] = 1.0;
            self.solve(row);
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::Normal;

    #[test]
    fn an_unknown_at_its_bound_is_held_and_the_others_are_solved_with_it() {
        let mut normal = Normal::new(2, 1);
        normal.add(&[1.0, 0.9], -1.0, 1.0);
        normal.add(&[0.9, 1.0], 1.0, 1.0);
        // Without bounds the first is about -10, the second 10.
        let free = normal.bounded_step(0.0, &[f64::NEG_INFINITY; 2]).unwrap();
        assert!(free[0] < -9.0 && free[1] > 9.0);
        let step = normal.bounded_step(0.0, &[-0.5, f64::NEG_INFINITY]).unwrap();
        // Least squares of -1 + 0.45 - 0.9 x and 1 + 0.45 - x.
        assert!(step[0] == -0.5 && (step[1] - (1.45 - 0.9 * 0.5) / 1.81).abs() < 1e-12, "{step:?}");
    }

    #[test]
    fn a_line_through_points_is_found() {
        let mut normal = Normal::new(2, 1);
        for x in 0..5 {
            let x = f64::from(x);
            normal.add(&[1.0, x], 3.0 - 2.0 * x, 0.5);
        }
        let factor = normal.factor(0.0).unwrap();
        let mut line = normal.gradient.clone();
        factor.solve(&mut line);
        assert!((line[0] - 3.0).abs() < 1e-12 && (line[1] + 2.0).abs() < 1e-12);
        // 0.5 Σ [1 x; x x²] = [2.5 5; 5 15]
        let inverse = factor.inverse();
        for (found, wanted) in inverse.iter().zip([1.2, -0.4, -0.4, 0.2]) {
            assert!((found - wanted).abs() < 1e-12);
        }
        assert!(Normal::new(2, 1).factor(0.0).is_none());
    }
}
