//! The whole trust report of a rig, and its verdict against the rig file's `[verify]`.

use serde::Serialize;
use upright::table::Law;

use super::law::{law_trust, noise};
use super::{Effort, LawTrust, Margins, VerifyError, linear};
use upright_design::design::Certified;
use upright_design::number::significant;
use upright_design::parallel::{Progress, ProgressStep};
use upright_design::rig::{Requirements, Rig};
use upright_design::table::TableValues;

/// The trust report of a rig.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrustReport {
    /// One part for each law in the table.
    pub laws: Vec<LawTrust>,
    /// Every requirement and the value found.
    pub checks: Vec<Check>,
}

impl TrustReport {
    /// The requirements that are not met, with their laws; and what their runs cannot decide.
    pub fn failed(&self) -> Vec<String> {
        let failed = self.checks.iter().filter(|check| !check.holds);
        let remark = |check: &Check| check.remark().map_or(String::new(), |remark| format!(" ({remark})"));
        failed.map(|check| format!("{}: {}{}", check.law.key(), check.requirement, remark(check))).collect()
    }
}

/// One requirement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// The law that was checked.
    pub law: Law,
    /// What is required, with its key in `[verify]`.
    pub requirement: &'static str,
    /// The threshold.
    pub required: f64,
    /// What was found; none: it does not exist or is without bound.
    pub found: Option<f64>,
    /// Whether it holds.
    pub holds: bool,
    /// If the number of runs cannot decide whether it holds: the fewest runs that could show that it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fewest_runs: Option<usize>,
}

/// Makes the report.
///
/// # Errors
/// [`VerifyError`] if a value cannot be computed.
pub fn trust(
    rig: &Rig,
    certified: &Certified,
    table: &TableValues,
    effort: Effort<'_>,
    progress: Progress<'_>,
) -> Result<TrustReport, VerifyError> {
    progress(ProgressStep::Begin("margins, tick, noise and rounding", 1));
    let mut laws = Vec::new();
    for part in linear(rig, certified, table)? {
        laws.push(law_trust(rig, table, part, effort, progress)?);
    }
    let checks = laws.iter().flat_map(|law| checks(rig, law)).collect();
    Ok(TrustReport { laws, checks })
}

/// The part of the report that takes only seconds: margins, and nominal runs with noise on the machine of `[reality]`.
///
/// # Errors
/// [`VerifyError`] if a value cannot be computed.
pub fn brief(rig: &Rig, certified: &Certified, table: &TableValues) -> Result<TrustReport, VerifyError> {
    let mut laws = Vec::new();
    for part in linear(rig, certified, table)? {
        let mut trust = LawTrust::linear_only(part);
        if trust.linear.stable {
            trust.noise_run = noise(rig, table, trust.linear.law)?;
        }
        laws.push(trust);
    }
    let checks = laws.iter().flat_map(|law| checks(rig, law)).collect();
    Ok(TrustReport { laws, checks })
}

impl Check {
    /// What was found, as text.
    pub fn found_text(&self) -> String {
        let without_number = if self.holds { "no limit" } else { "none" };
        self.found.map_or(without_number.to_owned(), |found| significant(found, 3))
    }

    /// What is missing for a verdict, if anything is.
    pub fn remark(&self) -> Option<String> {
        self.fewest_runs.map(|fewest| format!("too few runs: at least {fewest} are needed"))
    }

    /// The threshold, as text.
    pub fn required_text(&self) -> String {
        significant(self.required, 3)
    }

    /// A requirement that `found` is at least `required`; if nothing was found, `unbounded` says whether it holds.
    fn at_least(
        law: Law,
        requirement: &'static str,
        required: f64,
        found: Option<f64>,
        unbounded: bool,
    ) -> Self {
        let holds = found.map_or(unbounded, |found| found >= required);
        Check { law, requirement, required, found, holds, fewest_runs: None }
    }

    /// A requirement that all of a number of runs survive.
    fn all_survive(law: Law, requirement: &'static str, runs: f64, survived: f64) -> Self {
        Check {
            law,
            requirement,
            required: runs,
            found: Some(survived),
            holds: survived >= runs,
            fewest_runs: None,
        }
    }
}

/// Every requirement of one law.
fn checks(rig: &Rig, trust: &LawTrust) -> Vec<Check> {
    let (law, margins) = (trust.linear.law, trust.linear.margins.as_ref());
    let mut checks = vec![Check {
        law,
        requirement: "spectral radius below",
        required: 1.0,
        found: Some(trust.linear.spectral_radius),
        holds: trust.linear.stable,
        fewest_runs: None,
    }];
    checks.extend(margins.into_iter().flat_map(|margins| margin_checks(&rig.verify, law, margins)));
    checks.extend(run_checks(&rig.verify, trust));
    checks.extend(margins.map(|margins| {
        let (required, peak) = (rig.verify.peak_sensitivity, margins.peak_sensitivity);
        let requirement = "peak sensitivity at most (peak_sensitivity)";
        Check { law, requirement, required, found: Some(peak), holds: peak <= required, fewest_runs: None }
    }));
    checks.extend(limit_check(rig, trust));
    checks.extend(counted_checks(trust));
    checks
}

fn margin_checks(required: &Requirements, law: Law, margins: &Margins) -> [Check; 4] {
    // Without a crossing of the critical value the margin is unlimited.
    let at_least =
        |requirement, required, found: Option<f64>| Check::at_least(law, requirement, required, found, true);
    let (lowest, highest) = (Some(1.0 / margins.lowest_gain), margins.highest_gain);
    let phase_deg = margins.phase_margin_rad.map(f64::to_degrees);
    let delay_ticks = margins.delay_margin_ticks;
    [
        at_least("gain may grow by a factor (gain_margin)", required.gain_margin, highest),
        at_least("gain may fall by a factor (gain_margin)", required.gain_margin, lowest),
        at_least("phase margin in degrees (phase_margin_deg)", required.phase_margin_deg, phase_deg),
        at_least("additional delay in ticks (delay_margin_ticks)", required.delay_margin_ticks, delay_ticks),
    ]
}

fn run_checks(required: &Requirements, trust: &LawTrust) -> Vec<Check> {
    let at_least = |requirement, required, found: Option<f64>| {
        Check::at_least(trust.linear.law, requirement, required, found, false)
    };
    let tilts = trust.attraction.iter().flat_map(|attraction| &attraction.tilts);
    let smallest = tilts.map(|tilt| tilt.edge.size).min_by(f64::total_cmp);
    let tilt =
        smallest.map(|rad| at_least("tilt of any link in rad (tilt_rad)", required.tilt_rad, Some(rad)));
    let encoder = trust.coarsest_encoder.as_ref().map(|encoder| {
        at_least("encoders coarser by a factor (encoder_factor)", required.encoder_factor, encoder.factor)
    });
    let random = trust.monte_carlo.as_ref().map(|runs| {
        let lowest = Some(100.0 * runs.interval[0]);
        let requirement = "random plants that survive in %, lower bound (success_percent)";
        let fewest_runs = runs.fewest_to_decide(0.01 * required.success_percent);
        Check { fewest_runs, ..at_least(requirement, required.success_percent, lowest) }
    });
    [tilt, encoder, random].into_iter().flatten().collect()
}

/// A loop that uses most of a limit at rest reaches it within hours.
fn limit_check(rig: &Rig, trust: &LawTrust) -> Option<Check> {
    let ripple = trust.noise_run.as_ref()?.ripple.as_ref().filter(|_| rig.chain().is_some())?;
    let (required, found) = (rig.verify.limit_percent, 100.0 * ripple.limit_share.largest()?);
    let requirement = "share of a limit used at rest in %, at most (limit_percent)";
    let (law, holds) = (trust.linear.law, found <= required);
    Some(Check { law, requirement, required, found: Some(found), holds, fewest_runs: None })
}

/// Requirements that all of a number of runs survive.
fn counted_checks(trust: &LawTrust) -> Vec<Check> {
    let law = trust.linear.law;
    let corners = trust.corners.as_ref().map(|corners| {
        let (all, survived) = (corners.corners as f64, corners.survived as f64);
        Check::all_survive(law, "combinations of mass errors that survive (corner_percent)", all, survived)
    });
    let nominal = trust.noise_run.as_ref().map(|noise| {
        Check::all_survive(law, "nominal runs that survive", noise.runs as f64, noise.survived as f64)
    });
    let tolerated = trust.corner_noise.as_ref().map(|noise| {
        let requirement = "combinations of mass errors within [robust] that survive";
        Check::all_survive(law, requirement, noise.runs as f64, noise.survived as f64)
    });
    let imperfections = trust.imperfections.iter().map(|required| {
        let (runs, within) = (required.verdict.runs as f64, required.verdict.stayed_on as f64);
        Check::all_survive(law, required.requirement, runs, within)
    });
    corners.into_iter().chain(nominal).chain(tolerated).chain(imperfections).collect()
}
