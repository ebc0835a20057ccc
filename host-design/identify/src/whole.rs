//! What the estimates of a driven machine say of its file as a whole: the scale of the force, the slope of the rail.

use crate::doubt::Doubt;
use crate::estimated::Estimate;
use crate::parameters::ParameterKind;

/// Scales of all masses that are not doubted, and how much a mass or a moment may differ from the common factor.
const SCALES: core::ops::RangeInclusive<f64> = 0.75..=1.33;
const COMMON: f64 = 1.2;
/// Largest slope of a rail that is not named (rad), with so many deviations.
const LEVEL_RAD: (f64, f64) = (0.01, 4.0);

/// What the estimates of a driven machine say of the file as a whole.
pub(crate) fn doubts(estimates: &[Estimate]) -> Vec<Doubt> {
    let is_mass = |estimate: &&Estimate| {
        let mass = matches!(estimate.kind, ParameterKind::TotalMass | ParameterKind::SecondMoment(_));
        mass || matches!(estimate.kind, ParameterKind::FirstMoment(_))
    };
    let logs: Vec<f64> =
        estimates.iter().filter(is_mass).map(|mass| libm::log(mass.new / mass.old)).collect();
    let mean = logs.iter().sum::<f64>() / logs.len().max(1) as f64;
    let by = libm::exp(mean);
    let is_common = logs.iter().all(|log| (log - mean).abs() < libm::log(COMMON));
    let scale = (by.is_finite() && is_common && !SCALES.contains(&by)).then_some(Doubt::Scale(by));
    let tilt = estimates.iter().find(|estimate| estimate.kind == ParameterKind::Tilt);
    let most = |tilt: &Estimate| LEVEL_RAD.0.max(LEVEL_RAD.1 * tilt.deviation);
    let tilted = tilt.filter(|tilt| tilt.new.abs() > most(tilt)).map(|tilt| Doubt::Tilted(tilt.new));
    scale.into_iter().chain(tilted).collect()
}
