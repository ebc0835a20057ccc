//! Whether the dry friction is larger at rest than in motion.

use super::model::Model;
use super::prediction::Filter;
use super::stribeck;

/// Excesses that are tried, as shares of the friction in motion.
const EXCESSES: [f64; 5] = [0.0, 0.15, 0.3, 0.45, 0.6];
/// Factors on the usual speed at which half of the cart's excess is left.
const FACTORS: [f64; 5] = [0.45, 0.67, 1.0, 1.5, 2.25];
/// Duration of the part of the record on which they are tried (s).
const TRIAL_S: f64 = 20.0;
/// Iterations of each fit.
const ITERATIONS: usize = 2;
/// Least fall of -2 ln L with which an excess is believed.
const LEAST_GAIN: f64 = 12.0;

/// Indices in [`EXCESSES`] of the cart and of the joints, and in [`FACTORS`].
type ExcessIndices = [usize; 3];
/// No excess.
const NONE: ExcessIndices = [0, 0, 2];

/// The model with the excesses of the cart's and the joints' friction at rest under which the measurements are most
/// likely, and the cart's speed at which half of its excess is left; without excess, unless the record shows otherwise.
pub(super) fn with_excess(filter: &Filter<'_>, p: &[f64], noise: &[f64]) -> Model {
    let short = filter.record.part(0.0, TRIAL_S);
    let model = |[cart, joints, speed]: ExcessIndices| Model {
        excess: [EXCESSES[cart], EXCESSES[joints]],
        half_at: FACTORS[speed] * stribeck::SPEED,
        ..filter.model.clone()
    };
    let cost = |at: ExcessIndices| {
        let other = Filter { model: &model(at), record: &short, ..*filter };
        other.fit(p, noise, ITERATIONS).map_or(f64::INFINITY, |(_, normal)| normal.cost)
    };
    let own = cost(NONE);
    // The tried values with one index changed as long as that lowers the cost.
    let improved = |(mut at, mut least): (ExcessIndices, f64), index: usize| {
        for step in [1, -1] {
            while let Some(next) = at[index].checked_add_signed(step).filter(|next| *next < EXCESSES.len()) {
                let mut other = at;
                other[index] = next;
                let cost = cost(other);
                // Written so that NaN is not believed.
                let is_better = cost < least;
                if !is_better {
                    break;
                }
                (at, least) = (other, cost);
            }
        }
        (at, least)
    };
    let found = [0, 1, 0].into_iter().fold((NONE, own), improved);
    let is_believed = own - found.1 > LEAST_GAIN;
    match (is_believed, found.0) {
        (false, _) => model(NONE),
        (true, [0, ..]) => model(found.0),
        (true, _) => model([2, 0, 2, 1].into_iter().fold(found, improved).0),
    }
}
