//! From the log to a rig file, gains, and a verdict.

use std::path::{Path, PathBuf};

use upright::table::Law;
use upright_design::design::{Certified, design};
use upright_design::number::significant;
use upright_design::rig::{Rig, RigText, Tolerances};
use upright_design::study::Study;
use upright_design::table::{Gains, TableValues};
use upright_identify::{
    Estimate, Identification, Log, ParameterKind, Recordings, Settings, identify_recordings, rig_file,
};
use upright_trust::robust::{JudgeSettings, RobustError, choose, judge, rewritten, set_tolerances};
use upright_trust::verify::{VerifyError, brief};

use super::machine::Stop;
use super::plan::CommissionPlan;
use super::record::Journal;
use crate::identified::{json, text};
use upright_command::progress::{with_progress, with_spinner};

/// Duration of the runs that the gains have to survive (s).
const RUN_S: f64 = 10.0;
/// Width of the tolerances, in deviations of the estimates.
const DEVIATIONS: f64 = 2.0;
/// Smallest tolerance of the masses (%).
const LEAST_PERCENT: f64 = 1.0;
/// Largest one (%), as a rig file accepts it.
const MOST_PERCENT: f64 = 45.0;
/// Largest latency, as a share of a tick.
const MOST_LATENCY: f64 = 0.3;

/// The rig as it was found, with its gains.
#[derive(Debug, Clone)]
pub struct Designed {
    /// The text of its file.
    pub text: String,
    /// The rig.
    pub rig: Rig,
    /// Its gain table.
    pub table: TableValues,
    certified: Certified,
}

impl Designed {
    /// The `plan` with this rig in place of that of the file.
    pub fn plan<'a>(&'a self, plan: CommissionPlan<'a>) -> CommissionPlan<'a> {
        CommissionPlan { rig: &self.rig, table: &self.table, text: &self.text, ..plan }
    }
}

/// The parameters of the machine, from its log.
pub(super) fn identified(
    journal: &mut Journal,
    plan: CommissionPlan<'_>,
    log: &Log,
) -> Result<Identification, Stop> {
    let settings = Settings::default();
    let logs = Recordings::Logs(vec![(PathBuf::from("the log"), log.clone())]);
    let text_of_file = Some(plan.text);
    let found = with_progress(|progress| {
        identify_recordings(plan.rig, text_of_file, &logs, None, &settings, progress)
    })
    .map_err(|error| Stop::Machine(error.to_string()))?;
    text(&plan.rig.name, &found, &settings).lines().for_each(|line| journal.found(line));
    journal.data(json(&plan.rig.name, &found));
    let reason = found.refusal.as_ref().map(ToString::to_string).or(found.doubted().map(ToString::to_string));
    reason.map_or(Ok(found), |reason| Err(Stop::Machine(reason)))
}

/// The rig file with the numbers that were found, and gains for them.
pub(super) fn designed(
    journal: &mut Journal,
    plan: CommissionPlan<'_>,
    found: &Identification,
) -> Result<Designed, Stop> {
    let machine = |words: String| Stop::Machine(words);
    let note = format!(
        "{} with the numbers that `upright commission` found from {:.0} s of shaking.",
        plan.file.display(),
        found.seconds
    );
    let text = rig_file(plan.text, plan.rig, found, &note.replace(['\n', '\r'], " "), plan.file)
        .map_err(|error| machine(error.to_string()))?;
    let tolerances = tolerances(plan.rig, found);
    let words: Vec<String> = tolerances
        .each()
        .map(|(key, unit, value)| format!("{key} {} {unit}", significant(value, 2)))
        .collect();
    journal.found(format!("the machine may differ from the new file by: {}", words.join(", ")));
    let mut text = RigText::parse(&text, plan.file).map_err(|error| machine(error.to_string()))?;
    set_tolerances(&mut text, &tolerances).map_err(|error| machine(error.to_string()))?;
    let own = of_text(text.to_string(), plan.file)?;
    robust(journal, plan, own, &tolerances)
}

/// How far the machine may differ from the new file: by the deviations of the estimates, by its friction, and by the
/// zeros and the delay of this run.
fn tolerances(rig: &Rig, found: &Identification) -> Tolerances {
    let largest = |which: fn(ParameterKind) -> bool, value: fn(&Estimate) -> f64| {
        found.estimates.iter().filter(|one| which(one.kind)).map(value).fold(0.0, f64::max)
    };
    let upper = |one: &Estimate| one.new.abs() + DEVIATIONS * one.deviation;
    let mass = largest(
        |kind| {
            matches!(
                kind,
                ParameterKind::TotalMass | ParameterKind::FirstMoment(_) | ParameterKind::SecondMoment(_)
            )
        },
        |one| DEVIATIONS * one.deviation / one.new.abs(),
    );
    // The new file may have another delay than the old one.
    let delay_ticks =
        found.other_delay().map_or(0.0, |delay| f64::from(delay) - f64::from(found.delay_ticks));
    let late_ticks =
        found.estimate(ParameterKind::Delay).map_or(0.0, |one| one.new + DEVIATIONS * one.deviation);
    let period_s = rig.tick.period_s;
    Tolerances {
        mass_percent: (100.0 * mass).clamp(LEAST_PERCENT, MOST_PERCENT),
        joint_friction_n_m: largest(|kind| matches!(kind, ParameterKind::JointDry(_)), upper),
        cart_friction_n: largest(|kind| kind == ParameterKind::CartDry, upper),
        homing_error_rad: largest(|kind| matches!(kind, ParameterKind::Zero(_)), upper),
        latency_s: (late_ticks - delay_ticks).clamp(0.0, MOST_LATENCY) * period_s,
    }
}

/// The file's own weights if they survive the tolerances; else those that a search finds; else the file's own again.
fn robust(
    journal: &mut Journal,
    plan: CommissionPlan<'_>,
    own: Designed,
    tolerances: &Tolerances,
) -> Result<Designed, Stop> {
    let settings = JudgeSettings { runs: 1, duration_s: RUN_S, ..JudgeSettings::of(&own.rig) };
    let laws: Vec<Law> = own.table.laws.present().map(|(law, _)| law).collect();
    let survives = |law: &Law| -> Result<bool, VerifyError> {
        Ok(judge(&own.rig, &own.table, *law, tolerances, &settings, &Study::whole())?.survives())
    };
    let all = with_spinner("judging", || laws.iter().map(survives).collect::<Result<Vec<_>, _>>());
    if all.map_err(|error| Stop::Machine(error.to_string()))?.iter().all(|&survives| survives) {
        journal.found("the weights of the file survive that");
        return Ok(own);
    }
    match with_progress(|progress| choose(&own.rig, tolerances, &settings, false, progress)) {
        Ok((choice, _)) => {
            for one in &choice.laws {
                journal.found(format!("{}: {}", one.law, one.candidate.name));
            }
            let file = plan.file.display().to_string();
            let text = rewritten(&own.text, &file, &own.rig.name, &own.rig, tolerances, &choice);
            of_text(text.map_err(|error| Stop::Machine(error.to_string()))?, plan.file)
        }
        Err(RobustError::Unhelped(reason)) => {
            journal.found(format!(
                "no other weights survive all of that ({reason}): those of the file are kept"
            ));
            Ok(own)
        }
        Err(error) => Err(Stop::Machine(error.to_string())),
    }
}

/// Reads the rig from the text of its file, and designs its gains.
fn of_text(text: String, file: &Path) -> Result<Designed, Stop> {
    let machine = |error: &dyn std::error::Error| Stop::Machine(error.to_string());
    let rig = Rig::from_toml(&text, file).map_err(|error| machine(&error))?;
    let certified = with_spinner("designing", || design(&rig)).map_err(|error| machine(&error))?;
    let table = TableValues::of(&rig, &certified, Gains::Sampled).map_err(|error| machine(&error))?;
    Ok(Designed { text, rig, table, certified })
}

/// Margins, and runs with the friction that was found.
pub(super) fn verified(journal: &mut Journal, designed: &Designed) -> Result<(), Stop> {
    let Designed { rig, table, certified, .. } = designed;
    let report = with_spinner("verifying", || brief(rig, certified, table))
        .map_err(|error| Stop::Machine(error.to_string()))?;
    for check in &report.checks {
        journal.found(format!(
            "{}: {}: {}, {} required",
            check.law.key(),
            check.requirement,
            check.found_text(),
            check.required_text()
        ));
    }
    let failed = report.failed();
    if failed.is_empty() {
        return Ok(());
    }
    Err(Stop::Machine(format!(
        "the machine as it was found would not be balanced: not met: {}; look for friction, or ask upright verify with the \
         new file",
        failed.join("; ")
    )))
}
