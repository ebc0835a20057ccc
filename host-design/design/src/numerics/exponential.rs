//! The matrix exponential.

use super::{Matrix, Real};

/// `e^A` of a square matrix by the Taylor series of `A / 2^s`, squared `s` times.
///
/// Extended precision has digits to spare, so the simplest method is also the most trustworthy one (Moler & Van Loan,
/// *Nineteen dubious ways*, SIAM Review 2003, method 3).
#[doc(alias = "expm")]
pub fn exponential<R: Real>(a: &Matrix<R>) -> Matrix<R> {
    // ‖A‖ / 2^s <= 2^-8 makes about bits / 8 terms enough.
    let norm = a.norm().to_f64();
    let squarings = if norm > 0.0 { (norm.log2().ceil() as i32 + 8).max(0) } else { 0 };
    let scaled = a.map(|entry| entry.scale_by_power_of_two(-squarings));
    let mut sum = Matrix::identity(a.rows());
    let mut term = sum.clone();
    for order in 1..=R::bits() {
        term = (&term * &scaled).map(|entry| entry.clone() / &R::from_f64(order as f64));
        sum = &sum + &term;
        if term.largest_entry() <= R::epsilon().scale_by_power_of_two(-8) {
            break;
        }
    }
    for _ in 0..squarings {
        sum = &sum * &sum;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::Wide;
    use super::*;

    type W = Wide;

    #[test]
    fn a_rotation_and_a_nilpotent_block_have_their_closed_forms() {
        let angle = 2.5;
        let generator = Matrix::<W>::from_f64_rows(&[vec![0.0, -angle], vec![angle, 0.0]]);
        let rotation = exponential(&generator);
        assert!(
            (rotation[(0, 0)].clone() - &W::from_f64(angle).cos()).abs()
                < W::epsilon().scale_by_power_of_two(20)
        );
        assert!(
            (rotation[(1, 0)].clone() - &W::from_f64(angle).sin()).abs()
                < W::epsilon().scale_by_power_of_two(20)
        );

        let integrators =
            Matrix::<W>::from_f64_rows(&[vec![0.0, 3.0, 0.0], vec![0.0, 0.0, 3.0], vec![0.0; 3]]);
        assert_eq!(exponential(&integrators).to_f64_rows()[0], vec![1.0, 3.0, 4.5]);
    }

    #[test]
    fn the_exponential_of_the_negative_is_the_inverse() {
        let a =
            Matrix::<W>::from_f64_rows(&[vec![1.0, 200.0, 3.0], vec![-4.0, 5.0, 0.6], vec![7.0, -8.0, 9.0]]);
        let product = &exponential(&a) * &exponential(&-&a);
        let bound = W::epsilon().scale_by_power_of_two(100);
        assert!((&product - &Matrix::identity(3)).norm() < bound);
    }
}
