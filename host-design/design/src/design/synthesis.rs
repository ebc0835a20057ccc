//! A whole design at one working precision: plant, sampled plant, and every gain the rig file asks for.

use super::diagnosis::{why_no_lqr, why_no_placement};
use super::error::{DesignError, Task};
use super::kalman::{Kalman, kalman};
use super::lag::{
    cost_with_pending, force_last, is_late_alone, is_late_and_lags, lag_s, shares, widened, with_lag,
};
use super::place::{Pole, dominant_pair, place};
use super::riccati::{Cost, care, dare};

use crate::numerics::{Complex, Matrix, Real, Wide, eigenvalues, solve};
use crate::plant::{ChainParameters, LinearModel, linearise};
use crate::rig::{LinearPlant, Lqr, PlantDescription, PolePlacement, Rig};
use upright::table::{Equilibrium, PerLaw};

/// Plant and gains with entries of type `T`: a working precision, or the type they were rounded to.
#[derive(Debug, Clone, PartialEq)]
#[doc(alias = "lqr")]
#[doc(alias = "lqi")]
#[doc(alias = "lqrd")]
pub struct Design<T> {
    /// A of `ẋ = A x + B u`, s×s.
    pub a: Matrix<T>,
    /// B, s×1.
    pub b: Matrix<T>,
    /// Ad of `x⁺ = Ad x + Bd u` for a force held over one tick, s×s.
    pub ad: Matrix<T>,
    /// Bd, s×1; of the mean speed during the tick if the drive imposes the cart's acceleration.
    pub bd: Matrix<T>,
    /// Time constant with which the force follows its command (s); 0 at once.
    pub lag_s: f64,
    /// Gains for continuous time. With a lag K has one more entry, for the force.
    pub continuous: Laws<T>,
    /// Gains for the tick. With one tick of delay, or a lag, K has one more entry, for the pending force.
    pub sampled: Laws<T>,
    /// The observer, if the rig file asks for one.
    pub kalman: Option<Kalman<T>>,
}

/// Both of the paper's control laws, where the rig file asks for them.
#[derive(Debug, Clone, PartialEq)]
pub struct Laws<T> {
    /// Linear quadratic regulator.
    pub lqr: Option<Feedback<T>>,
    /// Pole placement.
    pub pole_placement: Option<Feedback<T>>,
    /// Linear quadratic regulator with integral action on the output: K over [x; z], or [x; z; pending force].
    pub integral: Option<Feedback<T>>,
}

/// State feedback with precompensation, `u = N r - K x` for the set-point r.
#[derive(Debug, Clone, PartialEq)]
pub struct Feedback<T> {
    /// K, 1×s; one more entry each for integral action and for a delay or lag.
    pub k: Matrix<T>,
    /// N; none if no constant force can hold the output away from 0.
    pub n: Option<T>,
    /// Whether K is over [x; z] with the integral z of the output.
    pub integral: bool,
}

impl<R: Real> Feedback<R> {
    /// The same with N times `share`. Integral action still brings the output to the set-point, with less overshoot.
    fn with_share_of_n(self, share: &R) -> Self {
        Self { n: self.n.map(|n| n * share), ..self }
    }

    /// The same with K over [x; z; f] instead of [x; f; z], if there is a force f (`further` 1).
    fn with_force_last(self, further: usize) -> Self {
        if further == 0 { self } else { Self { k: force_last(&self.k), ..self } }
    }
}

impl Feedback<f64> {
    /// `u = N r - K x` (N) at the set-point `setpoint`, for a K over the state x alone.
    pub fn force_n(&self, setpoint: f64, x: &[f64]) -> f64 {
        let fed_back: f64 = self.k.entries().iter().zip(x).map(|(gain, entry)| gain * entry).sum();
        self.n.unwrap_or(0.0) * setpoint - fed_back
    }
}

impl<T> Laws<T> {
    /// The laws without integral action.
    pub fn each(&self) -> PerLaw<Option<&Feedback<T>>> {
        PerLaw { lqr: self.lqr.as_ref(), pole_placement: self.pole_placement.as_ref() }
    }

    /// The laws as they go into the table: LQR with integral action, if there is such a design.
    pub fn in_table(&self) -> PerLaw<Option<&Feedback<T>>> {
        PerLaw { lqr: self.integral.as_ref().or(self.lqr.as_ref()), ..self.each() }
    }

    fn none() -> Self {
        Self { lqr: None, pole_placement: None, integral: None }
    }
}

impl<R: Real> Design<R> {
    /// Designs everything that `rig` asks for.
    ///
    /// # Errors
    /// [`DesignError`] with the reason if some law has no solution.
    pub fn of(rig: &Rig) -> Result<Self, DesignError> {
        let plant = continuous_plant::<R>(rig)?;
        refuse_unbridgeable_tick(&plant.a, rig)?;
        let continuous = continuous_laws(rig, &plant)?;
        Ok(Self { continuous, ..Self::sampled_alone(rig, plant, &mut Vec::new())? })
    }

    /// Only what the table needs, the gains for the tick, for a linear plant that may differ from the rig's. Records
    /// the relative residual of each Riccati equation under the name of its gain.
    pub fn sampled_alone(
        rig: &Rig,
        plant: LinearModel<R>,
        residuals: &mut Vec<(String, f64)>,
    ) -> Result<Self, DesignError> {
        let LinearModel { a, b, torque_inputs } = plant;
        let period = R::from_f64(rig.tick.period_s);
        let (ad, bd) = rig.actuator.held().sampled(&a, &b, &period);
        let lag_s = lag_s(rig);
        let further = usize::from(lag_s > 0.0);
        let output = rig.output();
        let late = is_late_alone(rig);
        let plant =
            Self { continuous: Laws::none(), sampled: Laws::none(), kalman: None, a, b, ad, bd, lag_s };
        let (a_u, b_u) = plant.commanded(rig);

        let mut sampled = Laws::none();
        if let Some(weights) = &rig.lqr {
            let cost = plant.cost_of_a_tick(rig, weights);
            let k = lqr(Task::SampledLqr, &a_u, &b_u, &cost, residuals)?;
            sampled.lqr = Some(sampled_feedback(k, [&a_u, &b_u], [&a_u, &b_u], output, late));
            if let Some(integral) = &rig.integral {
                let (a_z, b_z) = with_integral(&a_u, &b_u, output, &period, &R::one());
                // z is constant during a tick: its cost over the tick is T w z².
                let duration = if weights.cost_is_sum { &R::one() } else { &period };
                let weight = R::from_f64(integral.position_weight) * duration;
                let cost = with_integral_weight(&cost, &weight);
                let k = lqr(Task::SampledIntegral, &a_z, &b_z, &cost, residuals)?;
                let feedback = sampled_feedback(k, [&a_u, &b_u], [&a_z, &b_z], output, late);
                let feedback = feedback.with_force_last(further);
                sampled.integral = Some(feedback.with_share_of_n(&R::from_f64(integral.setpoint_weight)));
            }
        }
        if let Some(placement) = &rig.pole_placement {
            let poles = all_poles(placement, rig)?;
            let poles: Vec<Pole<R>> = poles.iter().map(|pole| pole.sampled(&period)).collect();
            let k = placed(Task::SampledPlacement, &a_u, &b_u, &poles)?;
            sampled.pole_placement = Some(sampled_feedback(k, [&a_u, &b_u], [&a_u, &b_u], output, late));
        }
        let kalman = rig.kalman.as_ref().map(|noise| {
            let inputs = noise_inputs(rig, &plant.b, &torque_inputs);
            let (gains, residual) = kalman(&plant.a, &plant.ad, &inputs, noise, rig, &period)?;
            residuals.push((OBSERVER.to_owned(), residual.to_f64()));
            Ok(gains)
        });
        Ok(Self { sampled, kalman: kalman.transpose()?, ..plant })
    }

    /// The cost of a tick over the states of [`commanded`](Self::commanded).
    fn cost_of_a_tick(&self, rig: &Rig, weights: &Lqr) -> Cost<R> {
        let period = R::from_f64(rig.tick.period_s);
        let of_a_tick = |(a, b): (Matrix<R>, Matrix<R>), cost: Cost<R>| match weights.cost_is_sum {
            true => cost,
            false => rig.actuator.held().cost(&a, &b, &cost, &period),
        };
        let cost = lqr_cost(weights);
        if !is_late_and_lags(rig) {
            return of_a_tick(self.driven(), widened(cost, usize::from(self.lag_s > 0.0)));
        }
        let of_command = if weights.cost_is_sum { cost.r.clone() } else { cost.r.scaled(&period) };
        let of_force = Cost { r: Matrix::zeros(1, 1), ..cost };
        let of_force = of_a_tick((self.a.clone(), self.b.clone()), of_force);
        cost_with_pending(&of_force, &of_command, shares(rig, rig.tick.period_s)[0])
    }
}

/// The gains for continuous time.
fn continuous_laws<R: Real>(rig: &Rig, plant: &LinearModel<R>) -> Result<Laws<R>, DesignError> {
    let lag_s = lag_s(rig);
    let further = usize::from(lag_s > 0.0);
    let (a, b) = &with_lag(&plant.a, &plant.b, lag_s);
    let output = rig.output();
    let mut laws = Laws::none();
    if let Some(weights) = &rig.lqr {
        let cost = widened(lqr_cost(weights), further);
        let k = lqr(Task::ContinuousLqr, a, b, &cost, &mut Vec::new())?;
        laws.lqr = Some(feedback(k, a, b, output));
        if let Some(integral) = &rig.integral {
            let (a_z, b_z) = with_integral(a, b, output, &R::one(), &R::zero());
            let cost = with_integral_weight(&cost, &R::from_f64(integral.position_weight));
            let k = lqr(Task::ContinuousIntegral, &a_z, &b_z, &cost, &mut Vec::new())?;
            let share = R::from_f64(integral.setpoint_weight);
            laws.integral = Some(feedback(k, a, b, output).with_force_last(further).with_share_of_n(&share));
        }
    }
    if let Some(placement) = &rig.pole_placement {
        let k = placed(Task::ContinuousPlacement, a, b, &all_poles(placement, rig)?)?;
        laws.pole_placement = Some(feedback(k, a, b, output));
    }
    Ok(laws)
}

impl Design<Wide> {
    /// Applies `round` to every entry, after [`Matrix::rounded`] has set pure rounding errors to zero.
    pub fn rounded<S>(&self, round: fn(&Wide) -> S) -> Design<S> {
        let laws = |laws: &Laws<Wide>| {
            let feedback = |law: &Option<Feedback<Wide>>| {
                law.as_ref().map(|law| Feedback {
                    k: law.k.rounded(round),
                    n: law.n.as_ref().map(round),
                    integral: law.integral,
                })
            };
            Laws {
                lqr: feedback(&laws.lqr),
                pole_placement: feedback(&laws.pole_placement),
                integral: feedback(&laws.integral),
            }
        };
        Design {
            a: self.a.rounded(round),
            b: self.b.rounded(round),
            ad: self.ad.rounded(round),
            bd: self.bd.rounded(round),
            lag_s: self.lag_s,
            continuous: laws(&self.continuous),
            sampled: laws(&self.sampled),
            kalman: self.kalman.as_ref().map(|kalman| Kalman {
                l_filter: kalman.l_filter.rounded(round),
                l_predictor: kalman.l_predictor.rounded(round),
                steps: kalman.steps.map(round),
                innovation_variances: kalman.innovation_variances.map(round),
            }),
        }
    }
}

/// Name of the observer's gain among the residuals.
pub const OBSERVER: &str = "Kalman filter";

/// The columns through which the noise of `[kalman]` enters, one per intensity.
///
/// # Errors
/// [`DesignError::MassMatrix`] if the plant has no linear model.
pub fn noise_columns(rig: &Rig) -> Result<Matrix<f64>, DesignError> {
    let LinearModel { b, torque_inputs, .. } = continuous_plant::<Wide>(rig)?;
    Ok(noise_inputs(rig, &b, &torque_inputs).rounded(Wide::round_to_f64))
}

/// The linear plant of the rig: the chain about upright, or the given model.
pub fn continuous_plant<R: Real>(rig: &Rig) -> Result<LinearModel<R>, DesignError> {
    match &rig.plant {
        PlantDescription::Chain(chain) => {
            linearise(&ChainParameters::of(chain), Equilibrium::UPRIGHT).map_err(|_| DesignError::MassMatrix)
        }
        PlantDescription::Model(model) => Ok(LinearModel {
            a: Matrix::from_f64_rows(&model.a),
            b: Matrix::from_fn(model.b.len(), 1, |i, _| R::from_f64(model.b[i])),
            torque_inputs: Matrix::zeros(model.b.len(), 0),
        }),
    }
}

/// Columns through which the noise of `[kalman]` enters: force and joint torques, or those of the model.
fn noise_inputs<R: Real>(rig: &Rig, b: &Matrix<R>, torque_inputs: &Matrix<R>) -> Matrix<R> {
    match &rig.plant {
        PlantDescription::Model(LinearPlant { noise_input: Some(columns), .. }) => {
            Matrix::from_fn(b.rows(), columns.len(), |i, j| R::from_f64(columns[j][i]))
        }
        _ => b.beside(torque_inputs),
    }
}

/// Between two ticks an unstable mode grows by `e^(pT)`. Beyond 2²⁴ the last bit of a measurement has grown to the
/// size of the measurement: no controller in single precision can hold the plant, whatever its gains.
fn refuse_unbridgeable_tick<R: Real>(a: &Matrix<R>, rig: &Rig) -> Result<(), DesignError> {
    let poles = eigenvalues(a).map_err(|_| DesignError::Poles)?;
    let fastest = poles.iter().map(|pole| pole.re.to_f64()).fold(0.0, f64::max);
    let growth = (fastest * rig.tick.period_s).exp();
    if growth > f64::from(1 << 24) {
        return Err(DesignError::TickTooLong { tick_s: rig.tick.period_s, pole: fastest, growth });
    }
    Ok(())
}

/// Gain K of the linear quadratic regulator of (a, b).
fn lqr<R: Real>(
    task: Task,
    a: &Matrix<R>,
    b: &Matrix<R>,
    cost: &Cost<R>,
    residuals: &mut Vec<(String, f64)>,
) -> Result<Matrix<R>, DesignError> {
    let solution = if task.is_sampled() { dare(a, b, cost) } else { care(a, b, cost) };
    let regulator = solution.map_err(|_| why_no_lqr(task, a, b, cost))?;
    residuals.push((task.to_string(), regulator.residual.to_f64()));
    Ok(regulator.k)
}

/// The gain that puts the poles of (a, b) where they are wanted.
fn placed<R: Real>(
    task: Task,
    a: &Matrix<R>,
    b: &Matrix<R>,
    poles: &[Pole<R>],
) -> Result<Matrix<R>, DesignError> {
    place(a, b, poles).map_err(|_| why_no_placement::<R>(task, a, b))
}

/// Continuous feedback with N = -1 / (C (A - B K)⁻¹ B): the paper's equation for the precompensation gain. K is over
/// x, or over [x; z]; N is computed from the part over x, because with the exact N the integral settles at 0.
fn feedback<R: Real>(k: Matrix<R>, a: &Matrix<R>, b: &Matrix<R>, output: usize) -> Feedback<R> {
    let k_x = k.block(0, 0, 1, a.cols());
    let n = precompensation(&-&(a - &(b * &k_x)), b, output);
    Feedback { integral: k.cols() > a.cols(), k, n }
}

/// Sampled feedback K over the states of the plant `over` (A, B), which is `plant` or contains it, adapted to the
/// delay: with one tick of delay, `u⁺ = N r - K (Ad x + Bd u)` acts on the predicted state.
fn sampled_feedback<R: Real>(
    k: Matrix<R>,
    plant: [&Matrix<R>; 2],
    over: [&Matrix<R>; 2],
    output: usize,
    late: bool,
) -> Feedback<R> {
    let ([ad, bd], [a_z, b_z]) = (plant, over);
    // The steady state of x = Ad x + Bd u.
    let k_x = k.block(0, 0, 1, ad.cols());
    let n = precompensation(&(&Matrix::identity(ad.rows()) - &(ad - &(bd * &k_x))), bd, output);
    let k = if late { &k * &a_z.beside(b_z) } else { k };
    Feedback { k, n, integral: a_z.rows() > ad.rows() }
}

/// The plant with the integral of its output as a further state: `ż = y` (`gain` 1, `kept` 0) or `z⁺ = z + T y`
/// (`gain` T, `kept` 1).
pub(super) fn with_integral<R: Real>(
    a: &Matrix<R>,
    b: &Matrix<R>,
    output: usize,
    gain: &R,
    kept: &R,
) -> (Matrix<R>, Matrix<R>) {
    let s = a.rows();
    let mut a_z = Matrix::zeros(s + 1, s + 1).with_block(0, 0, a);
    a_z[(s, output)] = gain.clone();
    a_z[(s, s)] = kept.clone();
    (a_z, b.above(&Matrix::zeros(1, 1)))
}

fn with_integral_weight<R: Real>(cost: &Cost<R>, weight: &R) -> Cost<R> {
    let s = cost.q.rows();
    let mut q = Matrix::zeros(s + 1, s + 1).with_block(0, 0, &cost.q);
    q[(s, s)] = weight.clone();
    Cost { q, r: cost.r.clone(), s: cost.s.above(&Matrix::zeros(1, 1)) }
}

/// `1 / (C M⁻¹ B)` with `C` picking the state `output`; none if `C M⁻¹ B` is zero or only rounding error.
fn precompensation<R: Real>(m: &Matrix<R>, b: &Matrix<R>, output: usize) -> Option<R> {
    let steady = solve(m, b).ok()?;
    let noise = steady.largest_entry().scale_by_power_of_two(-(R::bits() as i32) / 2);
    let gain = &steady[(output, 0)];
    (gain.abs() > noise).then(|| R::one() / gain)
}

fn lqr_cost<R: Real>(weights: &Lqr) -> Cost<R> {
    let (q, s) = weights.weights();
    Cost {
        q: Matrix::from_f64_rows(&q),
        r: Matrix::from_diagonal(&[R::from_f64(weights.force_weight)]),
        s: Matrix::from_fn(s.len(), 1, |i, _| R::from_f64(s[i])),
    }
}

/// The continuous-time poles of the loop (1/s): those that the rig file asks for, and a force with a lag keeps its own.
fn all_poles<R: Real>(placement: &PolePlacement, rig: &Rig) -> Result<Vec<Pole<R>>, DesignError> {
    let mut poles = wanted_poles(placement, rig)?;
    if let Some(lag_s) = rig.actuator.lag_s() {
        poles.push(Pole::Real(R::zero() - &(R::one() / &R::from_f64(lag_s))));
    }
    Ok(poles)
}

/// The continuous-time poles that the rig file asks for (1/s).
pub fn wanted_poles<R: Real>(placement: &PolePlacement, rig: &Rig) -> Result<Vec<Pole<R>>, DesignError> {
    let poles = match placement {
        PolePlacement::Response { overshoot_percent, settling_time_s, far_poles } => {
            let mut poles = vec![Pole::Pair(dominant_pair(*overshoot_percent, *settling_time_s))];
            poles.extend(far_poles.iter().map(|&pole| Pole::Real(R::from_f64(pole))));
            poles
        }
        PolePlacement::Poles(poles) => {
            // The rig file was checked: complex poles come in conjugate pairs.
            let upper = poles.iter().filter(|pole| pole[1] >= 0.0);
            upper
                .map(|&[re, im]| match im {
                    0.0 => Pole::Real(R::from_f64(re)),
                    _ => Pole::Pair(Complex { re: R::from_f64(re), im: R::from_f64(im) }),
                })
                .collect()
        }
    };
    let given = poles.iter().map(Pole::order).sum();
    if given != rig.states() {
        return Err(DesignError::PoleCount { given, wanted: rig.states() });
    }
    Ok(poles)
}
