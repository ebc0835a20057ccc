//! Pole placement for one input.

use crate::numerics::{Complex, Matrix, Real, Singular, solve};

/// A wanted pole: real, or a complex pair given by the member with positive imaginary part.
#[derive(Debug, Clone, PartialEq)]
pub enum Pole<R> {
    /// One real pole.
    Real(R),
    /// A complex pole and its conjugate.
    Pair(Complex<R>),
}

impl<R: Real> Pole<R> {
    /// Number of states it takes: 1 or 2.
    pub fn order(&self) -> usize {
        match self {
            Pole::Real(_) => 1,
            Pole::Pair(_) => 2,
        }
    }

    /// The sampled pole `e^(pT)` of a continuous one.
    pub fn sampled(&self, period: &R) -> Self {
        match self {
            Pole::Real(p) => Pole::Real((p.clone() * period).exp()),
            Pole::Pair(p) => {
                let (size, angle) = ((p.re.clone() * period).exp(), p.im.clone() * period);
                Pole::Pair(Complex { re: size.clone() * &angle.cos(), im: size * &angle.sin() })
            }
        }
    }
}

/// The gain K, 1×s, with which `A - B K` has exactly these poles, for A s×s and B s×1. Repeated poles are allowed.
///
/// Ackermann's formula `K = [0 … 0 1] [B AB … Aˢ⁻¹B]⁻¹ p(A)` (J. Ackermann, *Regelungstechnik* 20, 1972): useless in
/// double precision beyond a few states, but exact with enough bits. The polynomial is applied to the row factor by
/// factor and never expanded.
///
/// # Errors
/// [`Singular`]: the pair (A, B) is not controllable, or working precision cannot tell.
///
/// # Panics
/// If the orders of `poles` do not add up to the number of states.
#[doc(alias = "acker")]
#[doc(alias = "ackermann")]
#[doc(alias = "pole_placement")]
pub fn place<R: Real>(a: &Matrix<R>, b: &Matrix<R>, poles: &[Pole<R>]) -> Result<Matrix<R>, Singular> {
    let states = a.rows();
    assert_eq!(poles.iter().map(Pole::order).sum::<usize>(), states, "one pole for each state");
    let mut reach = Matrix::zeros(states, states);
    let mut column = b.clone();
    for j in 0..states {
        reach = reach.with_block(0, j, &column);
        column = a * &column;
    }
    let last = Matrix::from_fn(states, 1, |i, _| if i + 1 == states { R::one() } else { R::zero() });
    let mut row = solve(&reach.transpose(), &last)?.transpose();
    for pole in poles {
        let image = &row * a;
        row = match pole {
            Pole::Real(p) => &image - &row.scaled(p),
            Pole::Pair(p) => {
                // A² - 2 Re(p) A + |p|² I
                let sum = p.re.scale_by_power_of_two(1);
                let product = p.re.clone() * &p.re + &(p.im.clone() * &p.im);
                &(&(&image * a) - &image.scaled(&sum)) + &row.scaled(&product)
            }
        };
    }
    Ok(row)
}

/// The dominant pair of a second-order response: the equations of the paper's section 3.3.
///
/// With `ε = |ln(PO/100)| / √(π² + ln²(PO/100))` and `ωₙ = 4 / (ε tₛ)` the pair is `-ε ωₙ ± j ωₙ √(1 - ε²)`.
/// Overshoot in percent (0 < PO < 100), settling time in seconds.
pub fn dominant_pair<R: Real>(overshoot_percent: f64, settling_time_s: f64) -> Complex<R> {
    let log = (R::from_f64(overshoot_percent) / &R::from_f64(100.0)).ln().abs();
    let damping = log.clone() / &(R::pi() * &R::pi() + &(log.clone() * &log)).sqrt();
    let re = -(R::from_f64(4.0) / &R::from_f64(settling_time_s));
    let natural = -(re.clone() / &damping);
    let im = natural * &(R::one() - &(damping.clone() * &damping)).sqrt();
    Complex { re, im }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{Wide, eigenvalues};
    use proptest::prelude::*;

    type W = Wide;

    #[test]
    fn the_papers_dominant_pair() {
        let pair = dominant_pair::<W>(1.0, 6.0);
        assert_eq!(pair.re.to_f64(), -4.0 / 6.0);
        assert!((pair.im.to_f64() - 0.454_792).abs() < 5e-7);
        assert!((pair.modulus().to_f64() - 0.807_019).abs() < 5e-7);
    }

    #[test]
    fn repeated_poles_on_integrators_are_binomial_coefficients() {
        let chain = Matrix::<W>::from_fn(4, 4, |i, j| if j == i + 1 { W::one() } else { W::zero() });
        let end = Matrix::from_fn(4, 1, |i, _| if i == 3 { W::one() } else { W::zero() });
        let k = place(&chain, &end, &vec![Pole::Real(W::from_f64(-1.0)); 4]).unwrap();
        assert_eq!(k.to_f64_rows()[0], [1.0, 4.0, 6.0, 4.0]);
    }

    #[test]
    fn an_uncontrollable_pair_is_refused() {
        let a = Matrix::<W>::from_diagonal(&[W::one(), W::one()]);
        let b = Matrix::column(&[W::one(), W::one()]);
        assert!(place(&a, &b, &vec![Pole::Real(W::zero()); 2]).is_err());
    }

    proptest! {
        #[test]
        fn the_loop_has_the_poles_that_were_asked_for(
            entries in prop::collection::vec(-10.0..10.0f64, 25), column in prop::collection::vec(-3.0..3.0f64, 5),
            re in -9.0..-1.0f64, im in 0.1..5.0f64, real in prop::collection::vec(-30.0..-10.0f64, 3),
        ) {
            let a = Matrix::from_fn(5, 5, |i, j| W::from_f64(entries[5 * i + j]));
            let b = Matrix::from_fn(5, 1, |i, _| W::from_f64(column[i]));
            let mut poles = vec![Pole::Pair(Complex { re: W::from_f64(re), im: W::from_f64(im) })];
            poles.extend(real.iter().map(|&p| Pole::Real(W::from_f64(p))));
            let k = place(&a, &b, &poles).unwrap();
            let found = eigenvalues(&(&a - &(&b * &k))).unwrap();
            for wanted in real.iter().map(|&p| [p, 0.0]).chain([[re, im], [re, -im]]) {
                let distance = found.iter().map(Complex::to_f64).map(|p| (p[0] - wanted[0]).hypot(p[1] - wanted[1]));
                prop_assert!(distance.fold(f64::INFINITY, f64::min) < 1e-12);
            }
        }
    }
}
