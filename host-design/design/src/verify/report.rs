//! All of it for one rig, and the verdict against the rig file's `[verify]`.

use serde::Serialize;
use upright::table::Law;

use super::corners::MOST_LINKS;
use super::{
    Attraction, AttractionSettings, CoarsestEncoder, CornerSettings, Corners, Disturbance, EncoderSettings,
    LinearReport, MassTolerance, MonteCarlo, NoiseRun, Spread, Unverifiable, VerifyError, attraction,
    coarsest_encoder, corners, linear, mass_tolerances, monte_carlo, noise_run,
};
use crate::design::Certified;
use crate::rig::{PlantDescription, Rig};
use crate::table::TableValues;

/// The trust report of a rig.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrustReport {
    /// One part for each law in the table.
    pub laws: Vec<LawTrust>,
    /// Every requirement with what was found.
    pub checks: Vec<Check>,
}

/// What was found for one law. Parts that a rig has no data for (masses of a `[model]`, encoders) are none, and so are
/// the runs of a loop that is not even stable.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawTrust {
    /// Margins, tick, noise, rounding, certificates.
    pub linear: LinearReport,
    /// Largest tilts and step.
    pub attraction: Option<Attraction>,
    /// Noise in a simulated run.
    pub noise_run: Option<NoiseRun>,
    /// The coarsest encoder.
    pub coarsest_encoder: Option<CoarsestEncoder>,
    /// Wrong masses, every corner.
    pub corners: Option<Corners>,
    /// How wrong each single mass may be, the most critical first.
    pub mass_tolerances: Vec<MassTolerance>,
    /// Random plants.
    pub monte_carlo: Option<MonteCarlo>,
}

/// One requirement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// The law it is about.
    pub law: &'static str,
    /// What is required, with its key in `[verify]`.
    pub requirement: &'static str,
    /// The threshold.
    pub required: f64,
    /// What was found; none: it does not exist or is without bound.
    pub found: Option<f64>,
    /// Whether it holds.
    pub holds: bool,
}

/// How much effort goes into the report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Monte Carlo runs for each law.
    pub runs: usize,
    /// Seed of the first of them.
    pub seed: u64,
    /// Share of them in which the force comes one tick later than designed for.
    pub late: f64,
}

/// How random plants are drawn for `rig`: by its `[verify]`, a share `late` of them with one more tick of delay.
pub fn spread(rig: &Rig, late: f64) -> Spread {
    let share = rig.verify.spread_percent / 100.0;
    Spread { mass: share, length: share, inertia: share, other_delay: late, ..Spread::of(rig) }
}

/// Makes the report. `done` is called after each Monte Carlo run, `stage` before each part.
///
/// # Errors
/// [`VerifyError`] if a figure cannot be computed.
pub fn trust(
    rig: &Rig,
    certified: &Certified,
    table: &TableValues,
    effort: Effort,
    stage: &dyn Fn(&str),
    done: &(dyn Fn() + Sync),
) -> Result<TrustReport, VerifyError> {
    stage("margins, tick, noise and rounding");
    let mut laws = Vec::new();
    for part in linear(rig, certified, table)? {
        laws.push(law_trust(rig, table, part, effort, stage, done)?);
    }
    let checks = laws.iter().flat_map(|law| checks(rig, law)).collect();
    Ok(TrustReport { laws, checks })
}

fn law_trust(
    rig: &Rig,
    table: &TableValues,
    linear: LinearReport,
    effort: Effort,
    stage: &dyn Fn(&str),
    done: &(dyn Fn() + Sync),
) -> Result<LawTrust, VerifyError> {
    let law = if linear.law == "lqr" { Law::Lqr } else { Law::PolePlacement };
    let is_chain = matches!(rig.plant, PlantDescription::Chain(_));
    let mut trust = LawTrust {
        linear,
        attraction: None,
        noise_run: None,
        coarsest_encoder: None,
        corners: None,
        mass_tolerances: Vec::new(),
        monte_carlo: None,
    };
    if !trust.linear.stable {
        return Ok(trust);
    }
    stage("largest tilts and step");
    trust.attraction = known(attraction(rig, table, law, &AttractionSettings::default()))?;
    stage("noise");
    trust.noise_run = known(noise_run(rig, table, law, &Disturbance::of(rig), 4, 20.0))?;
    if table.observer.is_some() && is_chain {
        stage("coarsest encoder");
        trust.coarsest_encoder = known(coarsest_encoder(rig, law, &EncoderSettings::of(rig)))?;
    }
    // Beyond that there are too many corners to try them all.
    if is_chain && rig.states() / 2 - 1 <= MOST_LINKS {
        stage("wrong masses");
        let settings = CornerSettings::of(rig);
        trust.corners = known(corners(rig, table, law, rig.verify.corner_percent, &settings))?;
        let mut tolerances = known(mass_tolerances(rig, table, law, &settings))?.unwrap_or_default();
        tolerances.sort_by(|one, other| one.percent().total_cmp(&other.percent()));
        trust.mass_tolerances = tolerances;
    }
    if is_chain {
        stage("random plants");
        trust.monte_carlo =
            known(monte_carlo(rig, table, law, &spread(rig, effort.late), effort.seed, effort.runs, done))?;
    }
    Ok(trust)
}

/// A part for which the rig file has no data is left out; any other failure is one.
fn known<T>(part: Result<T, Unverifiable>) -> Result<Option<T>, VerifyError> {
    match part {
        Ok(part) => Ok(Some(part)),
        Err(Unverifiable::NotAChain(_) | Unverifiable::NoObserver) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn checks(rig: &Rig, trust: &LawTrust) -> Vec<Check> {
    let required = &rig.verify;
    let law = trust.linear.law;
    let mut checks = Vec::new();
    let mut check = |requirement, required, found: Option<f64>, holds| {
        checks.push(Check { law, requirement, required, found, holds });
    };
    let mut at_least = |requirement, required: f64, found: Option<f64>, when_unbounded: bool| {
        check(requirement, required, found, found.map_or(when_unbounded, |found| found >= required));
    };
    let margins = trust.linear.margins.as_ref();
    let stable = trust.linear.stable;
    if let Some(margins) = margins {
        // Without a crossing of the critical value the margin is unlimited.
        at_least("gain may grow by a factor (gain_margin)", required.gain_margin, margins.highest_gain, true);
        at_least(
            "gain may fall by a factor (gain_margin)",
            required.gain_margin,
            Some(1.0 / margins.lowest_gain),
            true,
        );
        let phase = margins.phase_margin_rad.map(f64::to_degrees);
        at_least("phase margin in degrees (phase_margin_deg)", required.phase_margin_deg, phase, true);
        let delay = margins.delay_margin_ticks;
        at_least("further delay in ticks (delay_margin_ticks)", required.delay_margin_ticks, delay, true);
    }
    if let Some(attraction) = &trust.attraction {
        let smallest = attraction.tilts.iter().map(|tilt| tilt.edge.size).min_by(f64::total_cmp);
        if smallest.is_some() {
            at_least("tilt of any link in rad (tilt_rad)", required.tilt_rad, smallest, false);
        }
    }
    if let Some(encoder) = &trust.coarsest_encoder {
        at_least(
            "encoders coarser by a factor (encoder_factor)",
            required.encoder_factor,
            encoder.factor,
            false,
        );
    }
    if let Some(runs) = &trust.monte_carlo {
        let lowest = 100.0 * runs.interval[0];
        at_least(
            "random plants that stand in %, lower bound (success_percent)",
            required.success_percent,
            Some(lowest),
            false,
        );
    }
    if let Some(margins) = margins {
        let peak = margins.peak_sensitivity;
        check(
            "peak sensitivity at most (peak_sensitivity)",
            required.peak_sensitivity,
            Some(peak),
            peak <= required.peak_sensitivity,
        );
    }
    if let Some(corners) = &trust.corners {
        let all = corners.corners as f64;
        check(
            "corners of wrong masses that stand (corner_percent)",
            all,
            Some(corners.stand as f64),
            corners.stand == corners.corners,
        );
    }
    if let Some(noise) = &trust.noise_run {
        check(
            "nominal runs that stand",
            noise.seeds as f64,
            Some(noise.stood as f64),
            noise.stood == noise.seeds,
        );
    }
    check("spectral radius below", 1.0, Some(trust.linear.spectral_radius), stable);
    checks.rotate_right(1);
    checks
}
