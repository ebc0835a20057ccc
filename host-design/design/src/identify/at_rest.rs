//! Dry friction that is larger at rest than in motion (R. Stribeck, 1902).

use super::prediction::Filter;

/// Speed of the cart (m/s) and rate of a joint (rad/s) at which half of the excess is left: those of `[reality]`.
pub(super) const SPEEDS: [f64; 2] = [0.01, 0.1];
/// Excesses that are tried, as shares of the friction in motion.
const EXCESSES: [f64; 5] = [0.0, 0.15, 0.3, 0.45, 0.6];
/// Duration of the part of the record on which they are tried (s).
const TRIAL_S: f64 = 20.0;
/// Iterations of each fit.
const ITERATIONS: usize = 2;
/// Least fall of -2 ln L with which an excess is believed.
const LEAST_GAIN: f64 = 12.0;

/// Factor of the dry friction at `speed`, with the excess at rest and the speed at which half of it is left, and its
/// derivative by the speed.
pub(super) fn factor(excess: f64, half_at: f64, speed: f64) -> [f64; 2] {
    let ratio = speed / half_at;
    let left = excess / (1.0 + ratio * ratio);
    [1.0 + left, -2.0 * left * ratio / (half_at * (1.0 + ratio * ratio))]
}

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
