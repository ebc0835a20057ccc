//! Dense linear algebra over any [`Real`]: the same routines run in `f64` and in extended precision. And power spectra.
//!
//! ```
//! use upright_design::numerics::{Matrix, solve};
//!
//! let a = Matrix::from_f64_rows(&[vec![2.0, 1.0], vec![0.0, 4.0]]);
//! let x = solve(&a, &Matrix::column(&[4.0, 8.0])).unwrap();
//! assert_eq!(x, Matrix::column(&[1.0, 2.0]));
//! ```

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
