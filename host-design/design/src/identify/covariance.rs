//! Deviations that hold: those of the prediction error, widened by what the choices of the model change.

use super::parameters::{Kind, Prior};
use super::prediction::Filter;
use super::record::Record;

/// Other smoothings of the dry friction, as factors.
const SMOOTHINGS: [f64; 2] = [0.4, 2.5];
/// Steps of each refit.
const ITERATIONS: usize = 2;
/// The model's friction turns its sign earlier than the real one, and other smoothings show only a part of what that does
/// to delay and dead zone.
const SHOWN: f64 = 1.6;
/// Least relative deviation of lengths, and of moments without a motor.
const LEAST_LENGTH: f64 = 1.5e-4;
const LEAST_MOMENT: f64 = 2e-4;
/// Least relative deviation of the total mass, and of moments with a motor: the friction's model falsifies the scale of the
/// force.
const LEAST_SCALE: f64 = 1.5e-3;
/// Least relative deviation of viscous friction, of the cart and of joints, for the same reason.
const LEAST_CART_VISCOUS: f64 = 2e-3;
const LEAST_VISCOUS: f64 = 5e-3;
/// Least relative deviation of dry friction, whose model is coarse, and of the dead zone.
const LEAST_DRY: f64 = 0.04;
const LEAST_DEAD_ZONE: f64 = 0.02;
/// Least deviation of the tilt (rad).
const LEAST_TILT: f64 = 1e-4;
/// Least deviation of a zero (counts).
const LEAST_ZERO_COUNTS: f64 = 0.02;

/// Largest change of each parameter under other smoothings of the friction, and under finer sampling if there is one.
pub(super) fn changes(filter: &Filter<'_>, finer: Option<&Record>, p: &[f64], noise: &[f64]) -> Vec<f64> {
    let mut largest = vec![0.0f64; p.len()];
    let mut widen = |other: Option<Vec<f64>>| {
        for (largest, (other, p)) in largest.iter_mut().zip(other.iter().flatten().zip(p)) {
            *largest = largest.max((other - p).abs());
        }
    };
    for factor in SMOOTHINGS {
        let mut model = filter.model.clone();
        model.smoothing = model.smoothing.map(|smoothing| factor * smoothing);
        let other = Filter { model: &model, ..*filter };
        widen(other.fit(p, noise, ITERATIONS).map(|(p, _)| p));
    }
    if let Some(record) = finer {
        let other = Filter { record, ..*filter };
        widen(other.fit(p, noise, ITERATIONS).map(|(p, _)| p));
    }
    largest
}

/// Deviation of each parameter from the inverse `inverse` of the scaled normal matrix and the changes.
pub(super) fn deviations(
    kinds: &[Kind],
    priors: &[Prior],
    inverse: &[f64],
    changes: &[f64],
    p: &[f64],
    steps: &[f64],
) -> Vec<f64> {
    let size = p.len();
    let has_motor =
        kinds.iter().zip(priors).any(|(kind, prior)| *kind == Kind::DeadZone && prior.deviation > 0.0);
    let of = |i: usize| {
        let statistical = priors[i].deviation * inverse[i * size + i].sqrt();
        let least = match kinds[i] {
            Kind::Length(_) => LEAST_LENGTH * p[i],
            Kind::TotalMass => LEAST_SCALE * p[i],
            Kind::FirstMoment(_) | Kind::SecondMoment(_) if has_motor => LEAST_SCALE * p[i],
            Kind::FirstMoment(_) | Kind::SecondMoment(_) => LEAST_MOMENT * p[i],
            Kind::CartViscous => LEAST_CART_VISCOUS * p[i],
            Kind::JointViscous(_) => LEAST_VISCOUS * p[i],
            Kind::Zero(joint) => LEAST_ZERO_COUNTS * steps[joint + 1],
            Kind::CartDry | Kind::JointDry(_) => LEAST_DRY * p[i],
            Kind::DeadZone => LEAST_DEAD_ZONE * p[i],
            Kind::Tilt => LEAST_TILT,
            _ => 0.0,
        };
        let shown = if matches!(kinds[i], Kind::Delay | Kind::DeadZone) { SHOWN } else { 1.0 };
        let changed = shown * changes[i];
        if priors[i].deviation == 0.0 {
            return 0.0;
        }
        (statistical * statistical + changed * changed + least * least).sqrt()
    };
    (0..size).map(of).collect()
}
