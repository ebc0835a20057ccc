//! `upright identify`

mod coverage;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use upright_design::rig::{CartOnly, Rig};
use upright_design::table::write_atomically;
use upright_identify::{Identification, Log, Recordings, Settings, identify_recordings, rig_file};
use upright_tool::identified::{json, page, text};

use coverage::CoverageOptions;

use crate::reading::ReadingArgs;
use crate::variation::positive;
use upright_command::Failure;
use upright_command::progress::with_progress;

/// Identifies the parameters of the real machine from logs of the hanging machine being shaken, or from tables of its
/// motion.
///
/// Files that are no logs of Upright are read as tables (CSV): a row of names such as time_s,angle_1_rad, and rows of
/// numbers. Several files are pieces of one machine, each with an unknown start. Without a drive, the links swing
/// freely; --clamped says that the cart cannot move.
///
/// First the wiring, then masses, lengths, moments, frictions, delay, dead zone and zeros, each with its standard
/// deviation. Exit status 2 if a log cannot be read or is of another rig; 3 if the model does not fit or the numbers
/// are doubted, and then no rig file is written.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright shake rigs/quadruple-paper.toml --log run.log      the log of a simulated machine
  upright identify rigs/quadruple-paper.toml run.log
  upright identify rigs/quadruple-paper.toml run.log --write new.toml
  upright identify rigs/quadruple-paper.toml run.log --report run.html     fits, residuals, spectra, correlations
  upright identify rigs/quadruple-paper.toml run.log --json | jq .estimates
  upright identify my-rig.toml swing-*.csv --clamped --angles absolute --zero upright --predict other-*.csv
  upright identify rigs/quadruple-paper.toml run.log --csv run.csv      only converts
  upright identify rigs/quadruple-paper.toml run.log --mcap run.mcap    for Foxglove and PlotJuggler
  upright identify rigs/quadruple-paper.toml --coverage --off 30        how well it identifies simulated machines")]
pub(crate) struct IdentifyCommand {
    /// Rig file that the firmware was designed for
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Logs or tables of this machine, all recorded after the same homing
    #[arg(value_name = "FILE", required_unless_present = "coverage")]
    logs: Vec<PathBuf>,
    /// Other recordings, which are only predicted, with the old and the new numbers, over 0.5, 1 and 2 s
    #[arg(long, value_name = "FILE", num_args = 1..)]
    predict: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    /// Write the rig file with the identified numbers, if they fit
    #[arg(long, value_name = "NEW.toml")]
    write: Option<PathBuf>,
    /// Also identify the eccentricity of the joints' encoders
    #[arg(long)]
    eccentricity: bool,
    /// Weighed first moment of the last link (kg·m): its tip on a scale, the link level, reading times distance
    #[arg(long, value_name = "KG_M", value_parser = positive)]
    weigh: Option<f64>,
    /// Take the wiring from the file instead of identifying it
    #[arg(long)]
    trust_wiring: bool,
    /// Write numbers that are doubted, too
    #[arg(long)]
    trust_numbers: bool,
    /// Leave the air drag of the links out, of free swings
    #[arg(long)]
    without_drag: bool,
    /// Leave the dry friction of the joints out, of free swings
    #[arg(long)]
    without_dry: bool,
    /// Write a page with the fits, residuals, spectra and correlations, even if the numbers do not fit
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
    /// Only write the log as CSV, to a file, or to stdout with `-`
    #[arg(long, value_name = "FILE", conflicts_with_all = ["write", "report", "json", "eccentricity", "weigh", "trust_wiring"])]
    csv: Option<PathBuf>,
    /// Only write the log as MCAP, to a file, or to stdout with `-`
    #[arg(long, value_name = "FILE", conflicts_with_all = ["csv", "write", "report", "json", "eccentricity", "weigh", "trust_wiring"])]
    mcap: Option<PathBuf>,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Simulated machines")]
    coverage: CoverageOptions,
}

impl IdentifyCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if self.coverage.coverage {
            return self.coverage.run(&self.rig, self.trust_wiring, self.json);
        }
        if self.coverage.split.is_used() {
            return Err(Failure::argument("--shard and --merge: only with --coverage, which has many runs"));
        }
        let rig = Rig::from_path(&self.rig)?;
        rig.needs_cart(CartOnly::Identification, &self.rig)?;
        let recordings = Recordings::from_paths(&rig, &self.logs, &self.reading.reading())?;
        if let Some(path) = &self.csv {
            return convert(&rig, &recordings, path, |log, steps, out| log.write_csv(steps, out));
        }
        if let Some(path) = &self.mcap {
            return convert(&rig, &recordings, path, |log, steps, out| log.write_mcap(steps, out));
        }
        let unused = (!self.predict.is_empty())
            .then(|| Recordings::from_paths(&rig, &self.predict, &self.reading.reading()))
            .transpose()?;
        let settings = Settings {
            eccentricity: self.eccentricity,
            weighed_kg_m: self.weigh,
            trust_wiring: self.trust_wiring,
            trust_numbers: self.trust_numbers,
            without_drag: self.without_drag,
            without_dry: self.without_dry,
        };
        let old = std::fs::read_to_string(&self.rig)?;
        let found = with_progress(|progress| {
            identify_recordings(&rig, Some(&old), &recordings, unused.as_ref(), &settings, progress)
        })?;
        let mut out = std::io::stdout().lock();
        if self.json {
            writeln!(out, "{}", json(&rig.name, &found))?;
        } else {
            write!(out, "{}", text(&rig.name, &found, &settings))?;
        }
        if let Some(path) = &self.report {
            let page = page(&rig.name, &found, &settings, &self.as_typed())?;
            write_atomically(path, page.as_bytes())?;
            eprintln!("{} written", path.display());
        }
        if let Some(refusal) = &found.refusal {
            return Err(Failure::no_solution(format!("{}: {refusal}; nothing is written", rig.name)));
        }
        if let (Some(doubt), false) = (found.doubted(), self.trust_numbers) {
            let words = "nothing is written; --trust-numbers writes it nevertheless";
            return Err(Failure::no_solution(format!("{}: {doubt} {words}", rig.name)));
        }
        match &self.write {
            Some(path) => self.write_rig(path, &rig, &old, &found),
            None => Ok(()),
        }
    }

    /// The command line that makes the same page.
    fn as_typed(&self) -> String {
        let logs: Vec<String> = self.logs.iter().map(|log| log.display().to_string()).collect();
        let mut typed = format!("upright identify {} {}", self.rig.display(), logs.join(" "));
        if !self.predict.is_empty() {
            let unused: Vec<String> = self.predict.iter().map(|file| file.display().to_string()).collect();
            typed.push_str(&format!(" --predict {}", unused.join(" ")));
        }
        typed.push_str(&self.reading.as_typed());
        if self.eccentricity {
            typed.push_str(" --eccentricity");
        }
        if let Some(weighed) = self.weigh {
            typed.push_str(&format!(" --weigh {weighed}"));
        }
        if self.trust_wiring {
            typed.push_str(" --trust-wiring");
        }
        if self.trust_numbers {
            typed.push_str(" --trust-numbers");
        }
        if self.without_drag {
            typed.push_str(" --without-drag");
        }
        if self.without_dry {
            typed.push_str(" --without-dry");
        }
        typed
    }

    fn write_rig(&self, path: &Path, rig: &Rig, old: &str, found: &Identification) -> Result<(), Failure> {
        let names: Vec<String> = self.logs.iter().map(|log| log.display().to_string()).collect();
        let note = format!(
            "{} with the numbers that `upright identify` found from {:.0} s of {}.",
            self.rig.display(),
            found.seconds,
            names.join(", ")
        );
        let text = rig_file(old, rig, found, &note.replace(['\n', '\r'], " "), path)
            .map_err(|error| Failure::argument(format!("{}: {error}", self.rig.display())))?;
        write_atomically(path, text.as_bytes())?;
        eprintln!("{} written", path.display());
        Ok(())
    }
}

/// Writes one log in another format.
fn convert(
    rig: &Rig,
    recordings: &Recordings,
    path: &Path,
    write: impl Fn(&Log, &[f64], &mut dyn Write) -> std::io::Result<()>,
) -> Result<(), Failure> {
    let Recordings::Logs(logs) = recordings else {
        return Err(Failure::argument("--csv and --mcap convert logs of Upright".to_owned()));
    };
    let [(file, log)] = logs.as_slice() else {
        return Err(Failure::argument("--csv and --mcap convert one log; name one".to_owned()));
    };
    let steps: Vec<f64> = rig.sensors().iter().map(|sensor| sensor.step()).collect();
    if steps.len() != log.channels() {
        return Err(Failure::argument(format!(
            "{}: {} encoders, the rig file has {}; name the rig file of this machine",
            file.display(),
            log.channels(),
            steps.len()
        )));
    }
    let mut bytes = Vec::new();
    write(log, &steps, &mut bytes)?;
    if path.as_os_str() == "-" {
        std::io::stdout().lock().write_all(&bytes)?;
    } else {
        write_atomically(path, &bytes)?;
    }
    Ok(())
}
