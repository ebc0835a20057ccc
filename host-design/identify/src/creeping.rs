//! The cart's dry friction, and whether it sticks or is proportional to the speed near rest.

use crate::model::Model;
use crate::prediction::Filter;
use crate::stribeck;

/// Speeds of the cart (m/s) with which the search begins, and the factors by which the best one is changed.
const SPEEDS_M_PER_S: [f64; 4] = [0.001, 0.002, 0.004, 0.008];
const FACTORS: [f64; 2] = [1.4, 1.15];
/// Duration of the part of the record on which they are tried (s).
const TRIAL_S: f64 = 20.0;
/// Iterations of the first fits; the others start near their end and take one.
const ITERATIONS: usize = 2;
/// Least fall of -2 ln L with which a cart that never sticks is believed.
const LEAST_GAIN: f64 = 12.0;

/// The model with the speed of the cart's `tanh` under which the measurements are most likely, and the parameters that
/// were fitted with it; none if a bristle explains them as well.
pub(crate) fn found(filter: &Filter<'_>, p: &[f64], noise: &[f64]) -> Option<(Model, Vec<f64>)> {
    if filter.model.is_imposed {
        return None;
    }
    let short = filter.record.part(0.0, TRIAL_S);
    let with = |speed: f64| {
        let mut model = filter.model.clone();
        (model.creeping, model.excess[0]) = (Some(speed), 0.0);
        model
    };
    let unfitted =
        |speed: f64| Filter { model: &with(speed), record: &short, ..*filter }.run(p, noise, false).cost;
    let fitted = |speed: f64, p: &[f64], iterations: usize| {
        let model = with(speed);
        Filter { model: &model, record: &short, ..*filter }.fit_cost(p, noise, iterations)
    };
    let (_, own) = Filter { record: &short, ..*filter }.fit_cost(p, noise, ITERATIONS)?;
    let first = SPEEDS_M_PER_S.map(|speed| (unfitted(speed), speed));
    let (_, mut speed) = first.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut best = fitted(speed, p, ITERATIONS)?;
    // Written so that NaN is not believed.
    let is_better = best.1 < own;
    if !is_better {
        return None;
    }
    for factor in FACTORS {
        for factor in [factor, 1.0 / factor] {
            while let Some(other) = fitted(factor * speed, &best.0, 1).filter(|other| other.1 < best.1) {
                (speed, best) = (factor * speed, other);
            }
        }
    }
    (own - best.1 > LEAST_GAIN).then(|| (with(speed), best.0))
}

impl Model {
    /// Dry friction of the cart at the speed `v` (m/s) with the deflection `bristle`, as a share of that in motion, and
    /// its derivatives by speed and deflection.
    pub(crate) fn cart_friction(&self, v: f64, bristle: f64) -> [f64; 3] {
        let [factor, by_speed] = stribeck::factor(self.excess[0], self.half_at[0], v);
        let Some(creeping) = self.creeping else { return [factor * bristle, by_speed * bristle, factor] };
        let direction = libm::tanh(v / creeping);
        let slope = (1.0 - direction * direction) / creeping;
        [factor * direction, by_speed * direction + factor * slope, 0.0]
    }
}
