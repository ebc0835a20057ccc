//! `upright identify --coverage`

use std::path::Path;

use clap::{Args, ValueEnum};
use serde_json::json;
use upright_design::rig::{CartOnly, Rig};
use upright_design::study::Study;
use upright_identify::{Coverage, Drawn, TrueFriction, coverage};

use crate::split::Split;
use crate::variation::not_negative;
use upright_command::Failure;
use upright_command::print;
use upright_command::progress::with_bar;

/// What `--coverage` takes.
#[derive(Args)]
pub(super) struct CoverageOptions {
    /// Read no file: shake and identify simulated machines that differ from the rig file, and count how many 95 %
    /// intervals cover the true values. Masses, lengths and inertias are drawn within --off of the file, friction
    /// within a factor of 3 of what is usual; air drag, zeros, tilt, latency, dead zone, travel per count and errors
    /// of absolute sensors are drawn, too
    #[arg(long, conflicts_with_all = ["logs", "predict", "write", "eccentricity", "weigh", "trust_numbers",
        "without_drag", "without_dry", "report", "csv", "mcap"])]
    pub(super) coverage: bool,
    /// Number of machines
    #[arg(long, requires = "coverage", default_value_t = 40, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    runs: u32,
    /// Largest error of the file's masses, lengths and inertias (%)
    #[arg(long, requires = "coverage", default_value_t = 10.0, value_name = "PERCENT", value_parser = below_90)]
    off: f64,
    /// Duration of each log (s)
    #[arg(long, requires = "coverage", default_value_t = 20, value_name = "S", value_parser = clap::value_parser!(u16).range(5..=3600))]
    seconds: u16,
    /// Seed of the machines
    #[arg(long, requires = "coverage", default_value_t = 1)]
    seed: u64,
    /// Law of the machines' dry friction; the true value is that at high speed
    #[arg(long, requires = "coverage", value_enum, default_value_t, value_name = "LAW")]
    friction: Friction,
    #[command(flatten)]
    pub(super) split: Split,
}

/// Law of the machines' dry friction.
#[derive(Clone, Copy, Default, ValueEnum)]
enum Friction {
    /// An elasto-plastic bristle, as [reality] has it
    #[default]
    File,
    /// The same, 20 to 60 % larger at rest
    Stribeck,
    /// Without sticking: Coulomb friction times the tanh of the speed
    Tanh,
    /// Dahl's bristle
    Dahl,
    /// Dahl's bristle, 20 to 60 % larger at rest
    Lugre,
}

impl From<Friction> for TrueFriction {
    fn from(friction: Friction) -> Self {
        match friction {
            Friction::File => TrueFriction::OfFile,
            Friction::Stribeck => TrueFriction::Stribeck,
            Friction::Tanh => TrueFriction::Tanh,
            Friction::Dahl => TrueFriction::Dahl,
            Friction::Lugre => TrueFriction::LuGre,
        }
    }
}

fn below_90(text: &str) -> Result<f64, String> {
    not_negative(text).and_then(|value| {
        if value < 90.0 { Ok(value) } else { Err("give a number from 0 to below 90 (%)".to_owned()) }
    })
}

impl CoverageOptions {
    pub(super) fn run(&self, path: &Path, trust_wiring: bool, json: bool) -> Result<(), Failure> {
        let rig = Rig::from_path(path)?;
        rig.needs_cart(CartOnly::Identification, path)?;
        let drawn = Drawn {
            runs: u64::from(self.runs),
            off_percent: self.off,
            seconds: f64::from(self.seconds),
            friction: self.friction.into(),
            seed: self.seed,
            trust_wiring,
        };
        let friction = self.friction.to_possible_value().map(|value| value.get_name().to_owned());
        let options = json!({
            "runs": self.runs, "off": self.off, "seconds": self.seconds, "seed": self.seed,
            "trust_wiring": trust_wiring, "friction": friction,
        });
        let work = |study: &Study| -> Result<Coverage, Failure> {
            Ok(with_bar("machines", drawn.runs, |done| coverage(&rig, &drawn, study, done))?)
        };
        self.split.study("identify --coverage", &rig, &options, work, |found| self.print(&rig, &found, json))
    }

    fn print(&self, rig: &Rig, found: &Coverage, json: bool) -> Result<(), Failure> {
        let object = json!({ "rig": rig.name, "off_percent": self.off, "coverage": found });
        print(json, &object, || text(found))
    }
}

fn text(found: &Coverage) -> String {
    let mut text = format!(
        "{:28}{:>8}{:>9}{:>9}{:>11}{:>11}{:>11}\n",
        "", "numbers", "covered", "worst/σ", "stated", "rms", "worst"
    );
    for row in &found.rows {
        let share = |covered: usize| format!("{:.0} %", 100.0 * covered as f64 / row.count as f64);
        let covered = row.covered.map_or("-".to_owned(), share);
        let stated = row.stated.map_or("-".to_owned(), |stated| format!("{stated:.3}"));
        let furthest = row.furthest.map_or("-".to_owned(), |furthest| format!("{furthest:.1}"));
        text += &format!(
            "{:28}{:>8}{covered:>9}{furthest:>9}{stated:>11}{:>11.3}{:>11.3} {}\n",
            row.name, row.count, row.rms, row.worst, row.unit
        );
    }
    for (machines, what) in [(&found.refused, "refused"), (&found.doubted, "doubted")] {
        text += &format!("{} of {} machines are {what}\n", machines.len(), found.machines);
        text.extend(machines.iter().map(|(number, reason)| format!("{number}: {reason}\n")));
    }
    text
}
