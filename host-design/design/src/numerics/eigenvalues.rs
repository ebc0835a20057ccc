//! Eigenvalues of a real matrix.

use super::{Matrix, Real};

/// A complex number.
#[derive(Clone, Debug, PartialEq)]
pub struct Complex<R> {
    /// Real part.
    pub re: R,
    /// Imaginary part.
    pub im: R,
}

impl<R: Real> Complex<R> {
    /// Absolute value `√(re² + im²)`.
    pub fn modulus(&self) -> R {
        let squared = self.re.clone() * &self.re + &(self.im.clone() * &self.im);
        squared.sqrt()
    }

    /// Both parts rounded to `f64`: [re, im].
    pub fn to_f64(&self) -> [f64; 2] {
        [self.re.to_f64(), self.im.to_f64()]
    }
}

/// The QR iteration did not converge. In extended precision this has been seen only with entries that are not finite.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the eigenvalue iteration did not converge")]
pub struct NoConvergence;

/// Eigenvalues of a square matrix, by balancing, reduction to Hessenberg form and Francis' double-shift QR steps
/// (Golub & Van Loan, *Matrix Computations*, section 7.5; `hqr` of EISPACK), ordered by real part.
///
/// A k-fold eigenvalue has only about `bits / k` correct bits: choose the precision accordingly.
///
/// # Errors
/// [`NoConvergence`] after `30 + 2 bits` steps without a deflation (repeated eigenvalues converge one bit at a time).
#[doc(alias = "eig")]
pub fn eigenvalues<R: Real>(a: &Matrix<R>) -> Result<Vec<Complex<R>>, NoConvergence> {
    if !a.is_finite() {
        return Err(NoConvergence);
    }
    let mut h = hessenberg(balanced(a.clone()));
    let mut found = Vec::with_capacity(a.rows());
    let size = h.norm();
    let mut end = a.rows(); // the active block is h[..end, ..end]
    let mut steps = 0;
    while end > 0 {
        let last = end - 1;
        let start = deflate(&mut h, last, &size);
        if start == last {
            found.push(Complex { re: h[(last, last)].clone(), im: R::zero() });
            end -= 1;
            steps = 0;
        } else if start + 1 == last {
            found.extend(eigenvalues_of_block(&h, start));
            end -= 2;
            steps = 0;
        } else {
            if steps == 30 + 2 * R::bits() {
                return Err(NoConvergence);
            }
            steps += 1;
            francis_step(&mut h, start, last, steps % 10 == 0);
        }
    }
    found.sort_by(|p, q| p.to_f64().partial_cmp(&q.to_f64()).unwrap_or(core::cmp::Ordering::Equal));
    Ok(found)
}

/// Spectral radius: the largest absolute value of an eigenvalue of a square matrix.
///
/// # Errors
/// As for [`eigenvalues`].
pub fn spectral_radius<R: Real>(a: &Matrix<R>) -> Result<R, NoConvergence> {
    Ok(eigenvalues(a)?.iter().map(Complex::modulus).fold(R::zero(), R::max))
}

/// Scales rows and columns by powers of two until they are of similar size. The scaling is exact, so the eigenvalues
/// do not change.
fn balanced<R: Real>(mut a: Matrix<R>) -> Matrix<R> {
    let n = a.rows();
    for _ in 0..20 {
        let mut settled = true;
        for i in 0..n {
            let off_diagonal = |entry: &dyn Fn(usize) -> R| {
                (0..n).filter(|&j| j != i).map(|j| entry(j).abs().to_f64()).sum::<f64>()
            };
            let column = off_diagonal(&|j| a[(j, i)].clone());
            let row = off_diagonal(&|j| a[(i, j)].clone());
            if column == 0.0 || row == 0.0 || !column.is_finite() || !row.is_finite() {
                continue;
            }
            let power = ((row / column).log2() / 2.0).round() as i32;
            if power != 0 {
                settled = false;
                for j in 0..n {
                    a[(j, i)] = a[(j, i)].scale_by_power_of_two(power);
                    a[(i, j)] = a[(i, j)].scale_by_power_of_two(-power);
                }
            }
        }
        if settled {
            break;
        }
    }
    a
}

/// Similarity transform to upper Hessenberg form by elimination with pivoting.
fn hessenberg<R: Real>(mut a: Matrix<R>) -> Matrix<R> {
    let n = a.rows();
    for m in 1..n.saturating_sub(1) {
        let column = m - 1;
        let mut pivot = m;
        for i in m + 1..n {
            if a[(i, column)].abs() > a[(pivot, column)].abs() {
                pivot = i;
            }
        }
        if a[(pivot, column)].is_zero() {
            continue;
        }
        if pivot != m {
            for j in 0..n {
                swap(&mut a, (pivot, j), (m, j));
            }
            for i in 0..n {
                swap(&mut a, (i, pivot), (i, m));
            }
        }
        for i in m + 1..n {
            if a[(i, column)].is_zero() {
                continue;
            }
            let factor = a[(i, column)].clone() / &a[(m, column)];
            for j in column..n {
                let step = factor.times(&a[(m, j)]);
                a[(i, j)] = a[(i, j)].minus(&step);
            }
            for k in 0..n {
                let step = factor.times(&a[(k, i)]);
                a[(k, m)] = a[(k, m)].clone() + &step;
            }
            a[(i, column)] = R::zero();
        }
    }
    a
}

fn swap<R: Clone>(a: &mut Matrix<R>, first: (usize, usize), second: (usize, usize)) {
    let kept = a[first].clone();
    a[first] = a[second].clone();
    a[second] = kept;
}

/// Sets negligible subdiagonal entries to zero; returns the start of the unreduced block that ends at `last`.
fn deflate<R: Real>(h: &mut Matrix<R>, last: usize, size: &R) -> usize {
    for i in (1..=last).rev() {
        let mut neighbours = h[(i - 1, i - 1)].abs() + &h[(i, i)].abs();
        if neighbours.is_zero() {
            neighbours = size.clone();
        }
        if h[(i, i - 1)].abs() <= neighbours * &R::epsilon() {
            h[(i, i - 1)] = R::zero();
            return i;
        }
    }
    0
}

/// Both eigenvalues of the 2×2 block that starts at (`i`, `i`).
fn eigenvalues_of_block<R: Real>(h: &Matrix<R>, i: usize) -> [Complex<R>; 2] {
    let (a, b, c, d) = (&h[(i, i)], &h[(i, i + 1)], &h[(i + 1, i)], &h[(i + 1, i + 1)]);
    let half_difference = (a.clone() - d).scale_by_power_of_two(-1);
    let mean = (a.clone() + d).scale_by_power_of_two(-1);
    let discriminant = half_difference.clone() * &half_difference + &(b.clone() * c);
    let root = discriminant.abs().sqrt();
    if discriminant < R::zero() {
        [Complex { re: mean.clone(), im: -root.clone() }, Complex { re: mean, im: root }]
    } else {
        // The two terms of this sum have the same sign, so nothing cancels; the other root follows from the
        // determinant.
        let sum = if half_difference < R::zero() {
            half_difference.clone() - &root
        } else {
            half_difference + &root
        };
        let first = d.clone() + &sum;
        let second = if sum.is_zero() { d.clone() } else { d.clone() - &(b.clone() * c / &sum) };
        [Complex { re: first, im: R::zero() }, Complex { re: second, im: R::zero() }]
    }
}

/// One implicit double-shift QR step on the block from `start` to `last`.
fn francis_step<R: Real>(h: &mut Matrix<R>, start: usize, last: usize, exceptional: bool) {
    let [mut p, mut q, mut r] = first_column(h, start, last, exceptional);
    for k in start..last {
        let three = k + 2 <= last;
        if k > start {
            p = h[(k, k - 1)].clone();
            q = h[(k + 1, k - 1)].clone();
            r = if three { h[(k + 2, k - 1)].clone() } else { R::zero() };
        }
        // Householder reflection I - v vᵀ·scale that maps (p, q, r) to (∓norm, 0, 0).
        let size = p.abs() + &q.abs() + &r.abs();
        if size.is_zero() {
            continue;
        }
        let (x, y, z) = (p.clone() / &size, q.clone() / &size, r.clone() / &size);
        let mut norm = (x.clone() * &x + &(y.clone() * &y) + &(z.clone() * &z)).sqrt();
        if x < R::zero() {
            norm = -norm;
        }
        let v = [x.clone() + &norm, y, z];
        let scale = R::one() / &(norm.clone() * &v[0]);
        if k > start {
            h[(k, k - 1)] = -(norm * &size);
            h[(k + 1, k - 1)] = R::zero();
            if three {
                h[(k + 2, k - 1)] = R::zero();
            }
        }
        reflect(h, k, last, &v[..if three { 3 } else { 2 }], &scale);
    }
}

/// The entries of the first column of H² - sum·H + product·I that are not 0, for the block from `start` to `last`. Sum
/// and product are those of the shifts.
fn first_column<R: Real>(h: &Matrix<R>, start: usize, last: usize, exceptional: bool) -> [R; 3] {
    let (mut sum, mut product) = {
        let (a, b) = (&h[(last - 1, last - 1)], &h[(last - 1, last)]);
        let (c, d) = (&h[(last, last - 1)], &h[(last, last)]);
        (a.clone() + d, a.clone() * d - &(b.clone() * c))
    };
    if exceptional {
        // The iteration may cycle: shift by values of the right size that are not eigenvalues of the corner block.
        let size = h[(last, last - 1)].abs() + &h[(last - 1, last - 2)].abs();
        sum = size.clone() * &R::from_f64(1.5);
        product = size.clone() * &size;
    }
    let p = h[(start, start)].clone() * &h[(start, start)]
        + &(h[(start, start + 1)].clone() * &h[(start + 1, start)])
        - &(sum.clone() * &h[(start, start)])
        + &product;
    let q = h[(start + 1, start)].clone() * &(h[(start, start)].clone() + &h[(start + 1, start + 1)] - &sum);
    let r = h[(start + 1, start)].clone() * &h[(start + 2, start + 1)];
    [p, q, r]
}

/// Multiplies `h` from both sides by the reflection I - v vᵀ·scale of rows and columns from `k` on.
fn reflect<R: Real>(h: &mut Matrix<R>, k: usize, last: usize, v: &[R], scale: &R) {
    for j in k..h.rows() {
        let mut dot = R::zero();
        for (i, component) in v.iter().enumerate() {
            dot = dot + &component.times(&h[(k + i, j)]);
        }
        let dot = dot * scale;
        for (i, component) in v.iter().enumerate() {
            h[(k + i, j)] = h[(k + i, j)].minus(&component.times(&dot));
        }
    }
    for i in 0..=(k + 3).min(last) {
        let mut dot = R::zero();
        for (j, component) in v.iter().enumerate() {
            dot = dot + &component.times(&h[(i, k + j)]);
        }
        let dot = dot * scale;
        for (j, component) in v.iter().enumerate() {
            h[(i, k + j)] = h[(i, k + j)].minus(&component.times(&dot));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Wide;
    use super::*;
    use proptest::prelude::*;

    /// The companion matrix of the monic polynomial with these real roots.
    fn companion<R: Real>(roots: &[f64]) -> Matrix<R> {
        let n = roots.len();
        let mut coefficients = vec![R::one()];
        for &root in roots {
            let mut next = coefficients.clone();
            next.push(R::zero());
            for (i, c) in coefficients.iter().enumerate() {
                next[i + 1] = next[i + 1].clone() - &(c.clone() * &R::from_f64(root));
            }
            coefficients = next;
        }
        Matrix::from_fn(n, n, |i, j| match i {
            0 => -coefficients[j + 1].clone(),
            _ if i == j + 1 => R::one(),
            _ => R::zero(),
        })
    }

    #[test]
    fn roots_of_wilkinsons_polynomial_come_back() {
        let roots: Vec<f64> = (1..=20).map(f64::from).collect();
        let found = eigenvalues(&companion::<Wide>(&roots)).unwrap();
        for (eigenvalue, root) in found.iter().zip(&roots) {
            assert_eq!(eigenvalue.re.round_to_f64(), *root);
            assert!(eigenvalue.im.to_f64() == 0.0);
        }
    }

    #[test]
    fn a_fourfold_root_keeps_a_quarter_of_the_bits() {
        for eigenvalue in eigenvalues(&companion::<Wide>(&[-40.0; 4])).unwrap() {
            assert!((eigenvalue.re.to_f64() + 40.0).abs() < 1e-16 && eigenvalue.im.to_f64().abs() < 1e-16);
        }
    }

    #[test]
    fn a_permutation_needs_the_exceptional_shift() {
        let n = 6;
        let cycle = Matrix::<f64>::from_fn(n, n, |i, j| if (j + 1) % n == i { 1.0 } else { 0.0 });
        for eigenvalue in eigenvalues(&cycle).unwrap() {
            assert!((eigenvalue.modulus() - 1.0).abs() < 1e-14);
        }
    }

    proptest! {
        #[test]
        fn sum_and_product_of_eigenvalues_are_trace_and_determinant(entries in prop::collection::vec(-10.0..10.0f64, 36)) {
            type W = Wide;
            let a = Matrix::<W>::from_fn(6, 6, |i, j| W::from_f64(entries[6 * i + j]));
            let found = eigenvalues(&a).unwrap();
            let trace = (0..6).fold(W::zero(), |sum, i| sum + &a[(i, i)]);
            let sum = found.iter().fold(W::zero(), |sum, e| sum + &e.re);
            prop_assert!((sum - &trace).abs().to_f64() < 1e-60);
            for e in &found {
                // Each real eigenvalue makes A - λI singular to working precision.
                if e.im.is_zero() {
                    let shifted = &a - &Matrix::identity(6).scaled(&e.re);
                    let smallest = super::super::solve(&shifted, &Matrix::identity(6)).map_or(f64::INFINITY, |x| x.norm().to_f64());
                    prop_assert!(smallest > 1e40);
                }
            }
        }
    }
}
