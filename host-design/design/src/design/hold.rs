//! The plant and its cost over a tick, by what the drive holds in it.

use super::riccati::Cost;
use super::zero_order_hold::{integrated_quadratic, sampled_cost, zero_order_hold};
use crate::numerics::{Matrix, Real, exponential};
use crate::rig::Held;

impl Held {
    /// Loss of force per speed while it is held (N·s/m): by the back-EMF of a motor whose voltage is held.
    pub fn braking_n_s_per_m(self) -> f64 {
        match self {
            Self::Voltage { braking_n_s_per_m } => braking_n_s_per_m,
            Self::Force | Self::MeanSpeed | Self::LaggingSpeed { .. } => 0.0,
        }
    }

    /// Ad and Bd of `x⁺ = Ad x + Bd u` for `ẋ = a x + b u` and ticks of `t` (s).
    pub fn sampled<R: Real>(self, a: &Matrix<R>, b: &Matrix<R>, t: &R) -> (Matrix<R>, Matrix<R>) {
        let (ad, held) = zero_order_hold(a, b, t);
        let bd = match self {
            Self::Force | Self::Voltage { .. } => held,
            Self::MeanSpeed => (&(&ad * b) + b).scaled(&t.scale_by_power_of_two(-1)),
            Self::LaggingSpeed { lag_s } => {
                let (s, (at_first, decaying)) = (a.rows(), decaying(a, b, t, lag_s));
                exponential(&decaying.scaled(t)).block(0, s, s, 1).scaled(&at_first)
            }
        };
        (ad, bd)
    }

    /// The cost of one tick in terms of the state at its start and the input. The sampled sum then equals the
    /// continuous integral of the states' cost, and t times that of the input.
    pub(crate) fn cost<R: Real>(self, a: &Matrix<R>, b: &Matrix<R>, cost: &Cost<R>, t: &R) -> Cost<R> {
        match self {
            Self::Force | Self::Voltage { .. } => sampled_cost(a, b, cost, t),
            // After the first half of the jump, `b u t/2`, the state moves freely.
            Self::MeanSpeed => {
                let free = sampled_cost(a, &Matrix::zeros(a.rows(), b.cols()), cost, t);
                let jump = b.scaled(&t.scale_by_power_of_two(-1));
                let q_jump = &free.q * &jump;
                let both = &jump.transpose() * &(&free.s + &free.s);
                Cost {
                    r: &(&free.r + &(&jump.transpose() * &q_jump)) + &both,
                    s: &q_jump + &free.s,
                    q: free.q,
                }
            }
            Self::LaggingSpeed { lag_s } => {
                let (s, (at_first, decaying)) = (a.rows(), decaying(a, b, t, lag_s));
                let weights = Matrix::zeros(s + 1, s + 1).with_block(0, 0, &cost.q);
                let integrated = integrated_quadratic(&decaying, &weights, t);
                let moved = integrated.block(s, s, 1, 1).scaled(&at_first).scaled(&at_first);
                Cost {
                    q: integrated.block(0, 0, s, s),
                    r: &cost.r.scaled(t) + &moved,
                    s: integrated.block(0, s, s, 1).scaled(&at_first),
                }
            }
        }
    }
}

/// A of the plant whose input, a force on the cart, falls by `braking_n_s_per_m` times the speed of the cart (state 1).
pub fn with_braking(a: &Matrix<f64>, b: &Matrix<f64>, braking_n_s_per_m: f64) -> Matrix<f64> {
    let loss = |row: usize, column: usize| if column == 1 { braking_n_s_per_m * b[(row, 0)] } else { 0.0 };
    Matrix::from_fn(a.rows(), a.cols(), |row, column| a[(row, column)] - loss(row, column))
}

/// The plant whose input decays during the tick as `e^(-τ/lag)`, with the input as a further state, and the input at
/// the beginning of the tick for a mean of 1.
fn decaying<R: Real>(a: &Matrix<R>, b: &Matrix<R>, t: &R, lag_s: f64) -> (R, Matrix<R>) {
    let s = a.rows();
    let rate = R::one() / &R::from_f64(lag_s);
    let mut decaying = Matrix::zeros(s + 1, s + 1).with_block(0, 0, a).with_block(0, s, b);
    decaying[(s, s)] = R::zero() - &rate;
    let lags = rate * t;
    let approached = R::one() - &(R::zero() - &lags).exp();
    (lags / &approached, decaying)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Wide;

    type W = Wide;

    /// A cart alone: x and v.
    fn cart() -> (Matrix<W>, Matrix<W>) {
        (
            Matrix::from_f64_rows(&[vec![0.0, 1.0], vec![0.0, 0.0]]),
            Matrix::from_f64_rows(&[vec![0.0], vec![1.0]]),
        )
    }

    #[test]
    fn a_cart_that_approaches_its_speed_is_where_the_integral_says() {
        let (a, b) = cart();
        let (lag, t) = (0.25, 0.5);
        let left = libm::exp(-t / lag);
        // v(τ) = v_c (1 - e^(-τ/lag)) with v_c = a t / (1 - e^(-t/lag)).
        let wanted = t / (1.0 - left) * (t - lag * (1.0 - left));
        let (ad, bd) = Held::LaggingSpeed { lag_s: lag }.sampled(&a, &b, &W::from_f64(t));
        assert_eq!(ad.to_f64_rows(), [[1.0, 0.5], [0.0, 1.0]]);
        let found = bd.to_f64_rows();
        assert!(
            (found[0][0] - wanted).abs() < 1e-15 && (found[1][0] - t).abs() < 1e-15,
            "{found:?} {wanted}"
        );
        // A very slow drive is commanded so much that the acceleration hardly changes in a tick.
        let (_, slow) = Held::LaggingSpeed { lag_s: 1e6 }.sampled(&a, &b, &W::from_f64(t));
        assert!((slow.to_f64_rows()[0][0] - 0.125).abs() < 1e-7, "{:?}", slow.to_f64_rows());
    }

    #[test]
    fn the_cost_of_a_slow_drive_is_that_of_a_constant_input_and_a_fast_ones_that_of_a_jump() {
        let (a, b) = cart();
        let t = W::from_f64(0.5);
        let cost = Cost::new(Matrix::from_diagonal(&[W::one(), W::from_f64(2.0)]), Matrix::identity(1));
        let entries = |held: Held| {
            let Cost { q, r, s } = held.cost(&a, &b, &cost, &t);
            [q, r, s].map(|m| m.to_f64_rows().concat()).concat()
        };
        let near = |one: Vec<f64>, two: &[f64]| one.iter().zip(two).all(|(x, y)| (x - y).abs() < 1e-5);
        let constant = entries(Held::Force);
        assert!(
            near(entries(Held::LaggingSpeed { lag_s: 1e6 }), &constant),
            "{:?} {constant:?}",
            entries(Held::LaggingSpeed { lag_s: 1e6 })
        );
        // At once faster by u t: ∫ (u t τ)² + 2 (u t)² dτ + t u².
        let r = 0.25 * (0.125 / 3.0 + 2.0 * 0.5) + 0.5;
        let fast = entries(Held::LaggingSpeed { lag_s: 1e-7 });
        assert!((fast[4] - r).abs() < 1e-5, "{fast:?} {r}");
        assert!(!near(fast, &constant));
    }
}
