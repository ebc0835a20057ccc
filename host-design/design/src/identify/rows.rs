//! Rows of numbers in the innermost loops of identification. By indices: iterators are not inlined everywhere.

/// Adds a multiple of `from` to `row`, as far as both go.
#[inline]
pub(super) fn add_multiple(row: &mut [f64], factor: f64, from: &[f64]) {
    let length = row.len().min(from.len());
    let (row, from) = (&mut row[..length], &from[..length]);
    (0..length).for_each(|i| row[i] += factor * from[i]);
}

/// Makes `row` a multiple of `from`, as far as both go.
#[inline]
pub(super) fn set_multiple(row: &mut [f64], factor: f64, from: &[f64]) {
    let length = row.len().min(from.len());
    let (row, from) = (&mut row[..length], &from[..length]);
    (0..length).for_each(|i| row[i] = factor * from[i]);
}
