//! Whether the dry friction is larger at rest than in motion.

use crate::model::Model;
use crate::prediction::Filter;
use crate::stribeck::HALF_AT;

/// Excesses that are tried, as shares of the friction in motion.
const EXCESSES: [f64; 5] = [0.0, 0.15, 0.3, 0.45, 0.6];
/// Factors on the usual speeds at which half of the excess is left, of the cart and of the joints.
const FACTORS: [f64; 5] = [0.45, 0.67, 1.0, 1.5, 2.25];
/// Duration of the part of the record on which they are tried (s).
const TRIAL_S: f64 = 20.0;
/// Iterations of each fit.
const ITERATIONS: usize = 2;
/// Least fall of -2 ln L with which an excess is believed.
const LEAST_GAIN: f64 = 12.0;
/// -2 ln L of an excess that cannot be ruled out is at most this above that of the likeliest (95 % of χ²).
const NOT_RULED_OUT: f64 = 3.84;

/// Indices in [`EXCESSES`] of the cart and of the joints, and in [`FACTORS`] of both.
type ExcessIndices = [usize; 4];
/// No excess.
const NONE: ExcessIndices = [0, 0, 2, 2];

/// The model with the excesses of the cart's and the joints' friction at rest under which the measurements are most
/// likely, and the speeds at which half of them is left; without excess, unless the record shows otherwise.
/// Small joints often hide theirs: the largest excess of the joints that the record does not rule out is kept, too.
pub(crate) fn with_excess(filter: &Filter<'_>, p: &[f64], noise: &[f64]) -> Model {
    let short = filter.record.part(0.0, TRIAL_S);
    let model = |[cart, joints, speed, rate]: ExcessIndices| Model {
        excess: [EXCESSES[cart], EXCESSES[joints]],
        half_at: [FACTORS[speed] * HALF_AT[0], FACTORS[rate] * HALF_AT[1]],
        ..filter.model.clone()
    };
    let cost = |at: ExcessIndices| {
        let other = Filter { model: &model(at), record: &short, ..*filter };
        other.fit_cost(p, noise, ITERATIONS).map_or(f64::INFINITY, |(_, cost)| cost)
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
    // Without an excess, its speed changes nothing.
    let has_excess = |at: ExcessIndices, index: usize| index < 2 || at[index - 2] > 0;
    let found = [2, 0, 2, 1, 3, 1].into_iter().fold(found, |found, index| {
        if is_believed && has_excess(found.0, index) { improved(found, index) } else { found }
    });
    let ([cart, joints, speed, rate], least) = found;
    let is_possible = |joints: &usize| cost([cart, *joints, speed, rate]) < least + NOT_RULED_OUT;
    let at_most = (joints + 1..EXCESSES.len()).take_while(is_possible).last().unwrap_or(joints);
    let used = if is_believed { found.0 } else { NONE };
    Model { joints_excess_at_most: EXCESSES[at_most], ..model(used) }
}
