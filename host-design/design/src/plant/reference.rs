//! Adaptive integrator of order 8: slow and accurate, the reference for the fixed-step one.

use differential_equations::error::Error;
use differential_equations::methods::ExplicitRungeKutta;
use differential_equations::ode::{ODE, OrdinaryNumericalMethod};
use differential_equations::status::Status;

use super::Plant;

/// Allowed local error of each step, per state: `absolute + relative · |state|`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Relative part.
    pub relative: f64,
    /// Absolute part, in the unit of each state.
    pub absolute: f64,
}

/// Why an integration did not reach its end.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReferenceError {
    /// Duration or tolerance is not a finite positive number.
    #[error("the duration and the tolerances must be finite and positive")]
    BadRequest,
    /// The tolerance asks for too many or too small steps.
    #[error("the integration stopped at t = {time_s} s ({cause}): loosen the tolerance or shorten the run")]
    Stopped {
        /// Time reached (s).
        time_s: f64,
        /// The integrator's reason.
        cause: &'static str,
    },
    /// The state is no longer finite: it overflowed or became NaN.
    #[error("the integration left the range of finite numbers")]
    NotFinite,
}

const MOST_STEPS: usize = 20_000_000;

/// The state of `plant` after `duration` (s) from `start` under `force(t, state)` (N) and held `disturbances` (joint
/// torques in N·m), by DOP853 (Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, §II.10). The
/// plant's own state is not used.
///
/// If the force jumps, end the run at the jump and start the next run there.
///
/// # Errors
/// [`ReferenceError`] if an argument is invalid or the integrator cannot meet the tolerance.
///
/// # Panics
/// If a slice does not have the length that [`Plant`] requires.
pub fn integrate(
    plant: &dyn Plant,
    start: &[f64],
    force: impl Fn(f64, &[f64]) -> f64,
    disturbances: &[f64],
    duration: f64,
    tolerance: Tolerance,
) -> Result<Vec<f64>, ReferenceError> {
    integrate_problem(&Problem { plant, force: &force, disturbances }, start, duration, tolerance)
}

/// [`integrate`] without a type of the caller's, so that it is compiled once, with this crate's optimisation.
fn integrate_problem(
    problem: &Problem<'_>,
    start: &[f64],
    duration: f64,
    tolerance: Tolerance,
) -> Result<Vec<f64>, ReferenceError> {
    let positive = |x: f64| x.is_finite() && x > 0.0;
    if ![duration, tolerance.relative, tolerance.absolute].into_iter().all(positive) {
        return Err(ReferenceError::BadRequest);
    }
    assert_eq!(start.len(), problem.plant.states(), "length of the state");
    let mut method =
        ExplicitRungeKutta::dop853().rtol(tolerance.relative).atol(tolerance.absolute).max_steps(MOST_STEPS);
    method.init(problem, 0.0, duration, &start.to_vec()).map_err(|error| cause(0.0, &error))?;
    // Stepped by hand, for two reasons. The run must end on a step of the integrator, not on an interpolated value. It
    // must stop early if a NaN in force or state makes the integrator reject every step.
    loop {
        let remaining = duration - method.t();
        if remaining <= 2.0 * f64::EPSILON * duration {
            return Ok(method.y().clone());
        }
        if method.h() > remaining {
            method.set_h(remaining);
        }
        method.step(problem).map_err(|error| cause(method.t(), &error))?;
        if *method.status() == Status::RejectedStep && method.h() < f64::EPSILON * duration {
            return Err(stopped(method.t(), "the step became too small"));
        }
        if !method.y().iter().all(|entry| entry.is_finite()) {
            return Err(ReferenceError::NotFinite);
        }
    }
}

fn cause(time_s: f64, error: &Error<f64, Vec<f64>>) -> ReferenceError {
    match error {
        Error::StepSize { .. } => stopped(time_s, "the step became too small"),
        Error::MaxSteps { .. } => stopped(time_s, "too many steps"),
        Error::Stiffness { .. } => stopped(time_s, "the equations are stiff"),
        _ => ReferenceError::BadRequest,
    }
}

fn stopped(time_s: f64, cause: &'static str) -> ReferenceError {
    ReferenceError::Stopped { time_s, cause }
}

struct Problem<'a> {
    plant: &'a dyn Plant,
    force: &'a dyn Fn(f64, &[f64]) -> f64,
    disturbances: &'a [f64],
}

impl ODE<f64, Vec<f64>> for Problem<'_> {
    fn diff(&self, t: f64, state: &Vec<f64>, rate: &mut Vec<f64>) {
        self.plant.rate(state, (self.force)(t, state), self.disturbances, rate);
    }
}
