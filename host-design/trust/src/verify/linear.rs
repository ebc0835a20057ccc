//! Results from the linear model of the loop with the numbers of the table.

use serde::Serialize;
use upright::table::Law;

use upright_design::design::{Certified, DriveLimits};
use upright_design::numerics::{Complex, eigenvalues};
use upright_design::rig::Rig;
use upright_design::table::TableValues;

use super::{Certificate, LagLimits, LoopModel, Margins, NoiseShare, Rounding, TickLimits, VerifyError};
use super::{certificate, covariance, lag, loop_model, margins, rounding, tick};

/// Results from the linear model of the loop for one law: sampled, delayed, with observer, with the table's
/// `f32` values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinearReport {
    /// The law in the loop.
    pub law: Law,
    /// Poles of the whole loop as [re, im], sorted by real part.
    pub poles: Vec<[f64; 2]>,
    /// Largest absolute value of a pole: stable below 1.
    pub spectral_radius: f64,
    /// Whether it is below 1. The three parts that follow exist only for a stable loop.
    pub stable: bool,
    /// Margins at the plant's input.
    pub margins: Option<Margins>,
    /// Limits on longer, shorter and uneven ticks.
    pub tick: Option<TickLimits>,
    /// RMS by source of noise, the total last; none without `[kalman]`.
    pub noise: Option<Vec<NoiseShare>>,
    /// Effect of `f32`; none if the table's gains are not those of the design.
    pub rounding: Option<Rounding>,
    /// Evidence for each gain; empty if the table's gains are not those designed for the tick.
    pub certificates: Vec<Certificate>,
    /// How slow a drive may be that imposes the cart's acceleration, with the LQR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<DriveLimits>,
    /// How far the lag of the force may be from the stated one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag: Option<LagLimits>,
}

/// The linear half of the trust report, one for each law in the table.
///
/// # Errors
/// [`VerifyError`] if a figure cannot be computed; an unstable loop is not an error.
pub fn linear(
    rig: &Rig,
    certified: &Certified,
    table: &TableValues,
) -> Result<Vec<LinearReport>, VerifyError> {
    let certificates = certificate::Certificates::of(rig, certified)?;
    let mut reports = Vec::new();
    for law in Law::ALL {
        let Some(numbers) = loop_model::Numbers::<f64>::of_table(table, law) else { continue };
        let seen = &loop_model::seen_plant(certified, &numbers);
        let model = LoopModel::with_numbers(seen, &numbers);
        let (poles, spectral_radius) = poles(&model)?;
        let stable = spectral_radius < 1.0;
        let tick_s = rig.tick.period_s;
        let (mut margins, mut tick, mut noise, mut real_lag) = (None, None, None, None);
        if stable {
            let grid = margins::Grid::of(&model)?;
            margins = Some(margins::margins(seen, &numbers, &grid, tick_s)?);
            tick = Some(tick::limits(seen, &numbers, &grid, tick_s)?);
            real_lag = lag::limits(seen, &numbers, tick_s)?;
            noise = covariance::covariance(rig, seen, &model, table.observer.is_some())?;
        }
        let as_designed = loop_model::exact_law(certified, table, law)
            .is_some_and(|exact| certified.double.sampled.in_table()[law] == Some(exact));
        reports.push(LinearReport {
            law,
            poles,
            spectral_radius,
            stable,
            margins,
            tick,
            noise,
            rounding: rounding::rounding(rig, certified, table, law, spectral_radius)?,
            lag: real_lag,
            drive: (law == Law::Lqr).then(|| DriveLimits::of(rig, &certified.double)).flatten(),
            certificates: if as_designed { certificates.of_law(law) } else { Vec::new() },
        });
    }
    Ok(reports)
}

/// The margins of [`linear`] alone; none if the table does not hold `law` or its loop is unstable.
///
/// # Errors
/// [`VerifyError`] if they cannot be computed.
pub fn margins_of(
    rig: &Rig,
    certified: &Certified,
    table: &TableValues,
    law: Law,
) -> Result<Option<Margins>, VerifyError> {
    let Some(numbers) = loop_model::Numbers::<f64>::of_table(table, law) else { return Ok(None) };
    let seen = &loop_model::seen_plant(certified, &numbers);
    let model = LoopModel::with_numbers(seen, &numbers);
    let (_, spectral_radius) = poles(&model)?;
    let stable = spectral_radius < 1.0;
    if !stable {
        return Ok(None);
    }
    let grid = margins::Grid::of(&model)?;
    margins::margins(seen, &numbers, &grid, rig.tick.period_s).map(Some)
}

/// Poles of the loop as [re, im], sorted by real part, and the largest absolute value of one.
fn poles(model: &LoopModel<f64>) -> Result<(Vec<[f64; 2]>, f64), VerifyError> {
    let poles = eigenvalues(&model.matrix).map_err(|_| VerifyError::Poles)?;
    let poles: Vec<[f64; 2]> = poles.iter().map(Complex::to_f64).collect();
    let spectral_radius = poles.iter().map(|pole| pole[0].hypot(pole[1])).fold(0.0, f64::max);
    Ok((poles, spectral_radius))
}
