//! `upright verify`

use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use upright::table::Law;
use upright_design::rig::{Imperfection, Rig};
use upright_design::simulate::simulate;
use upright_design::study::Study;
use upright_design::table::{TableValues, write_atomically};
use upright_trust::verify::{
    Effort, Horizon, ImperfectionSettings, Imperfections, MapAxis, TrustReport, attraction_map, monte_carlo,
    sample, spread, trust,
};

use crate::split::Split;
use crate::variation::{Variation, law_option};
use upright_command::Failure;
use upright_command::print;
use upright_command::progress::{with_bar, with_progress, with_spinner};

mod imperfections;
mod text;

/// Verifies the loop before a motor is connected: margins, region of attraction, noise, mass errors, random plants.
///
/// Exit status 1 if a requirement of the rig file's [verify] is not met.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright verify rigs/single-quanser-ip02.toml
  upright verify rigs/quadruple-paper.toml --runs 1000 --seed 1 --json
  upright verify rigs/quadruple-paper.toml --replay 17 --law lqr --csv worst.csv   the random plant of seed 17
  upright verify rigs/single-quanser-ip02.toml --map tilt.csv       from which angle and rate of link 1 it recovers
  upright verify rigs/quadruple-paper.toml --imperfections          which friction, play or wrong zero makes it fall
  upright verify rigs/quadruple-paper.toml --gains continuous --tick 0.003         unstable: exit status 1")]
pub(crate) struct VerifyCommand {
    #[command(flatten)]
    variation: Variation,
    /// Monte Carlo runs for each law; fewer than 73 cannot show 95 % even if all survive
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    runs: u32,
    /// Seed of the first run; each following run has the next one
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only this law
    #[arg(long, value_parser = law_option())]
    law: Option<Law>,
    /// Instead of the report, repeat the Monte Carlo run of this seed
    #[arg(long, value_name = "SEED", requires = "law", conflicts_with_all = ["shard", "merge"])]
    replay: Option<u64>,
    /// With --replay: write every tick as CSV
    #[arg(long, value_name = "FILE", requires = "replay")]
    csv: Option<PathBuf>,
    /// Instead of the report, write a map of the initial states from which the loop recovers, as CSV
    #[arg(long, value_name = "FILE", conflicts_with_all = ["replay", "shard", "merge"])]
    map: Option<PathBuf>,
    /// Instead of the report, find the size of each imperfection of the machine at which the loop falls
    #[arg(long, conflicts_with_all = ["replay", "map", "shard", "merge"])]
    imperfections: bool,
    /// With --map: two states and their ranges, as index:from:to (SI; state order x, xdot, theta1, theta1dot …)
    #[arg(long, value_name = "S:A:B", num_args = 2, value_delimiter = ',', requires = "map", 
          value_parser = axis, default_values = ["2:-0.5:0.5", "3:-4:4"])]
    axes: Vec<MapAxis>,
    /// Share of the random plants with one more tick of delay than designed for (0 to 1)
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    late: f64,
    #[command(flatten)]
    split: Split,
    /// Print the report as one JSON object
    #[arg(long)]
    json: bool,
}

/// Initial values along each axis of a map.
const POINTS: usize = 41;

fn axis(text: &str) -> Result<MapAxis, String> {
    let accepted = || "give index:from:to, such as 2:-0.5:0.5".to_owned();
    let mut parts = text.split(':');
    let mut next = || parts.next().ok_or_else(accepted);
    let state = next()?.parse().map_err(|_| accepted())?;
    let from: f64 = next()?.parse().map_err(|_| accepted())?;
    let to: f64 = next()?.parse().map_err(|_| accepted())?;
    if !(from.is_finite() && to.is_finite() && from < to) {
        return Err("give a range from a smaller to a larger finite number".to_owned());
    }
    Ok(MapAxis { state, range: [from, to], points: POINTS })
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("give a number from 0 to 1".to_owned()),
    }
}

/// Finds the size of each imperfection at which each law falls, with a progress bar.
pub(crate) fn search(rig: &Rig, table: &TableValues) -> Result<Vec<Imperfections>, Failure> {
    let laws: Vec<Law> = table.laws.present().map(|(law, _)| law).collect();
    let settings = ImperfectionSettings::of(rig);
    Ok(with_bar("imperfections", (laws.len() * Imperfection::all_of(rig).len()) as u64, |done| {
        let search = |&law: &Law| upright_trust::verify::imperfections(rig, table, law, &settings, done);
        laws.iter().map(search).collect::<Result<_, _>>()
    })?)
}

/// Runs only the random plants of each law: the part of the report that --shard splits.
fn random_plants(
    rig: &Rig,
    table: &TableValues,
    effort: &Effort<'_>,
    done: &(dyn Fn() + Sync),
) -> Result<(), Failure> {
    for (law, _) in table.laws.present() {
        monte_carlo(rig, table, law, &spread(rig, effort.late), effort, done)?;
    }
    Ok(())
}

impl VerifyCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let (rig, certified, mut table) = self.variation.designed()?;
        for other in Law::ALL.into_iter().filter(|law| self.law.is_some_and(|only| only != *law)) {
            table.laws[other] = None;
        }
        if table.laws.present().next().is_none() {
            return Err(Failure::argument(
                "--law: the rig file does not ask for this control law".to_owned(),
            ));
        }
        if let (Some(seed), Some(law)) = (self.replay, self.law) {
            return self.replay(&rig, &table, law, seed);
        }
        if let Some(path) = &self.map {
            return self.map(&rig, &table, path);
        }
        if self.imperfections {
            return self.imperfections(&rig, &table);
        }
        let law = self.law.map(Law::key);
        let options = json!({
            "gains": self.variation.changes(), "seed": self.seed, "runs": self.runs, "law": law, "late": self.late,
        });
        let work = |study: &Study| -> Result<_, Failure> {
            let effort = Effort { runs: self.runs as usize, seed: self.seed, late: self.late, study };
            let runs = table.laws.present().count() as u64 * u64::from(self.runs);
            // A shard runs the random plants only.
            if study.is_shard() {
                with_bar("random plants", runs, |done| random_plants(&rig, &table, &effort, done))?;
                return Ok(None);
            }
            let report = with_progress(|progress| trust(&rig, &certified, &table, effort, progress));
            Ok(Some(report?))
        };
        self.split.study("verify", &rig, &options, work, |report| {
            report.map_or(Ok(()), |report| self.print(&rig, &report))
        })
    }

    /// The arguments that a replay has to repeat.
    fn as_typed(&self) -> String {
        let late = if self.late == 0.0 { String::new() } else { format!(" --late {}", self.late) };
        self.variation.as_typed() + &late
    }

    fn print(&self, rig: &Rig, report: &TrustReport) -> Result<(), Failure> {
        print(self.json, report, || text::report(rig, report, &self.as_typed()))?;
        let failed = report.failed();
        if failed.is_empty() {
            return Ok(());
        }
        Err(Failure::check(format!("{}: not met: {}", rig.name, failed.join("; "))))
    }

    fn imperfections(&self, rig: &Rig, table: &TableValues) -> Result<(), Failure> {
        let found = search(rig, table)?;
        let text = || {
            found.iter().map(|found| imperfections::table(found, rig.base())).collect::<Vec<_>>().join("\n")
        };
        print(self.json, &found, text)
    }

    fn replay(&self, rig: &Rig, table: &TableValues, law: Law, seed: u64) -> Result<(), Failure> {
        let (plant, scenario) = sample(rig, law, &spread(rig, self.late), seed);
        let (trace, summary) = with_spinner("simulating", || simulate(&plant, table, &scenario))?;
        if let Some(path) = &self.csv {
            let mut bytes = Vec::new();
            trace.write_csv(&mut bytes)?;
            write_atomically(path, &bytes)?;
        }
        print(self.json, &summary, || format!("{}\n{summary}\n", plant.describe()))?;
        match summary.fall_in_words() {
            Some(fall) => Err(Failure::check(format!("{}, seed {seed}: {fall}", rig.name))),
            None => Ok(()),
        }
    }

    /// Writes one CSV row per initial state: both states and the settling time, empty if it does not recover.
    fn map(&self, rig: &Rig, table: &TableValues, path: &std::path::Path) -> Result<(), Failure> {
        let law = table.laws.present().next().map_or(Law::Lqr, |(law, _)| law);
        let &[across, down] = self.axes.as_slice() else {
            return Err(Failure::argument("--axes: give two".to_owned()));
        };
        let axes = [across, down];
        if axes.iter().any(|axis| axis.state >= rig.states()) || across.state == down.state {
            return Err(Failure::argument(format!(
                "--axes: give two different states from 0 to {}",
                rig.states() - 1
            )));
        }
        let map = with_bar("initial states", (POINTS * POINTS) as u64, |done| {
            attraction_map(rig, table, law, axes, &Horizon::default(), done)
        })?;
        let [columns, rows] = axes.map(|axis| {
            let step = (axis.range[1] - axis.range[0]) / (axis.points - 1) as f64;
            (0..axis.points).map(|i| axis.range[0] + step * i as f64).collect::<Vec<f64>>()
        });
        let mut csv = format!("state{},state{},settled_s\n", across.state, down.state);
        for (second, row) in rows.iter().zip(&map.settled_s) {
            for (first, settled) in columns.iter().zip(row) {
                let settled = settled.map_or(String::new(), |time| time.to_string());
                csv.push_str(&format!("{first:.6},{second:.6},{settled}\n"));
            }
        }
        write_atomically(path, csv.as_bytes())?;
        let recovered = map.settled_s.iter().flatten().flatten().count();
        println!(
            "recovers from {recovered} of {} initial states; written to {}",
            POINTS * POINTS,
            path.display()
        );
        Ok(())
    }
}
