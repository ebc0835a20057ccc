//! A whole design at one working precision: plant, sampled plant, and every gain the rig file asks for.

use super::controllability::Reach;
use super::error::{DesignError, Task};
use super::place::{Pole, dominant_pair, place};
use super::riccati::{Cost, care, dare};
use super::zero_order_hold::{sampled_cost, zero_order_hold};
use crate::numerics::{Complex, Matrix, Real, Wide, eigenvalues, solve};
use crate::plant::{ChainParameters, Equilibrium, linearise};
use crate::rig::{Lqr, PlantDescription, PolePlacement, Rig};

/// Plant and gains with entries of type `T`: a working precision, or what it was rounded to.
#[derive(Debug, Clone, PartialEq)]
pub struct Design<T> {
    /// `ẋ = A x + B u`, s×s.
    pub a: Matrix<T>,
    /// B, s×1.
    pub b: Matrix<T>,
    /// `x⁺ = Ad x + Bd u` for a force held over one tick, s×s.
    pub ad: Matrix<T>,
    /// Bd, s×1.
    pub bd: Matrix<T>,
    /// Gains for continuous time.
    pub continuous: Laws<T>,
    /// Gains for the tick. With one tick of delay K has one more entry, for the force still on its way.
    pub sampled: Laws<T>,
}

/// Both of the paper's control laws, where the rig file asks for them.
#[derive(Debug, Clone, PartialEq)]
pub struct Laws<T> {
    /// Linear quadratic regulator.
    pub lqr: Option<Feedback<T>>,
    /// Pole placement.
    pub pole_placement: Option<Feedback<T>>,
}

/// `u = N r - K x`.
#[derive(Debug, Clone, PartialEq)]
pub struct Feedback<T> {
    /// K, 1×s (or 1×(s+1) with a delay).
    pub k: Matrix<T>,
    /// N; none if no constant force can hold the output away from 0.
    pub n: Option<T>,
}

impl<T> Laws<T> {
    /// [LQR, pole placement].
    pub fn each(&self) -> [Option<&Feedback<T>>; 2] {
        [self.lqr.as_ref(), self.pole_placement.as_ref()]
    }

    fn try_map<S, E>(&self, mut f: impl FnMut(&Feedback<T>) -> Result<S, E>) -> Result<[Option<S>; 2], E> {
        Ok([
            self.lqr.as_ref().map(&mut f).transpose()?,
            self.pole_placement.as_ref().map(&mut f).transpose()?,
        ])
    }
}

impl<R: Real> Design<R> {
    /// Designs everything that `rig` asks for.
    ///
    /// # Errors
    /// [`DesignError`] with the reason if some law has no solution.
    pub fn of(rig: &Rig) -> Result<Self, DesignError> {
        let (a, b) = continuous_plant::<R>(rig)?;
        let period = R::from_f64(rig.tick.period_s);
        refuse_unbridgeable_tick(&a, rig)?;
        let (ad, bd) = zero_order_hold(&a, &b, &period);
        let output = rig.output();

        let continuous_feedback = |k: Matrix<R>| {
            // N = -1 / (C (A - B K)⁻¹ B): the paper's equation for the precompensation gain.
            let n = precompensation(&-&(&a - &(&b * &k)), &b, output);
            Feedback { k, n }
        };
        let sampled_feedback = |k: Matrix<R>| {
            // The same steady state in sampled time: x = Ad x + Bd u.
            let identity = Matrix::identity(ad.rows());
            let n = precompensation(&(&identity - &(&ad - &(&bd * &k))), &bd, output);
            // One tick of delay: u⁺ = N r - K (Ad x + Bd u), the gain on the state the force will meet.
            let k = if rig.tick.delay_ticks == 1 { &k * &ad.beside(&bd) } else { k };
            Feedback { k, n }
        };

        let mut design = Self {
            continuous: Laws { lqr: None, pole_placement: None },
            sampled: Laws { lqr: None, pole_placement: None },
            a: a.clone(),
            b: b.clone(),
            ad: ad.clone(),
            bd: bd.clone(),
        };
        if let Some(weights) = &rig.lqr {
            let cost = lqr_cost(weights);
            let k = care(&a, &b, &cost).map_err(|_| why_no_lqr(Task::ContinuousLqr, &a, &b, &cost))?.k;
            design.continuous.lqr = Some(continuous_feedback(k));
            let tick_cost = sampled_cost(&a, &b, &cost, &period);
            let k =
                dare(&ad, &bd, &tick_cost).map_err(|_| why_no_lqr(Task::SampledLqr, &ad, &bd, &tick_cost))?.k;
            design.sampled.lqr = Some(sampled_feedback(k));
        }
        if let Some(placement) = &rig.pole_placement {
            let poles = wanted_poles(placement, rig)?;
            let place = |task, a, b, poles: &[Pole<R>]| {
                place(a, b, poles).map_err(|_| why_no_placement::<R>(task, a, b))
            };
            design.continuous.pole_placement =
                Some(continuous_feedback(place(Task::ContinuousPlacement, &a, &b, &poles)?));
            let poles: Vec<Pole<R>> = poles.iter().map(|pole| pole.sampled(&period)).collect();
            design.sampled.pole_placement =
                Some(sampled_feedback(place(Task::SampledPlacement, &ad, &bd, &poles)?));
        }
        Ok(design)
    }

    /// Poles of every closed loop, LQR and pole placement: continuous first, then sampled (with the delayed force as
    /// a further state, if there is a delay).
    ///
    /// # Errors
    /// [`DesignError::Poles`] if the eigenvalue iteration fails.
    pub fn poles(&self) -> Result<[[Option<Poles>; 2]; 2], DesignError> {
        let of_loop = |a: Matrix<R>| -> Result<Poles, DesignError> {
            Ok(eigenvalues(&a).map_err(|_| DesignError::Poles)?.iter().map(Complex::to_f64).collect())
        };
        Ok([
            self.continuous.try_map(|law| of_loop(&self.a - &(&self.b * &law.k)))?,
            self.sampled.try_map(|law| of_loop(self.sampled_loop(&law.k)))?,
        ])
    }

    /// The closed loop of the sampled plant with gain `k`, 1×s without delay or 1×(s+1) with one tick of delay.
    pub fn sampled_loop(&self, k: &Matrix<R>) -> Matrix<R> {
        if k.cols() == self.ad.cols() {
            return &self.ad - &(&self.bd * k);
        }
        // State [x; u]: x⁺ = Ad x + Bd u, u⁺ = -k [x; u].
        self.ad.beside(&self.bd).above(&-k)
    }
}

/// Poles as [re, im], by real part.
pub type Poles = Vec<[f64; 2]>;

impl<const BITS: usize> Design<Wide<BITS>> {
    /// Every entry passed through `round`, after [`Matrix::rounded`] has set pure rounding errors to zero.
    pub fn rounded<S>(&self, round: fn(&Wide<BITS>) -> S) -> Design<S> {
        let laws = |laws: &Laws<Wide<BITS>>| {
            let feedback = |law: &Option<Feedback<Wide<BITS>>>| {
                law.as_ref().map(|law| Feedback { k: law.k.rounded(round), n: law.n.as_ref().map(round) })
            };
            Laws { lqr: feedback(&laws.lqr), pole_placement: feedback(&laws.pole_placement) }
        };
        Design {
            a: self.a.rounded(round),
            b: self.b.rounded(round),
            ad: self.ad.rounded(round),
            bd: self.bd.rounded(round),
            continuous: laws(&self.continuous),
            sampled: laws(&self.sampled),
        }
    }
}

/// The linear plant of the rig: the chain about upright, or the given model.
fn continuous_plant<R: Real>(rig: &Rig) -> Result<(Matrix<R>, Matrix<R>), DesignError> {
    match &rig.plant {
        PlantDescription::Chain(chain) => {
            let model = linearise(&ChainParameters::of(chain), Equilibrium::Upright)
                .map_err(|_| DesignError::MassMatrix)?;
            Ok((model.a, model.b))
        }
        PlantDescription::Model(model) => Ok((
            Matrix::from_f64_rows(&model.a),
            Matrix::from_fn(model.b.len(), 1, |i, _| R::from_f64(model.b[i])),
        )),
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

/// `1 / (C M⁻¹ B)` with `C` picking the state `output`; none if `C M⁻¹ B` is zero, or nothing but rounding error.
fn precompensation<R: Real>(m: &Matrix<R>, b: &Matrix<R>, output: usize) -> Option<R> {
    let steady = solve(m, b).ok()?;
    let noise = steady.largest_entry().scale_by_power_of_two(-(R::BITS as i32) / 2);
    let gain = &steady[(output, 0)];
    (gain.abs() > noise).then(|| R::one() / gain)
}

fn lqr_cost<R: Real>(weights: &Lqr) -> Cost<R> {
    let q: Vec<R> = weights.state_weights.iter().map(|&w| R::from_f64(w)).collect();
    Cost::new(Matrix::from_diagonal(&q), Matrix::from_diagonal(&[R::from_f64(weights.force_weight)]))
}

/// The poles the rig file asks for.
fn wanted_poles<R: Real>(placement: &PolePlacement, rig: &Rig) -> Result<Vec<Pole<R>>, DesignError> {
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

fn why_no_placement<R: Real>(task: Task, a: &Matrix<R>, b: &Matrix<R>) -> DesignError {
    let reach = Reach::of(a, b);
    match reach.unreachable_modes() {
        Ok(modes) if !modes.is_empty() => {
            DesignError::Uncontrollable { task, modes: modes.iter().map(Complex::to_f64).collect() }
        }
        _ => DesignError::Unresolved { task, bits: R::BITS },
    }
}

fn why_no_lqr<R: Real>(task: Task, a: &Matrix<R>, b: &Matrix<R>, cost: &Cost<R>) -> DesignError {
    // A quarter of the bits: a repeated mode is only known to that many.
    let fuzz = R::one().scale_by_power_of_two(-(R::BITS as i32) / 8);
    // How far outside the stability region a mode lies, relative to the size of the plant.
    let excess = |mode: &Complex<R>| {
        if task.is_sampled() {
            mode.modulus() - &R::one()
        } else {
            mode.re.clone() / &a.norm().max(fuzz.clone())
        }
    };
    let named = |modes: Vec<&Complex<R>>| modes.into_iter().map(Complex::to_f64).collect::<Poles>();
    if let Ok(modes) = Reach::of(a, b).unreachable_modes() {
        let unstable = named(modes.iter().filter(|mode| excess(mode) > -fuzz.clone()).collect());
        if !unstable.is_empty() {
            return DesignError::NotStabilisable { task, modes: unstable };
        }
    }
    if let Ok(modes) = Reach::of(&a.transpose(), &cost.q).unreachable_modes() {
        let marginal = named(modes.iter().filter(|mode| excess(mode).abs() < fuzz).collect());
        if !marginal.is_empty() {
            return DesignError::Unweighted { task, modes: marginal };
        }
    }
    DesignError::Unresolved { task, bits: R::BITS }
}
