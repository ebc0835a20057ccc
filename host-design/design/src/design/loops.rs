//! The closed loops of a design and their poles.

use super::error::DesignError;
use super::hold::with_braking;
use super::lag::{force_last, is_late_alone, is_late_and_lags, shares, with_lag, with_pending};
use super::synthesis::{Design, Feedback, with_integral};
use super::zero_order_hold::zero_order_hold;
use crate::numerics::{Complex, Matrix, Real, eigenvalues};
use crate::rig::Rig;
use upright::table::{Law, PerLaw};

impl<R: Real> Design<R> {
    /// The plant from command to state for continuous time, with the force as its last state if it follows with a lag.
    pub fn driven(&self) -> (Matrix<R>, Matrix<R>) {
        with_lag(&self.a, &self.b, self.lag_s)
    }

    /// The same for ticks of `period` (s).
    pub fn driven_sampled(&self, period: &R) -> (Matrix<R>, Matrix<R>) {
        if self.lag_s == 0.0 {
            return (self.ad.clone(), self.bd.clone());
        }
        let (a, b) = self.driven();
        zero_order_hold(&a, &b, period)
    }

    /// The sampled plant for which the laws are designed, before a delay alone: the same, or its pending force stands
    /// for a delay and a lag.
    pub(super) fn commanded(&self, rig: &Rig) -> (Matrix<R>, Matrix<R>) {
        if is_late_and_lags(rig) {
            return with_pending([&self.ad, &self.bd], shares(rig, rig.tick.period_s));
        }
        self.driven_sampled(&R::from_f64(rig.tick.period_s))
    }

    /// Poles of every closed loop.
    ///
    /// # Errors
    /// [`DesignError::Poles`] if the eigenvalue iteration fails.
    pub fn poles(&self, rig: &Rig) -> Result<DesignPoles, DesignError> {
        let of = |a: Matrix<R>| -> Result<Poles, DesignError> {
            Ok(eigenvalues(&a).map_err(|_| DesignError::Poles)?.iter().map(Complex::to_f64).collect())
        };
        let continuous =
            |law: Option<&Feedback<R>>| law.map(|law| of(self.continuous_loop(rig, law))).transpose();
        let sampled = |law: Option<&Feedback<R>>| law.map(|law| of(self.sampled_loop(rig, law))).transpose();
        Ok(DesignPoles {
            continuous: self.continuous.each().map(continuous).transpose()?,
            sampled: self.sampled.each().map(sampled).transpose()?,
            integral: [
                continuous(self.continuous.integral.as_ref())?,
                sampled(self.sampled.integral.as_ref())?,
            ],
        })
    }

    /// The closed loop of the continuous plant with `law`, `ζ̇ = M ζ` for set-point 0. ζ holds x, then z with integral
    /// action, then the force if it follows with a lag.
    fn continuous_loop(&self, rig: &Rig, law: &Feedback<R>) -> Matrix<R> {
        let (a, b) = self.over_law(rig, law, self.driven(), [&R::one(), &R::zero()]);
        &a - &(&b * &law.k)
    }

    /// The closed loop of the sampled plant with `law`, `ζ⁺ = M ζ` for set-point 0. ζ holds x, then z if there is
    /// integral action, then the pending force if there is a delay or a lag; `u = -K ζ`.
    pub fn sampled_loop(&self, rig: &Rig, law: &Feedback<R>) -> Matrix<R> {
        let period = R::from_f64(rig.tick.period_s);
        let (a, b) = self.over_law(rig, law, self.commanded(rig), [&period, &R::one()]);
        if law.k.cols() == a.cols() {
            return &a - &(&b * &law.k);
        }
        // u⁺ = -K [x; u]
        a.beside(&b).above(&-&law.k)
    }

    /// The plant from command to state with the states of the law's K: [x; z; f].
    fn over_law(
        &self,
        rig: &Rig,
        law: &Feedback<R>,
        (a, b): (Matrix<R>, Matrix<R>),
        [gain, kept]: [&R; 2],
    ) -> (Matrix<R>, Matrix<R>) {
        if !law.integral {
            return (a, b);
        }
        let (a, b) = with_integral(&a, &b, rig.output(), gain, kept);
        if self.lag_s == 0.0 {
            return (a, b);
        }
        (force_last(&force_last(&a).transpose()).transpose(), force_last(&b.transpose()).transpose())
    }

    /// Input vector of the set-point r in [`sampled_loop`](Self::sampled_loop), `ζ⁺ = M ζ + E r`; none for a law
    /// without N.
    pub fn setpoint_input(&self, rig: &Rig, law: &Feedback<R>) -> Option<Matrix<R>> {
        let n = law.n.as_ref()?;
        let (states, period) = (self.ad.rows(), R::from_f64(rig.tick.period_s));
        let mut input = Matrix::zeros(law.k.cols(), 1);
        if is_late_alone(rig) {
            input[(law.k.cols() - 1, 0)] = n.clone();
        } else {
            let (_, b) = self.over_law(rig, law, self.commanded(rig), [&period, &R::one()]);
            input = b.scaled(n);
        }
        if law.integral {
            // z⁺ = z + T (x - r)
            input[(states, 0)] = -period;
        }
        Some(input)
    }
}

impl Design<f64> {
    /// The design with the plant as it moves while a motor holds its voltage: from the force of that voltage at
    /// standstill to the state.
    pub fn braked(&self, braking_n_s_per_m: f64, tick_s: f64) -> Self {
        let a = with_braking(&self.a, &self.b, braking_n_s_per_m);
        let (ad, bd) = zero_order_hold(&a, &self.b, &tick_s);
        Self { a, ad, bd, ..self.clone() }
    }
}

/// Poles of each closed loop that was designed. If there is a delay, the pending force is a further state.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignPoles {
    /// Poles of the continuous loops (1/s).
    pub continuous: PerLaw<Option<Poles>>,
    /// Poles of the sampled loops (stable inside the unit circle).
    pub sampled: PerLaw<Option<Poles>>,
    /// [continuous, sampled] poles of the LQR with integral action.
    pub integral: [Option<Poles>; 2],
}

impl DesignPoles {
    /// [continuous, sampled] poles of `law` as it goes into the table: LQR with integral action, if it is designed.
    pub fn in_table(&self, law: Law) -> [Option<&Poles>; 2] {
        let [continuous, sampled] = self.integral.each_ref().map(|poles| match law {
            Law::Lqr => poles.as_ref(),
            Law::PolePlacement => None,
        });
        [continuous.or(self.continuous[law].as_ref()), sampled.or(self.sampled[law].as_ref())]
    }
}

/// Poles as [re, im], by real part.
pub type Poles = Vec<[f64; 2]>;
