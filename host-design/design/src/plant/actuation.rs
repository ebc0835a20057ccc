//! A force on the cart that changes while a command acts, and the integration steps that it needs.

/// Share of a jump of the motor's speed by which integration may miss it, at the end of a tick.
const ACCURACY: f64 = 1e-9;
/// Most of the motor's time constant in one integration step.
pub(crate) const LARGEST_SHARE: f64 = 0.25;
/// Most integration steps of a tick: more take hours for what nobody builds.
pub(crate) const MOST_STEPS: usize = 20_000;

/// The force on the cart while a command acts: a function of the motor's speed and of an input, which may change with
/// time. Integration evaluates it at each of its stages, so that nothing is held over a step.
pub trait Actuation {
    /// The input at the beginning, in the middle and at the end of the step that begins `from_s` (s) after the command
    /// and lasts `step_s` (s).
    fn inputs(&self, from_s: f64, step_s: f64) -> [f64; 3];

    /// Force (N) at this input, with the motor at `speed_m_per_s`, converted to speed of the cart (m/s).
    fn force_n(&self, input: f64, speed_m_per_s: f64) -> f64;

    /// Largest decrease of the force per speed of the motor (N·s/m).
    fn damping_n_s_per_m(&self) -> f64;
}

/// Number of integration steps in `dt` (s), at least `least`, for a motor whose speed jumps fade at most as fast as
/// `exp(-rate t)` (1/s): damping times mobility of what it moves.
///
/// A step of the classical Runge–Kutta method has the relative error `(rate h)⁵ / 120`; of a jump at the start of
/// `dt`, `x⁵ exp(-x) / (120 n⁴)` is left at its end after n steps, with `x = rate dt`.
pub(crate) fn integration_steps(rate: f64, dt: f64, least: usize) -> usize {
    let x = rate * dt;
    let least = least.max(1);
    let to_fourth = |decay: f64| x.powi(5) * decay / (120.0 * ACCURACY);
    // A usual motor is slow enough: then, the exponential need not be computed.
    if x <= LARGEST_SHARE * least as f64 && to_fourth(1.0) <= (least as f64).powi(4) {
        return least;
    }
    to_fourth(libm::exp(-x)).sqrt().sqrt().max(x / LARGEST_SHARE).ceil().max(least as f64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a jump of 1 m/s has become after n steps, less the exact value.
    fn error(x: f64) -> f64 {
        let n = integration_steps(x, 1.0, 1);
        let h = x / n as f64;
        let factor = 1.0 - h + h * h / 2.0 - h.powi(3) / 6.0 + h.powi(4) / 24.0;
        factor.powi(n as i32) - libm::exp(-x)
    }

    #[test]
    fn a_motor_of_any_speed_is_integrated_to_the_stated_accuracy() {
        for x in [1e-3, 0.02, 0.12, 0.5, 1.0, 4.7, 10.0, 65.0, 1e3] {
            assert!(error(x).abs() < 1.3 * ACCURACY, "{x}: {}", error(x));
        }
        assert_eq!(integration_steps(0.0, 2e-3, 4), 4);
        // A usual motor needs no more steps than a rig without one.
        assert_eq!(integration_steps(60.0, 2e-3, 4), 4);
    }
}
