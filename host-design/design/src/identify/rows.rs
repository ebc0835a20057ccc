//! Row operations of the innermost loops of identification. They use indices, as iterators are not inlined everywhere.

/// Adds a multiple of `from` to `row`, over the shorter of both lengths.
#[inline]
pub(super) fn add_multiple(row: &mut [f64], factor: f64, from: &[f64]) {
    let length = row.len().min(from.len());
    let (row, from) = (&mut row[..length], &from[..length]);
    (0..length).for_each(|i| row[i] += factor * from[i]);
}

/// Sets `row` to a multiple of `from`, over the shorter of both lengths.
#[inline]
pub(super) fn set_multiple(row: &mut [f64], factor: f64, from: &[f64]) {
    let length = row.len().min(from.len());
    let (row, from) = (&mut row[..length], &from[..length]);
    (0..length).for_each(|i| row[i] = factor * from[i]);
}
