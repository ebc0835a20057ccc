//! Diagnosis of a design problem that has no solution.

use super::controllability::Reach;
use super::error::{DesignError, Task};
use super::riccati::Cost;
use crate::numerics::{Complex, Matrix, Real};

/// Why poles cannot be placed.
pub(super) fn why_no_placement<R: Real>(task: Task, a: &Matrix<R>, b: &Matrix<R>) -> DesignError {
    let reach = Reach::of(a, b);
    match reach.unreachable_modes() {
        Ok(modes) if !modes.is_empty() => {
            DesignError::Uncontrollable { task, modes: modes.iter().map(Complex::to_f64).collect() }
        }
        _ => DesignError::Unresolved { task, bits: R::bits() },
    }
}

/// Why a regulator does not exist.
pub(super) fn why_no_lqr<R: Real>(task: Task, a: &Matrix<R>, b: &Matrix<R>, cost: &Cost<R>) -> DesignError {
    // An eighth of the bits: a k-fold mode is known only to about bits / k.
    let fuzz = R::one().scale_by_power_of_two(-(R::bits() as i32) / 8);
    // How far outside the stability region a mode lies, relative to the size of the plant.
    let excess = |mode: &Complex<R>| {
        if task.is_sampled() {
            mode.modulus() - &R::one()
        } else {
            mode.re.clone() / &a.norm().max(fuzz.clone())
        }
    };
    let named = |modes: Vec<&Complex<R>>| modes.into_iter().map(Complex::to_f64).collect::<Vec<[f64; 2]>>();
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
    DesignError::Unresolved { task, bits: R::bits() }
}
