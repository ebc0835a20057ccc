//! Feedback and filter along a path.

use super::dynamics::Dynamics;
use super::hold::{HeldTick, tick};
use super::refine::Path;
use upright_design::design::add_rounded_motion;
use upright_design::numerics::{Matrix, Singular, solve_right};

/// The ticks of a path with their derivatives.
pub(crate) fn ticks(dynamics: &dyn Dynamics, path: &Path, tick_s: f64) -> Vec<HeldTick> {
    path.x.iter().zip(&path.u).map(|(x, &u)| tick(dynamics, x, u, tick_s)).collect()
}

/// `[Q S; Sᵀ R]` of one tick in state and held force: the integral of the continuous cost over the tick, by Simpson's
/// rule, with the trajectory of the state to first order in the deviations. `weights` is diagonal.
fn tick_cost(tick: &HeldTick, weights: &Matrix<f64>, input_weight: f64, tick_s: f64) -> Matrix<f64> {
    let s = tick.whole.rows();
    let over = |by: &Matrix<f64>| {
        Matrix::from_fn(s, s + 1, |k, i| weights[(k, k)] * by[(k, i)]).transposed_times(by)
    };
    let start = |i: usize, j: usize| if i < s && j < s { weights[(i, j)] } else { 0.0 };
    let (middle, end) = (over(&tick.middle), over(&tick.whole));
    let mut cost = Matrix::from_fn(s + 1, s + 1, |i, j| {
        (start(i, j) + 4.0 * middle[(i, j)] + end[(i, j)]) * (tick_s / 6.0)
    });
    cost[(s, s)] += tick_s * input_weight;
    cost
}

/// One backward step of the Riccati recursion: the gain K (1×s), and the cost-to-go before the tick.
fn step_back(tick: &HeldTick, cost: &Matrix<f64>, ahead: &Matrix<f64>) -> (Matrix<f64>, Matrix<f64>) {
    let s = tick.whole.rows();
    let all = cost + &tick.whole.transposed_times(&(ahead * &tick.whole));
    let h = all[(s, s)];
    let k = Matrix::from_fn(1, s, |_, j| 0.5 * (all[(s, j)] + all[(j, s)]) / h);
    let before = Matrix::from_fn(s, s, |i, j| all[(i, j)] - h * k[(0, i)] * k[(0, j)]).symmetric_part();
    (k, before)
}

/// Gains K of each tick that minimise the sampled cost with `at_end` as the cost-to-go of the last state. Weights are
/// those of `[lqr]`, per second.
pub(crate) fn feedback(
    ticks: &[HeldTick],
    weights: &Matrix<f64>,
    input_weight: f64,
    at_end: &Matrix<f64>,
    tick_s: f64,
) -> Vec<Matrix<f64>> {
    let mut ahead = at_end.clone();
    let mut gains: Vec<Matrix<f64>> = ticks
        .iter()
        .rev()
        .map(|tick| {
            let (k, before) = step_back(tick, &tick_cost(tick, weights, input_weight, tick_s), &ahead);
            ahead = before;
            k
        })
        .collect();
    gains.reverse();
    gains
}

/// The stationary cost-to-go and gain about a state of rest: the recursion is repeated until the gain is constant.
pub(crate) fn stationary(
    tick: &HeldTick,
    weights: &Matrix<f64>,
    input_weight: f64,
    tick_s: f64,
) -> (Matrix<f64>, Matrix<f64>) {
    const MOST: usize = 200_000;
    let cost = tick_cost(tick, weights, input_weight, tick_s);
    let (mut ahead, mut gain) = (weights.clone(), Matrix::zeros(1, tick.whole.rows()));
    for _ in 0..MOST {
        let (k, before) = step_back(tick, &cost, &ahead);
        let change = (&k - &gain).largest_entry();
        let size = k.largest_entry();
        (ahead, gain) = (before, k);
        if change <= 1e-13 * size {
            break;
        }
    }
    (ahead, gain)
}

/// Time for which the error of a friction force stays about the same in a motion (s).
const FRICTION_TIME_S: f64 = 0.03;

/// Noise that a filter expects.
pub(crate) struct Noise {
    /// Intensities of force and joint torques (N²·s, (N·m)²·s).
    pub(crate) intensities: Vec<f64>,
    /// Error of the viscous friction of cart and joints that it allows for (N·s/m, N·m·s/rad).
    pub(crate) friction_errors: Vec<f64>,
    /// State that each sensor measures, and the variance of its rounding.
    pub(crate) sensors: Vec<(usize, f64)>,
    /// Whether the drive knows position and speed of the cart, to the rounding of the first sensor: then no sensor
    /// corrects them.
    pub(crate) knows_cart: bool,
}

impl Noise {
    /// Intensities at the rates of `x`: wrong friction acts like noise that is constant for [`FRICTION_TIME_S`].
    fn at(&self, x: &[f64]) -> Vec<f64> {
        let friction = x.iter().skip(1).step_by(2).zip(&self.friction_errors);
        let friction = friction.map(|(rate, error)| rate * rate * error * error * FRICTION_TIME_S);
        self.intensities.iter().zip(friction).map(|(noise, friction)| noise + friction).collect()
    }
}

/// The filter along a motion: its covariance from tick to tick.
pub(crate) struct PathFilter<'a> {
    dynamics: &'a dyn Dynamics,
    noise: &'a Noise,
    tick_s: f64,
    /// Covariance of the prediction, s×s.
    pub(crate) covariance: Matrix<f64>,
}

impl<'a> PathFilter<'a> {
    /// A filter that initially knows each measured state to the rounding of its encoder, and no rate.
    pub(crate) fn new(dynamics: &'a dyn Dynamics, noise: &'a Noise, states: usize, tick_s: f64) -> Self {
        let mut covariance = Matrix::identity(states).scaled(&1e-2);
        for &(state, variance) in &noise.sensors {
            covariance[(state, state)] = variance;
        }
        if noise.knows_cart {
            (covariance[(0, 0)], covariance[(1, 1)]) = (0.0, 0.0);
        }
        Self { dynamics, noise, tick_s, covariance }
    }

    /// Returns the gain L (filter form, s×p) of this tick, and predicts the covariance over the tick from `x`.
    ///
    /// # Errors
    /// [`Singular`] if the covariance of the innovation is singular.
    pub(crate) fn gain(&mut self, x: &[f64], tick: &HeldTick) -> Result<Matrix<f64>, Singular> {
        self.gain_over(&self.disturbances(x), &tick.a())
    }

    /// Repeats the tick at a state of rest until the filter has settled.
    ///
    /// # Errors
    /// As for [`gain`](Self::gain).
    pub(crate) fn settle(
        &mut self,
        x: &[f64],
        tick: &HeldTick,
        ticks: usize,
    ) -> Result<Matrix<f64>, Singular> {
        let (disturbances, a) = (self.disturbances(x), tick.a());
        let mut l = self.gain_over(&disturbances, &a)?;
        for _ in 1..ticks {
            l = self.gain_over(&disturbances, &a)?;
        }
        Ok(l)
    }

    /// Covariances near `x`: what noise in half a tick adds to the state, and what rounding adds to the sensors.
    fn disturbances(&self, x: &[f64]) -> [Matrix<f64>; 2] {
        let (noise, mut b) = (self.noise, self.dynamics.inputs(x));
        let sensors = &noise.sensors;
        let mut rounding =
            Matrix::from_diagonal(&sensors.iter().map(|&(_, variance)| variance).collect::<Vec<_>>());
        if noise.knows_cart {
            let measured: Vec<usize> = sensors.iter().map(|&(state, _)| state).collect();
            add_rounded_motion(&mut rounding, &b, &measured);
            b.row_mut(1).fill(0.0);
        }
        let spread = &(&b * &Matrix::from_diagonal(&noise.at(x))) * &b.transpose();
        [spread.scaled(&(0.5 * self.tick_s)), rounding]
    }

    /// As [`gain`](Self::gain), for a tick with these [`disturbances`](Self::disturbances) and derivatives.
    fn gain_over(
        &mut self,
        [spread, rounding]: &[Matrix<f64>; 2],
        a: &Matrix<f64>,
    ) -> Result<Matrix<f64>, Singular> {
        let (p, sensors) = (&self.covariance, &self.noise.sensors);
        let (s, count) = (p.rows(), sensors.len());
        let to_sensors = Matrix::from_fn(s, count, |i, j| p[(i, sensors[j].0)]);
        let innovation =
            Matrix::from_fn(count, count, |i, j| p[(sensors[i].0, sensors[j].0)] + rounding[(i, j)]);
        let l = solve_right(&to_sensors, &innovation)?;
        let corrected = (p - &(&l * &to_sensors.transpose())).symmetric_part();
        // Trapezoidal rule: noise from the start of the tick goes through it, noise from its end does not.
        let through = &(a * &(&corrected + spread)) * &a.transpose();
        self.covariance = (&through + spread).symmetric_part();
        Ok(l)
    }
}
