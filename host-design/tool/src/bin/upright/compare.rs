//! `upright compare`

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use upright::table::Law;
use upright_design::rig::Rig;
use upright_design::table::write_atomically;
use upright_tool::compare::{
    ComparedConditions, ComparedRig, Sweep, compare, csv, figure, jobs, notes, table,
};

use crate::variation::{finite, law_option, positive};
use upright_command::Failure;
use upright_command::print;
use upright_command::progress::with_bar;

/// Compares designs: several rigs, or one key of a rig file swept over a range.
///
/// A design that falls or does not exist gets a row, too; the exit status is 0.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright compare rigs/single-quanser-ip02.toml rigs/double-quanser-dbpen.toml
  upright compare rigs/quadruple-paper.toml --sweep tick.period_s=0.0005..0.02:9:log
  upright compare rigs/quadruple-paper.toml --sweep pole_placement.settling_time_s=3..9 \\
      --law pole-placement --full-state --step 1 --raw-step --duration 6.5     (Table 2 of the paper)
  upright compare my.toml --sweep lqr.force_weight=0.01..10:13:log --svg weight.svg --csv weight.csv
  upright compare my.toml --sweep 'link[1].mass_kg=0.1..0.3' --json")]
pub(crate) struct CompareCommand {
    /// Rig files (TOML)
    #[arg(required = true, value_name = "RIG")]
    rigs: Vec<PathBuf>,
    /// Key of the rig files and its range of values; 7 values if POINTS is left out
    #[arg(long, value_name = "KEY=FROM..TO[:POINTS][:log]")]
    sweep: Option<Sweep>,
    /// Only this law
    #[arg(long, value_parser = law_option())]
    law: Option<Law>,
    /// Step of the set-point (m)
    #[arg(long, default_value_t = 0.1, value_name = "M", value_parser = finite)]
    step: f64,
    /// Duration of each run (s)
    #[arg(long, default_value_t = 10.0, value_name = "S", value_parser = positive)]
    duration: f64,
    /// Give the controller the whole state instead of encoder counts
    #[arg(long)]
    full_state: bool,
    /// Apply the set-point as a step, without the governor
    #[arg(long)]
    raw_step: bool,
    /// Use the gains designed in continuous time instead of those designed for the tick
    #[arg(long)]
    continuous_gains: bool,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
    /// Write the table as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the figure as SVG: results over the swept key, or the runs without a sweep
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write the figure as PNG
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
}

impl CompareCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rigs: Vec<Rig> = self.rigs.iter().map(|path| Rig::from_path(path)).collect::<Result<_, _>>()?;
        let mut candidates = Vec::new();
        for (path, rig) in self.rigs.iter().zip(&rigs) {
            let is_copy = rigs.iter().filter(|other| other.name == rig.name).count() > 1;
            let label = if is_copy { path.display().to_string() } else { rig.name.clone() };
            candidates.extend(self.candidates(path, rig, &label)?);
        }
        let conditions = ComparedConditions {
            step_m: self.step,
            duration_s: self.duration,
            full_state: self.full_state,
            raw_step: self.raw_step,
            continuous_gains: self.continuous_gains,
            law: self.law,
        };
        let rows = jobs(&candidates, &conditions).len();
        if rows == 0 {
            return Err(Failure::argument(
                "no rig asks for such a control law: add [lqr] or [pole_placement], or leave out --law"
                    .to_owned(),
            ));
        }
        let rows = with_bar("designs", rows as u64, |done| compare(&candidates, &conditions, done))?;

        let key = self.sweep.as_ref().map(|sweep| sweep.key.as_str());
        if let Some(path) = &self.csv {
            write_atomically(path, &csv(&rows, key)?)?;
        }
        if self.svg.is_some() || self.png.is_some() {
            let figure = figure(&rows, &candidates, self.sweep.as_ref());
            if let Some(path) = &self.svg {
                write_atomically(path, figure.svg()?.as_bytes())?;
            }
            if let Some(path) = &self.png {
                write_atomically(path, &figure.png(2.0)?)?;
            }
        }
        let notes = || notes(&rows, key).iter().map(|note| format!("{note}\n")).collect::<String>();
        let object = json!({ "key": key, "conditions": conditions, "rows": rows });
        print(self.json, &object, || table(&rows, key) + &notes())
    }

    /// The rig of a file, or one rig for each value of the sweep.
    fn candidates(&self, path: &Path, rig: &Rig, label: &str) -> Result<Vec<ComparedRig>, Failure> {
        let named = |rig, value| ComparedRig { label: label.to_owned(), rig, value };
        let Some(sweep) = &self.sweep else { return Ok(vec![named(rig.clone(), None)]) };
        let text = std::fs::read_to_string(path).map_err(|error| {
            Failure::argument(format!("{}: cannot be read again for --sweep: {error}", path.display()))
        })?;
        let candidate = |&value: &f64| sweep.rig(&text, path, value).map(|rig| named(rig, Some(value)));
        Ok(sweep.values.iter().map(candidate).collect::<Result<_, _>>()?)
    }
}
