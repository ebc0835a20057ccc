//! The motion along a path, with its gains.

use super::SwingUpError;
use super::refine::Path;
use super::setting::Setting;
use super::tracking::{PathFilter, feedback, ticks};
use upright_design::motion::{PlannedMotion, Transition};
use upright_design::numerics::Matrix;

/// Factor on the weights of `[lqr]` for the positions of cart and links along a motion: a link that leaves its plan is
/// soon lost. With a factor of 10, more runs are lost where encoders are coarse.
pub(crate) const POSITION_WEIGHT: f64 = 4.0;

/// The motion that follows `path`, which ends at rest. The weights of `[lqr]` for positions are multiplied by
/// `position_weight`.
pub(crate) fn motion(
    setting: &Setting<'_>,
    path: Path,
    transition: Transition,
    position_weight: f64,
) -> Result<PlannedMotion, SwingUpError> {
    let ticks = ticks(&*setting.dynamics, &path, setting.tick_s);
    let states = path.x[0].len();
    let weights = Matrix::from_fn(states, states, |i, j| {
        let factor = if i % 2 == 0 && j % 2 == 0 { position_weight } else { 1.0 };
        factor * setting.weights[(i, j)]
    });
    let k =
        feedback(&ticks, &weights, setting.input_weight, &setting.at_end(transition).cost, setting.tick_s);
    let mut filter = PathFilter::new(&*setting.dynamics, &setting.noise, states, setting.tick_s);
    filter.covariance = setting.at_start(transition).covariance.clone();
    let l: Result<Vec<Matrix<f64>>, _> =
        path.x.iter().zip(&ticks).map(|(x, tick)| filter.gain(x, tick)).collect();
    Ok(PlannedMotion::new(setting.tick_s, path.x, path.u, k, l?)?)
}
