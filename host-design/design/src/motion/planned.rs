//! A planned motion with its gains, from which the table of the firmware is made.

use crate::numerics::Matrix;

/// A planned motion, tick by tick, and the gains that follow it.
///
/// States are in the rig's order and units: `x, ẋ, θ_1, θ̇_1, …` with relative angles (m, m/s, rad, rad/s), upright 0.
/// Angles are not wrapped: hanging is `θ_1 = π`, all others 0, and a motion may pass any angle.
///
/// In tick k (0 … steps - 1), with the prediction x̂⁻ of the nonlinear model and the positions y from the encoders:
///
/// ```text
/// x̂ = x̂⁻ + L_k (y - C x̂⁻)
/// u = u_k - K_k (x̂ - x_k), with the usual limits, held over the tick
/// ```
///
/// The first L applies to the first measurement: x̂⁻ of tick 0 is `x[0]`. From tick `steps` on, the rig balances about
/// the last state or hangs in it.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedMotion {
    /// Time between two entries (s): the rig's tick.
    pub tick_s: f64,
    /// Reference states, steps + 1. With `u` held over the tick, the model goes from each to the next.
    pub x: Vec<Vec<f64>>,
    /// Reference forces (N) or accelerations of the cart (m/s²), steps.
    pub u: Vec<f64>,
    /// Feedback gains K, 1×states, steps.
    pub k: Vec<Matrix<f64>>,
    /// Filter gains L (filter form, as in the observer of the table), states×sensors, steps.
    pub l: Vec<Matrix<f64>>,
}

/// Both motions of a rig.
#[derive(Debug, Clone, PartialEq)]
pub struct RaiseAndLower {
    /// From hanging at rest, cart at 0, to upright at rest, cart at 0. Its gains minimise the sampled cost of
    /// `[lqr]` with the stationary solution at the end, so K approaches the gain that balances: the hand-over changes
    /// an index, not the law.
    pub raise: PlannedMotion,
    /// From upright at rest, cart at 0, to hanging at rest, cart at 0.
    pub lower: PlannedMotion,
}

/// The sizes of the parts of a motion do not agree, or a value is not finite.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{part} of the motion: found {found}, needed {needed}")]
pub struct MotionError {
    /// Which part.
    pub part: &'static str,
    /// Entries, or size of an entry, found.
    pub found: String,
    /// What was needed.
    pub needed: String,
}

impl PlannedMotion {
    /// Joins the parts of a motion and checks their sizes.
    ///
    /// # Errors
    /// [`MotionError`] if there is no step, a number of entries or the size of an entry does not fit, or a value is not
    /// finite.
    pub fn new(
        tick_s: f64,
        x: Vec<Vec<f64>>,
        u: Vec<f64>,
        k: Vec<Matrix<f64>>,
        l: Vec<Matrix<f64>>,
    ) -> Result<Self, MotionError> {
        let (steps, states) = (u.len(), x.first().map_or(0, Vec::len));
        let sensors = l.first().map_or(0, Matrix::cols);
        let fits = |part, found: String, needed: String| {
            if found == needed { Ok(()) } else { Err(MotionError { part, found, needed }) }
        };
        let size = |m: &Matrix<f64>| format!("{}×{}", m.rows(), m.cols());
        if steps == 0 || !(tick_s.is_finite() && tick_s > 0.0) {
            let found = format!("{steps} steps of {tick_s} s");
            return Err(MotionError { part: "the duration", found, needed: "at least one tick".to_owned() });
        }
        fits("the states", x.len().to_string(), (steps + 1).to_string())?;
        fits("the gains", k.len().to_string(), steps.to_string())?;
        fits("the filter", l.len().to_string(), steps.to_string())?;
        for x in &x {
            fits("a state", x.len().to_string(), states.to_string())?;
        }
        for (k, l) in k.iter().zip(&l) {
            fits("a gain", size(k), format!("1×{states}"))?;
            fits("a filter gain", size(l), format!("{states}×{sensors}"))?;
        }
        let gains = k.iter().chain(&l).flat_map(|m| m.entries());
        match x.iter().flatten().chain(&u).chain(gains).find(|value| !value.is_finite()) {
            Some(value) => Err(MotionError {
                part: "a value",
                found: value.to_string(),
                needed: "a finite number".to_owned(),
            }),
            None => Ok(Self { tick_s, x, u, k, l }),
        }
    }

    /// Number of ticks.
    pub fn steps(&self) -> usize {
        self.u.len()
    }

    /// Duration (s).
    pub fn duration_s(&self) -> f64 {
        self.steps() as f64 * self.tick_s
    }

    /// Largest force (N) or acceleration (m/s²).
    pub fn input(&self) -> f64 {
        self.u.iter().fold(0.0, |most, u| most.max(u.abs()))
    }

    /// Largest distance of the cart from the middle (m).
    pub fn position_m(&self) -> f64 {
        self.x.iter().fold(0.0, |most, x| most.max(x[0].abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States, forces, gains and filter gains.
    type Parts = (Vec<Vec<f64>>, Vec<f64>, Vec<Matrix<f64>>, Vec<Matrix<f64>>);

    fn parts() -> Parts {
        (vec![vec![0.0; 4]; 3], vec![1.0; 2], vec![Matrix::zeros(1, 4); 2], vec![Matrix::zeros(4, 2); 2])
    }

    #[test]
    fn a_motion_has_one_more_state_than_forces_and_gains() {
        let (x, u, k, l) = parts();
        let motion = PlannedMotion::new(0.001, x, u, k, l).unwrap();
        assert_eq!((motion.steps(), motion.duration_s()), (2, 0.002));
    }

    #[test]
    fn parts_that_do_not_fit_are_refused() {
        let refused = |change: &dyn Fn(&mut Parts)| {
            let mut all = parts();
            change(&mut all);
            let (x, u, k, l) = all;
            PlannedMotion::new(0.001, x, u, k, l).unwrap_err().part
        };
        assert_eq!(refused(&|all| all.0.truncate(2)), "the states");
        assert_eq!(refused(&|all| all.0[1].truncate(3)), "a state");
        assert_eq!(refused(&|all| all.1.clear()), "the duration");
        assert_eq!(refused(&|all| all.2.truncate(1)), "the gains");
        assert_eq!(refused(&|all| all.2[1] = Matrix::zeros(4, 1)), "a gain");
        assert_eq!(refused(&|all| all.3.truncate(1)), "the filter");
        assert_eq!(refused(&|all| all.3[1] = Matrix::zeros(4, 3)), "a filter gain");
        assert_eq!(refused(&|all| all.1[0] = f64::NAN), "a value");
    }
}
