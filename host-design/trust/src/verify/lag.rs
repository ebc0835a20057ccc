//! How far the lag of a motor driver may be from the one that the rig file states.

use super::loop_model::{ControllerModel, LoopModel, Numbers, PlantModel};
use super::{VerifyError, radius};
use upright_design::design::{Certified, with_lag};
use upright_design::numerics::Matrix;

use serde::Serialize;

/// The real lags that are tried are a factor of this apart.
const RATIO: f64 = 1.03;
/// The longest one that is tried, as a multiple of the stated one.
const MOST: f64 = 100.0;

/// Time constants of the real force with which the loop is stable whose law is designed for the stated one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LagLimits {
    /// Least lag (s); none if the loop is stable without any.
    pub least_s: Option<f64>,
    /// Largest lag (s); none: a hundred times the stated one.
    pub largest_s: Option<f64>,
}

/// The limits of a stable loop; none for a rig without a stated lag.
pub(super) fn limits(
    certified: &Certified,
    numbers: &Numbers<f64>,
    tick_s: f64,
) -> Result<Option<LagLimits>, VerifyError> {
    let stated_s = certified.double.lag_s;
    if stated_s == 0.0 {
        return Ok(None);
    }
    let is_stable =
        |lag_s: f64| Ok::<_, VerifyError>(radius(&loop_with(certified, numbers, tick_s, lag_s))? < 1.0);
    let last_stable = |ratio: f64, end_s: f64| {
        let mut lag_s = stated_s;
        while (lag_s < end_s) == (stated_s < end_s) && is_stable(lag_s * ratio)? {
            lag_s *= ratio;
        }
        Ok::<_, VerifyError>(lag_s)
    };
    let largest_s = last_stable(RATIO, MOST * stated_s)?;
    // A force without lag is followed by one so fast that it makes no difference.
    let least_s = if is_stable(0.0)? { None } else { Some(last_stable(1.0 / RATIO, stated_s / MOST)?) };
    Ok(Some(LagLimits { least_s, largest_s: Some(largest_s).filter(|lag_s| *lag_s < MOST * stated_s) }))
}

/// The loop whose force follows its command with this lag (s).
fn loop_with(certified: &Certified, numbers: &Numbers<f64>, tick_s: f64, lag_s: f64) -> LoopModel<f64> {
    let (a, b): (Matrix<f64>, Matrix<f64>) = with_lag(&certified.double.a, &certified.double.b, lag_s);
    let plant = PlantModel::delayed(&a, &b, tick_s, numbers.delay_ticks() as f64, &numbers.c);
    LoopModel::of(&plant, &ControllerModel::of(numbers))
}
