//! Adaptive integrator of order 8: slow and accurate, the reference for the fixed-step integrator.

use std::sync::LazyLock;

use differential_equations::error::Error;
use differential_equations::methods::{DormandPrince, ExplicitRungeKutta, Ordinary};
use differential_equations::ode::{ODE, OrdinaryNumericalMethod};
use differential_equations::status::Status;
use differential_equations::traits::State;

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

/// DOP853 for a state of this type.
type Method<Y> = ExplicitRungeKutta<Ordinary, DormandPrince, f64, Y, 8, 12, 16>;

/// [`integrate`] without a type parameter from the caller, so that it is compiled once, with this crate's
/// optimisation.
fn integrate_problem(
    problem: &Problem<'_>,
    start: &[f64],
    duration: f64,
    tolerance: Tolerance,
) -> Result<Vec<f64>, ReferenceError> {
    /// Copying the method's many coefficients is faster than computing them again.
    static SMALL: LazyLock<Method<Small>> = LazyLock::new(Method::dop853);
    let positive = |x: f64| x.is_finite() && x > 0.0;
    if ![duration, tolerance.relative, tolerance.absolute].into_iter().all(positive) {
        return Err(ReferenceError::BadRequest);
    }
    assert_eq!(start.len(), problem.plant.states(), "length of the state");
    match Small::from_state(start) {
        Some(start) => integrate_with(SMALL.clone(), problem, &start, duration, tolerance),
        None => integrate_with(Method::dop853(), problem, &start.to_vec(), duration, tolerance),
    }
}

fn integrate_with<Y: State<f64> + AsRef<[f64]>>(
    mut method: Method<Y>,
    problem: &Problem<'_>,
    start: &Y,
    duration: f64,
    tolerance: Tolerance,
) -> Result<Vec<f64>, ReferenceError>
where
    for<'a> Problem<'a>: ODE<f64, Y>,
{
    (method.rtol, method.atol) = (tolerance.relative.into(), tolerance.absolute.into());
    method.max_steps = MOST_STEPS;
    method.init(problem, 0.0, duration, start).map_err(|error| cause(0.0, &error))?;
    // Stepped by hand, for two reasons. The run must end on a step of the integrator, not on an interpolated value. It
    // must stop early if a NaN in force or state makes the integrator reject every step.
    loop {
        let remaining = duration - method.t();
        if remaining <= 2.0 * f64::EPSILON * duration {
            return Ok(method.y().as_ref().to_vec());
        }
        if method.h() > remaining {
            method.set_h(remaining);
        }
        method.step(problem).map_err(|error| cause(method.t(), &error))?;
        if matches!(method.status(), Status::RejectedStep) && method.h() < f64::EPSILON * duration {
            return Err(stopped(method.t(), "the step became too small"));
        }
        if !method.y().as_ref().iter().all(|entry| entry.is_finite()) {
            return Err(ReferenceError::NotFinite);
        }
    }
}

fn cause<Y: State<f64>>(time_s: f64, error: &Error<f64, Y>) -> ReferenceError {
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

impl ODE<f64, Small> for Problem<'_> {
    fn diff(&self, t: f64, state: &Small, rate: &mut Small) {
        let state = state.as_ref();
        self.plant.rate(state, (self.force)(t, state), self.disturbances, &mut rate.values[..rate.length]);
    }
}

/// The state of a plant of up to four links, stored inline: a step creates hundreds of states, and allocating each
/// would be slow.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Small {
    length: usize,
    /// Entries beyond `length` are 0.
    values: [f64; 10],
}

impl Small {
    fn from_state(state: &[f64]) -> Option<Self> {
        let mut values = [0.0; 10];
        values.get_mut(..state.len())?.copy_from_slice(state);
        Some(Self { length: state.len(), values })
    }
}

impl AsRef<[f64]> for Small {
    fn as_ref(&self) -> &[f64] {
        &self.values[..self.length]
    }
}

impl State<f64> for Small {
    fn len(&self) -> usize {
        self.length
    }

    fn get_component(&self, index: usize) -> f64 {
        self.values[index]
    }

    fn set_component(&mut self, index: usize, value: f64) {
        self.values[index] = value;
    }

    fn map_components_mut<F: FnMut(usize, &mut f64)>(&mut self, mut f: F) {
        for index in 0..self.length {
            f(index, &mut self.values[index]);
        }
    }

    fn zeros_like(&self) -> Self {
        Self { values: [0.0; 10], ..*self }
    }

    fn zeros() -> Self {
        Self { length: 0, values: [0.0; 10] }
    }

    fn mul_add_assign(&mut self, alpha: f64, other: &Self) {
        self.add_scaled(alpha, other);
    }

    fn scale_mut(&mut self, alpha: f64) {
        for index in 0..10 {
            self.values[index] *= alpha;
        }
    }

    #[inline(always)]
    fn add_scaled(&mut self, alpha: f64, other: &Self) -> &mut Self {
        for index in 0..10 {
            self.values[index] += alpha * other.values[index];
        }
        self
    }
}
