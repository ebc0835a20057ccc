//! Dense matrices of any size over any [`Real`].

use core::ops::{Add, Index, IndexMut, Mul, Neg, Sub};

use super::{Real, Wide};

/// A dense matrix, stored row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix<R> {
    rows: usize,
    cols: usize,
    data: Vec<R>,
}

impl<R> Matrix<R> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// All entries, row by row.
    pub fn entries(&self) -> &[R] {
        &self.data
    }

    /// Row `i`.
    #[inline]
    pub fn row(&self, i: usize) -> &[R] {
        &self.data[i * self.cols..][..self.cols]
    }

    /// Row `i`, to be changed.
    #[inline]
    pub fn row_mut(&mut self, i: usize) -> &mut [R] {
        &mut self.data[i * self.cols..][..self.cols]
    }

    /// The rows as slices.
    pub fn row_slices(&self) -> impl Iterator<Item = &[R]> {
        (0..self.rows).map(|i| self.row(i))
    }

    /// Applies `f` to every entry.
    pub fn map<S>(&self, f: impl FnMut(&R) -> S) -> Matrix<S> {
        Matrix { rows: self.rows, cols: self.cols, data: self.data.iter().map(f).collect() }
    }
}

impl<R: Real> Matrix<R> {
    /// The matrix whose entry at (row, column) is `entry(row, column)`.
    pub fn from_fn(rows: usize, cols: usize, mut entry: impl FnMut(usize, usize) -> R) -> Self {
        let mut data = Vec::with_capacity(rows * cols);
        for i in 0..rows {
            for j in 0..cols {
                data.push(entry(i, j));
            }
        }
        Self { rows, cols, data }
    }

    /// A `rows`×`cols` matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self { rows, cols, data: vec![R::zero(); rows * cols] }
    }

    /// The identity, `size`×`size`.
    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, size, |i, j| if i == j { R::one() } else { R::zero() })
    }

    /// A square matrix with `diagonal` on its diagonal and zeros elsewhere.
    pub fn from_diagonal(diagonal: &[R]) -> Self {
        let size = diagonal.len();
        Self::from_fn(size, size, |i, j| if i == j { diagonal[i].clone() } else { R::zero() })
    }

    /// A column vector.
    pub fn column(entries: &[R]) -> Self {
        Self { rows: entries.len(), cols: 1, data: entries.to_vec() }
    }

    /// Converts rows of `f64` exactly; all rows have the length of the first.
    pub fn from_f64_rows(rows: &[Vec<f64>]) -> Self {
        let cols = rows.first().map_or(0, Vec::len);
        Self::from_fn(rows.len(), cols, |i, j| R::from_f64(rows[i][j]))
    }

    /// Every entry rounded to `f64`, row by row.
    pub fn to_f64_rows(&self) -> Vec<Vec<f64>> {
        (0..self.rows).map(|i| (0..self.cols).map(|j| self[(i, j)].to_f64()).collect()).collect()
    }

    /// Whether every entry is finite.
    pub fn is_finite(&self) -> bool {
        self.data.iter().all(R::is_finite)
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self[(j, i)].clone())
    }

    /// `f` of each entry and the one of `right` at the same place.
    fn with(&self, right: &Self, f: impl Fn(&R, &R) -> R) -> Self {
        let data = self.data.iter().zip(&right.data).map(|(left, right)| f(left, right)).collect();
        Self { rows: self.rows, cols: self.cols, data }
    }

    /// Every entry times `factor`.
    pub fn scaled(&self, factor: &R) -> Self {
        self.map(|entry| entry.times(factor))
    }

    /// `(X + Xᵀ) / 2`: removes rounding errors that spoil the symmetry of a result.
    pub fn symmetric_part(&self) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| {
            (self[(i, j)].clone() + &self[(j, i)]).scale_by_power_of_two(-1)
        })
    }

    /// `selfᵀ · right`.
    pub fn transposed_times(&self, right: &Self) -> Self {
        assert_eq!(self.rows, right.rows, "inner dimensions of a product");
        let mut product = Self::zeros(self.cols, right.cols);
        for i in 0..self.cols {
            for k in 0..self.rows {
                add_row(product.row_mut(i), &self[(k, i)], right.row(k));
            }
        }
        product
    }

    /// `self · right` for a product that is known to be symmetric: one triangle is computed and mirrored.
    pub fn symmetric_product(&self, right: &Self) -> Self {
        assert_eq!((self.cols, self.rows), (right.rows, right.cols), "dimensions of a symmetric product");
        let mut product = Self::zeros(self.rows, self.rows);
        for i in 0..self.rows {
            for j in i..self.rows {
                let terms = (0..self.cols).map(|k| self[(i, k)].times(&right[(k, j)]));
                let entry = terms.fold(R::zero(), |sum, term| term + &sum);
                (product[(i, j)], product[(j, i)]) = (entry.clone(), entry);
            }
        }
        product
    }

    /// The `rows`×`cols` block whose first entry is at (`top`, `left`).
    pub fn block(&self, top: usize, left: usize, rows: usize, cols: usize) -> Self {
        Self::from_fn(rows, cols, |i, j| self[(top + i, left + j)].clone())
    }

    /// The matrix with `block` written over the entries from (`top`, `left`) on.
    pub fn with_block(mut self, top: usize, left: usize, block: &Self) -> Self {
        for i in 0..block.rows {
            self.row_mut(top + i)[left..][..block.cols].clone_from_slice(block.row(i));
        }
        self
    }

    /// `[self right]`.
    pub fn beside(&self, right: &Self) -> Self {
        Self::zeros(self.rows, self.cols + right.cols).with_block(0, 0, self).with_block(0, self.cols, right)
    }

    /// `[self; below]`.
    pub fn above(&self, below: &Self) -> Self {
        Self::zeros(self.rows + below.rows, self.cols).with_block(0, 0, self).with_block(self.rows, 0, below)
    }

    /// 1-norm ‖·‖₁: the largest column sum of absolute values.
    pub fn norm(&self) -> R {
        (0..self.cols)
            .map(|j| (0..self.rows).fold(R::zero(), |sum, i| sum + &self[(i, j)].abs()))
            .fold(R::zero(), R::max)
    }

    /// The largest absolute value of an entry.
    pub fn largest_entry(&self) -> R {
        self.data.iter().map(R::abs).fold(R::zero(), R::max)
    }
}

impl Matrix<Wide> {
    /// Applies `round` to every entry. Entries that are only rounding error, below `2^(-bits/2)` times the largest,
    /// become zero first.
    pub fn rounded<S>(&self, mut round: impl FnMut(&Wide) -> S) -> Matrix<S> {
        let noise = self.largest_entry().scale_by_power_of_two(-(Wide::bits() as i32) / 2);
        let zero = Wide::zero();
        self.map(|entry| round(if entry.abs() < noise { &zero } else { entry }))
    }

    /// Rows of the nearest `f64` values, with entries that are only rounding error set to zero.
    pub fn round_to_f64_rows(&self) -> Vec<Vec<f64>> {
        self.rounded(Wide::round_to_f64).to_f64_rows()
    }
}

impl<R> Index<(usize, usize)> for Matrix<R> {
    type Output = R;
    #[inline]
    fn index(&self, (i, j): (usize, usize)) -> &R {
        &self.data[i * self.cols + j]
    }
}

impl<R> IndexMut<(usize, usize)> for Matrix<R> {
    #[inline]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut R {
        &mut self.data[i * self.cols + j]
    }
}

/// Adds `factor · row` to `entries`.
#[inline]
fn add_row<R: Real>(entries: &mut [R], factor: &R, row: &[R]) {
    if factor.is_zero() {
        return; // models are sparse, and products of wide numbers are slow
    }
    let row = &row[..entries.len()];
    for j in 0..entries.len() {
        entries[j] = row[j].times(factor) + &entries[j];
    }
}

impl<R: Real> Matrix<R> {
    /// Writes the product with the column `entries` into `product`: the bits of `*`, without new memory.
    ///
    /// # Panics
    /// If `entries` is shorter than a row, or `product` longer than a column.
    pub fn times_column(&self, entries: &[R], product: &mut [R]) {
        for (i, of_row) in product.iter_mut().enumerate() {
            let row = self.row(i);
            let entries = &entries[..row.len()];
            let mut sum = R::zero();
            for k in 0..row.len() {
                if !row[k].is_zero() {
                    sum = entries[k].times(&row[k]) + &sum;
                }
            }
            *of_row = sum;
        }
    }
}

impl<R: Real> Mul for &Matrix<R> {
    type Output = Matrix<R>;
    fn mul(self, right: &Matrix<R>) -> Matrix<R> {
        assert_eq!(self.cols, right.rows, "inner dimensions of a product");
        let mut product = Matrix::zeros(self.rows, right.cols);
        for i in 0..self.rows {
            for k in 0..self.cols {
                add_row(product.row_mut(i), &self[(i, k)], right.row(k));
            }
        }
        product
    }
}

impl<R: Real> Add for &Matrix<R> {
    type Output = Matrix<R>;
    fn add(self, right: &Matrix<R>) -> Matrix<R> {
        assert_eq!((self.rows, self.cols), (right.rows, right.cols), "dimensions of a sum");
        self.with(right, |left, right| left.clone() + right)
    }
}

impl<R: Real> Sub for &Matrix<R> {
    type Output = Matrix<R>;
    fn sub(self, right: &Matrix<R>) -> Matrix<R> {
        assert_eq!((self.rows, self.cols), (right.rows, right.cols), "dimensions of a difference");
        self.with(right, R::minus)
    }
}

impl<R: Real> Neg for &Matrix<R> {
    type Output = Matrix<R>;
    fn neg(self) -> Matrix<R> {
        self.map(|entry| -entry.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(rows: &[&[f64]]) -> Matrix<f64> {
        Matrix::from_f64_rows(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())
    }

    #[test]
    fn products_and_blocks_follow_the_textbook() {
        let a = matrix(&[&[1.0, 2.0], &[3.0, 4.0]]);
        let b = matrix(&[&[0.0, 1.0], &[1.0, 1.0]]);
        assert_eq!(&a * &b, matrix(&[&[2.0, 3.0], &[4.0, 7.0]]));
        assert_eq!(a.transpose(), matrix(&[&[1.0, 3.0], &[2.0, 4.0]]));
        assert_eq!(a.beside(&b).above(&b.beside(&a)).block(0, 2, 2, 2), b);
        assert_eq!(a.norm(), 6.0);
        assert_eq!((&a - &a).largest_entry(), 0.0);
    }
}
