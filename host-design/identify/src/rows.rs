//! Operations on the rows of matrices in the innermost loops of identification. They use indices, as iterators are not
//! inlined everywhere.

/// Adds a multiple of `from` to `row`, over the shorter of both lengths.
#[inline]
pub(crate) fn add_multiple(row: &mut [f64], factor: f64, from: &[f64]) {
    let length = row.len().min(from.len());
    let (row, from) = (&mut row[..length], &from[..length]);
    (0..length).for_each(|i| row[i] += factor * from[i]);
}

/// Sets `row` to a multiple of `from`, over the shorter of both lengths.
#[inline]
pub(crate) fn set_multiple(row: &mut [f64], factor: f64, from: &[f64]) {
    let length = row.len().min(from.len());
    let (row, from) = (&mut row[..length], &from[..length]);
    (0..length).for_each(|i| row[i] = factor * from[i]);
}

/// Replaces the lower triangle of a symmetric positive definite matrix, m×m, by L and 1/D of `L D Lᵀ`.
pub(crate) fn factorise(matrix: &mut [f64], m: usize) {
    for k in 0..m {
        let inverse = 1.0 / matrix[k * m + k];
        matrix[k * m + k] = inverse;
        for i in k + 1..m {
            let l = matrix[i * m + k] * inverse;
            for j in k + 1..=i {
                matrix[i * m + j] -= l * matrix[j * m + k];
            }
        }
        for i in k + 1..m {
            matrix[i * m + k] *= inverse;
        }
    }
}

/// Replaces `columns` right-hand sides, stored as the columns of m rows, by their solutions.
pub(crate) fn solve(factors: &[f64], m: usize, columns: usize, rows: &mut [f64]) {
    let take = |rows: &mut [f64], to: usize, from: usize, factor: f64| {
        let (low, high) = (to.min(from), to.max(from));
        let (first, second) = rows.split_at_mut(high * columns);
        let (first, second) = (&mut first[low * columns..][..columns], &mut second[..columns]);
        let (to, from) = if to < from { (first, &*second) } else { (second, &*first) };
        add_multiple(to, -factor, from);
    };
    for i in 1..m {
        for k in 0..i {
            take(rows, i, k, factors[i * m + k]);
        }
    }
    for i in 0..m {
        rows[i * columns..][..columns].iter_mut().for_each(|value| *value *= factors[i * m + i]);
    }
    for k in (0..m).rev() {
        for i in k + 1..m {
            take(rows, k, i, factors[i * m + k]);
        }
    }
}
