//! Matrices as constants.

use nalgebra::{ArrayStorage, SMatrix};

/// A constant matrix, given column by column; usable in a `const`.
pub const fn columns<const R: usize, const C: usize>(entries: [[f32; R]; C]) -> SMatrix<f32, R, C> {
    SMatrix::from_array_storage(ArrayStorage(entries))
}
