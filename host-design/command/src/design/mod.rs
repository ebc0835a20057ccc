//! `upright design`

use std::path::{Path, PathBuf};

use clap::Args;
use upright::boards::BOARDS;
use upright::table::{Law, PerLaw};
use upright_design::design::{Assessment, DesignPoles, design};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, SimulationError, Summary, simulate};
use upright_design::table::{Gains, TableValues, gains_source, identity_differences, write_atomically};

use crate::failure::Failure;
use crate::output::{print, warn_of_unusual_values};
use crate::progress::with_spinner;
use crate::project::gain_table;
use law_report::LawReport;

mod data;
mod law_report;
mod text;

/// Designs and certifies the gains of a rig and writes the gain table of the firmware.
///
/// Exit status 1 if the closed loop falls or --check finds a difference, 2 for a bad rig file, 3 if there is no
/// design.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright design rigs/quadruple-paper.toml
  upright design my.toml --out gains.rs
  upright design my.toml --swing-up                       with the motions of `upright swing-up my.toml`
  upright design rigs/quadruple-paper.toml --check        exit status 1 if src/gains.rs differs
  upright design my.toml --json --no-write | jq .sampled.lqr.K")]
pub struct DesignCommand {
    /// Rig file (TOML)
    rig: PathBuf,
    /// Write the table here [default: src/gains.rs of the crate in this folder, or of the checkout around it]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write nothing; fail if the table file differs from what would be written
    #[arg(long, conflicts_with = "no_write")]
    check: bool,
    /// Write nothing
    #[arg(long)]
    no_write: bool,
    /// Write the motions that are stored beside the rig file into the table, too
    #[arg(long)]
    swing_up: bool,
    /// Write these and the stored motions between other equilibria into the table
    #[arg(long)]
    transitions: bool,
    /// Print the whole design as one JSON object
    #[arg(long)]
    json: bool,
}

/// Adds the motions that are stored beside a rig file to its table: those between other equilibria, too, if the last
/// argument says so.
pub type AddMotions = fn(&Path, &Rig, TableValues, bool) -> Result<TableValues, Failure>;

impl DesignCommand {
    /// Whether planned motions are to be in the table.
    pub fn wants_motions(&self) -> bool {
        self.swing_up || self.transitions
    }

    /// Runs the command; `add_motions` is called if it [wants motions](Self::wants_motions).
    ///
    /// # Errors
    /// [`Failure`] for an invalid rig file, if there is no design or no place for its table, if the closed loop falls,
    /// or if the table's file differs from what --check expects.
    pub fn run(self, add_motions: AddMotions) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        // Before the work, which is in vain where there is no place for its result.
        let path = match (self.no_write, &self.out) {
            (true, _) => None,
            (false, Some(out)) => Some(out.clone()),
            (false, None) => Some(gain_table().map_err(|error| Failure::argument(error.to_string()))?),
        };
        let name = || self.rig.display().to_string();
        let (certified, poles, reports, table) = with_spinner("designing", || -> Result<_, Failure> {
            let failed = |source| Failure::of_rig(name(), source);
            let certified = design(&rig).map_err(failed)?;
            let poles = certified.poles(&rig).map_err(failed)?;
            let assessments = certified.assess(&rig).map_err(failed)?;
            let table = TableValues::of(&rig, &certified, Gains::Sampled);
            let reports = report(&rig, &poles, assessments, table.as_ref().ok())?;
            Ok((certified, poles, reports, table))
        })?;

        let object = data::DesignData::of(&rig, &certified, &poles, table.as_ref().ok());
        print(self.json, &object, || text::design(&rig, &certified, &poles, &reports))?;
        for warning in text::warnings(&rig, &certified, &reports, table.as_ref().ok()) {
            eprintln!("warning: {warning}");
        }
        warn_of_unusual_values(&rig, &self.rig);
        refuse_failing_table(&rig, &reports)?;
        let Some(path) = path else { return Ok(()) };
        let mut table = table.map_err(|source| Failure::of_rig(name(), source))?;
        if reports.iter().any(|report| report.run.is_none()) {
            return Err(Failure::of_rig(name(), SimulationError::NoObserver));
        }
        if self.wants_motions() {
            table = add_motions(&self.rig, &rig, table, self.transitions)?;
        }
        warn_of_tick(&rig);
        let source = gains_source(&rig, &table);
        if self.check {
            return check(&path, &source);
        }
        if std::fs::read_to_string(&path).is_ok_and(|found| first_difference(&found, &source).is_none()) {
            // A new time stamp alone would make cargo compile the firmware again.
            eprintln!("{} is up to date", path.display());
            return Ok(());
        }
        write_atomically(&path, source.as_bytes())?;
        eprintln!("wrote {}", path.display());
        Ok(())
    }
}

fn report(
    rig: &Rig,
    poles: &DesignPoles,
    assessments: PerLaw<Option<Assessment>>,
    table: Option<&TableValues>,
) -> Result<Vec<LawReport>, Failure> {
    let mut reports = Vec::new();
    for (law, &assessment) in assessments.present() {
        let run = match table {
            Some(table) => {
                let scenario = Scenario::acceptance(rig, law, slowest_time_constant(rig, poles, law));
                match simulate(rig, table, &scenario) {
                    Err(SimulationError::NoObserver) => None,
                    run => Some(run?.1),
                }
            }
            None => None,
        };
        reports.push(LawReport { law, assessment, run });
    }
    Ok(reports)
}

/// Slowest time constant of the continuous closed loop (s).
fn slowest_time_constant(rig: &Rig, poles: &DesignPoles, law: Law) -> f64 {
    let poles = poles.in_table(law)[0].map(Vec::as_slice).unwrap_or_default();
    let slowest = poles.iter().map(|pole| -pole[0]).fold(f64::INFINITY, f64::min);
    if slowest > 0.0 && slowest.is_finite() { 1.0 / slowest } else { rig.tick.period_s }
}

/// Refuses a table whose gains, rounded to f32, do not stabilise the plant, or whose acceptance run falls.
fn refuse_failing_table(rig: &Rig, reports: &[LawReport]) -> Result<(), Failure> {
    for LawReport { law, assessment, run } in reports {
        if assessment.rounded >= 1.0 {
            return Err(Failure::no_solution(format!(
                "{}: {law}: rounded to f32 the gains no longer stabilise the plant (spectral radius {:.6}): tick.period_s = {} s \
                 is too long for single precision; shorten it. Nothing was written",
                rig.name, assessment.rounded, rig.tick.period_s
            )));
        }
        if let Some(fall) = run.as_ref().and_then(Summary::fall_in_words) {
            return Err(Failure::check(format!(
                "{}: {law}: {fall} in the closed loop with the new table. Nothing was written",
                rig.name
            )));
        }
    }
    Ok(())
}

/// Warns of a tick that none of the boards can make: the table would compile for another one only.
fn warn_of_tick(rig: &Rig) {
    let period_s = rig.tick.period_s;
    let period_us = period_s * 1e6;
    let is_possible =
        |[shortest, longest]: [u32; 2]| shortest as f64 <= period_us && period_us <= longest as f64;
    if !BOARDS.iter().any(|board| is_possible(board.tick_us())) {
        eprintln!(
            "warning: tick.period_s = {period_s} s: no board of `upright firmware boards` can make this tick"
        );
    }
}

/// Compares line by line: a checkout on Windows may have changed the line endings.
fn check(path: &Path, source: &str) -> Result<(), Failure> {
    let found = std::fs::read_to_string(path)
        .map_err(|error| Failure::check(format!("{}: cannot be read: {error}", path.display())))?;
    let Some(line) = first_difference(&found, source) else {
        eprintln!("{} is up to date", path.display());
        return Ok(());
    };
    let origin = match &identity_differences(&found, source)[..] {
        [] => String::new(),
        differences => format!(" ({})", differences.join("; ")),
    };
    Err(Failure::check(format!(
        "{}:{line}: differs from what `upright design` would write{origin}; run it without --check",
        path.display()
    )))
}

/// The first line, counted from 1, in which two texts differ.
fn first_difference(found: &str, wanted: &str) -> Option<usize> {
    let (mut found, mut wanted) = (found.lines(), wanted.lines());
    (1..).map(|line| (line, found.next(), wanted.next())).find_map(|lines| match lines {
        (_, None, None) => Some(None),
        (line, found, wanted) if found != wanted => Some(Some(line)),
        _ => None,
    })?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_ends_are_no_difference_and_everything_else_is() {
        assert_eq!(first_difference("a\r\nb\r\n", "a\nb\n"), None);
        assert_eq!(first_difference("a\nc\n", "a\nb\n"), Some(2));
        assert_eq!(first_difference("a\n", "a\nb\n"), Some(2));
        assert_eq!(first_difference("a\nb\n\n", "a\nb\n"), Some(3));
    }
}
