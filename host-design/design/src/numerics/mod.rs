//! Dense linear algebra over any [`Real`]: the same routines run in `f64` and in extended precision. And power spectra.

mod eigenvalues;
mod exponential;
mod matrix;
mod real;
mod solve;
mod spectrum;
mod wide;

pub use eigenvalues::{Complex, NoConvergence, eigenvalues, spectral_radius};
pub use exponential::exponential;
pub use matrix::Matrix;
pub use real::Real;
pub use solve::{Lu, Singular, solve, solve_right};
pub use spectrum::{Bandwidth, SEGMENT, Spectrum};
pub use wide::{Wide, with_precision};
