//! Whether the dry friction is larger at rest than in motion.

use super::prediction::Filter;

/// Excesses that are tried, as shares of the friction in motion.
const EXCESSES: [f64; 5] = [0.0, 0.15, 0.3, 0.45, 0.6];
/// Duration of the part of the record on which they are tried (s).
const TRIAL_S: f64 = 20.0;
/// Iterations of each fit.
const ITERATIONS: usize = 2;
/// Least fall of -2 ln L with which an excess is believed.
const LEAST_GAIN: f64 = 12.0;

/// The excesses of the cart's and the joints' friction at rest under which the measurements are most likely: 0, unless
/// the record shows otherwise.
pub(super) fn excess(filter: &Filter<'_>, p: &[f64], noise: &[f64]) -> [f64; 2] {
    let short = filter.record.part(0.0, TRIAL_S);
    let cost = |at: [usize; 2]| {
        let mut model = filter.model.clone();
        model.excess = at.map(|index| EXCESSES[index]);
        let other = Filter { model: &model, record: &short, ..*filter };
        other.fit(p, noise, ITERATIONS).map_or(f64::INFINITY, |(_, normal)| normal.cost)
    };
    let own = cost([0, 0]);
    let (mut at, mut least) = ([0, 0], own);
    for contact in [0, 1, 0] {
        while at[contact] + 1 < EXCESSES.len() {
            let mut other = at;
            other[contact] += 1;
            let cost = cost(other);
            // Written so that NaN is not believed.
            let is_better = cost < least;
            if !is_better {
                break;
            }
            (at, least) = (other, cost);
        }
    }
    if own - least > LEAST_GAIN { at.map(|index| EXCESSES[index]) } else { [0.0; 2] }
}
