//! The closed loops of a design and their poles.

use super::error::DesignError;
use super::synthesis::{Design, Feedback, with_integral};
use crate::numerics::{Complex, Matrix, Real, eigenvalues};
use crate::rig::Rig;

impl<R: Real> Design<R> {
    /// Poles of every closed loop.
    ///
    /// # Errors
    /// [`DesignError::Poles`] if the eigenvalue iteration fails.
    pub fn poles(&self, rig: &Rig) -> Result<DesignPoles, DesignError> {
        let of = |a: Matrix<R>| -> Result<Poles, DesignError> {
            Ok(eigenvalues(&a).map_err(|_| DesignError::Poles)?.iter().map(Complex::to_f64).collect())
        };
        let continuous = |law: &Option<Feedback<R>>| {
            law.as_ref().map(|law| of(self.continuous_loop(rig, law))).transpose()
        };
        let sampled =
            |law: &Option<Feedback<R>>| law.as_ref().map(|law| of(self.sampled_loop(rig, law))).transpose();
        Ok(DesignPoles {
            continuous: [continuous(&self.continuous.lqr)?, continuous(&self.continuous.pole_placement)?],
            sampled: [sampled(&self.sampled.lqr)?, sampled(&self.sampled.pole_placement)?],
            integral: [continuous(&self.continuous.integral)?, sampled(&self.sampled.integral)?],
        })
    }

    /// The closed loop of the continuous plant with `law`: of x, and z with integral action.
    fn continuous_loop(&self, rig: &Rig, law: &Feedback<R>) -> Matrix<R> {
        let (a, b) = if law.integral {
            with_integral(&self.a, &self.b, rig.output(), &R::one(), &R::zero())
        } else {
            (self.a.clone(), self.b.clone())
        };
        &a - &(&b * &law.k)
    }

    /// The closed loop of the sampled plant with `law`: of x, and z with integral action, and the force on its way with
    /// one tick of delay.
    pub fn sampled_loop(&self, rig: &Rig, law: &Feedback<R>) -> Matrix<R> {
        let period = R::from_f64(rig.tick.period_s);
        let (a, b) = if law.integral {
            with_integral(&self.ad, &self.bd, rig.output(), &period, &R::one())
        } else {
            (self.ad.clone(), self.bd.clone())
        };
        if law.k.cols() == a.cols() {
            return &a - &(&b * &law.k);
        }
        // u⁺ = -K [x; u]
        a.beside(&b).above(&-&law.k)
    }
}

/// Poles of each closed loop: [LQR, pole placement], where designed; with the delayed force as a further state, if there
/// is a delay.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignPoles {
    /// Continuous loops (1/s).
    pub continuous: [Option<Poles>; 2],
    /// Sampled loops.
    pub sampled: [Option<Poles>; 2],
    /// [continuous, sampled] loop of the LQR with integral action.
    pub integral: [Option<Poles>; 2],
}

impl DesignPoles {
    /// [continuous, sampled] poles of the law that is number `law` in the table (LQR with integral action, if there is
    /// such a design).
    pub fn in_table(&self, law: usize) -> [Option<&Poles>; 2] {
        let with_integral = |integral: &'_ Option<Poles>| law == 0 && integral.is_some();
        let [continuous, sampled] = &self.integral;
        [
            if with_integral(continuous) { continuous.as_ref() } else { self.continuous[law].as_ref() },
            if with_integral(sampled) { sampled.as_ref() } else { self.sampled[law].as_ref() },
        ]
    }
}

/// Poles as [re, im], by real part.
pub type Poles = Vec<[f64; 2]>;
