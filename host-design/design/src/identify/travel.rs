//! Whether a drive that imposes the cart's motion moves it by another distance per step than the file says.

use super::doubt::Doubt;
use super::prediction::Filter;

/// Prior deviation of the travel per step, when it is doubted.
const TRAVEL: f64 = 0.05;
/// Iterations of the fit with it.
const ITERATIONS: usize = 3;
/// Least error of the travel per step that is named: a share, and in its deviations.
const WRONG_TRAVEL: (f64, f64) = (2e-3, 5.0);

/// Whether the travel per step is another than that of the file: the fit `p` goes on with it.
pub(super) fn doubted_travel(filter: &Filter<'_>, p: &[f64], noise: &[f64]) -> Option<Doubt> {
    let travel = filter.model.layout.travel();
    let mut priors = filter.priors.to_vec();
    priors[travel].deviation = TRAVEL;
    let (p, normal) = Filter { priors: &priors, ..*filter }.fit(p, noise, ITERATIONS)?;
    let deviation = TRAVEL * normal.factor(0.0)?.inverse()[travel * (p.len() + 1)].sqrt();
    let error = (p[travel] - 1.0).abs();
    (error > WRONG_TRAVEL.0 && error > WRONG_TRAVEL.1 * deviation)
        .then_some(Doubt::Travel { share: p[travel], deviation })
}
