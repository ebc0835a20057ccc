//! `upright report`

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use upright_design::rig::Rig;
use upright_design::study::Study;
use upright_design::table::{TableValues, write_atomically};
use upright_plan::{Demonstration, Script, Stored, motions, with_motions};
use upright_tool::in_the_loop::RunError;
use upright_tool::report::{REGION_POINTS, Report as Page, ReportSource, report};
use upright_trust::verify::{Effort, trust};

use super::swing_up::with_margins;
use super::verify::search;
use crate::variation::{Variation, Wanted, with_stored_motions};
use upright_command::Failure;
use upright_command::print;
use upright_command::progress::{with_progress, with_spinner};

/// Writes one HTML page about a rig and its loop: animated runs, model, gains, margins, trust report.
///
/// Exit status 0 even if requirements are not met: the page lists them.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright report rigs/quadruple-paper.toml                      writes quadruple-paper.html
  upright report rigs/quadruple-paper.toml --out report.html --svg figures --csv data
  upright report rigs/single-quanser-ip02.toml --runs 1000 --png figures
  upright report rigs/single-quanser-ip02.toml --imperfections  adds which imperfections make it fall
  upright report rigs/single-quanser-ip02.toml --margins        adds how hard it may be pushed while it is raised
  upright report rigs/double-quanser-dbpen.toml --transitions   adds a run from equilibrium to equilibrium
  upright report rigs/quadruple-paper.toml --gains continuous --tick 0.005     effect of a wrong tick")]
pub(crate) struct ReportCommand {
    #[command(flatten)]
    variation: Variation,
    /// Write the page here [default: the rig file's name with .html, in the current folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write each figure as SVG into this folder
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
    /// Write each figure as PNG into this folder
    #[arg(long, value_name = "DIR")]
    png: Option<PathBuf>,
    /// Write every curve of each figure as CSV into this folder
    #[arg(long, value_name = "DIR")]
    csv: Option<PathBuf>,
    /// Random plants for each law in the trust report
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    runs: u32,
    /// Seed of the disturbances and of the first random plant
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Add the size of each imperfection at which the loop falls, and two figures about it; slower
    #[arg(long)]
    imperfections: bool,
    /// Add how hard each link may be pushed while the stored motions raise and lower the rig; slower
    #[arg(long)]
    margins: bool,
    /// Add a run through all stored motions between equilibria
    #[arg(long)]
    transitions: bool,
    /// Print the names of the files and the trust report as one JSON object
    #[arg(long)]
    json: bool,
}

impl ReportCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        self.prepare()?;
        let (rig, certified, table) = self.variation.designed()?;
        let imperfections = if self.imperfections { search(&rig, &table)? } else { Vec::new() };
        let motions = with_swing_up(&self.variation.rig, &rig, &table);
        let pushes = match &motions {
            Some(table) if self.margins => with_margins(&rig, table)?,
            None if self.margins => {
                let text =
                    "--margins needs motions that are stored for this rig: make them with upright swing-up";
                return Err(Failure::argument(text.to_owned()));
            }
            _ => Vec::new(),
        };
        let route =
            if self.transitions { Some(route(&self.variation.rig, &rig, &table, self.seed)?) } else { None };
        let study = Study::whole();
        let effort = Effort { runs: self.runs as usize, seed: self.seed, late: 0.0, study: &study };
        let (trust, files) = with_progress(|progress| -> Result<_, Failure> {
            let trust = trust(&rig, &certified, &table, effort, progress)?;
            let run = motions.as_ref().and_then(|table| demonstration(&rig, table, self.seed));
            let source = ReportSource {
                rig: &rig,
                certified: &certified,
                table: &table,
                trust: &trust,
                imperfections: &imperfections,
                seed: self.seed,
                swing_up: run.as_ref(),
                route: route.as_ref(),
                margins: &pushes,
                region_points: REGION_POINTS,
                command: &self.as_typed(),
            };
            let page = report(&source, progress)?;
            let files = self.write(&page)?;
            Ok((trust, files))
        })?;
        let object = json!({ "rig": rig.name, "hash": format!("{:016x}", rig.hash()), "files": files, "trust": trust });
        print(self.json, &object, || files.iter().map(|file| format!("{}\n", file.display())).collect())?;
        let failed = trust.checks.iter().filter(|check| !check.holds).count();
        if failed > 0 {
            eprintln!(
                "{failed} of {} requirements are not met: see the page, or upright verify",
                trust.checks.len()
            );
        }
        Ok(())
    }

    /// Creates the folders first, so that an unwritable path is reported before the long computation.
    fn prepare(&self) -> Result<(), Failure> {
        for folder in [&self.svg, &self.png, &self.csv].into_iter().flatten() {
            std::fs::create_dir_all(folder).map_err(|error| {
                Failure::argument(format!("{}: the folder cannot be created: {error}", folder.display()))
            })?;
        }
        let parent =
            self.out.as_deref().and_then(Path::parent).filter(|parent| !parent.as_os_str().is_empty());
        match parent {
            Some(parent) if !parent.is_dir() => Err(Failure::argument(format!(
                "{}: there is no such folder: create it, or give another --out",
                parent.display()
            ))),
            _ => Ok(()),
        }
    }

    /// Writes the pictures first and the page last, so that a page that exists is complete.
    fn write(&self, page: &Page) -> Result<Vec<PathBuf>, Failure> {
        let mut files = Vec::new();
        for picture in &page.pictures {
            let name = &picture.name;
            if let Some(folder) = &self.svg {
                files.push(write_into(folder, &format!("{name}.svg"), picture.svg.as_bytes())?);
            }
            if let Some(folder) = &self.png {
                files.push(write_into(folder, &format!("{name}.png"), &picture.png()?)?);
            }
            if let (Some(folder), Some(csv)) = (&self.csv, &picture.csv) {
                files.push(write_into(folder, &format!("{name}.csv"), csv.as_bytes())?);
            }
        }
        let path = self.out.clone().unwrap_or_else(|| default_page(&self.variation.rig));
        write_atomically(&path, page.html.as_bytes())?;
        files.push(path);
        Ok(files)
    }

    /// The command line that makes the same page, without its output paths, which do not matter.
    fn as_typed(&self) -> String {
        let mut typed = format!("upright report {}", self.variation.as_typed());
        if self.runs != 200 {
            typed.push_str(&format!(" --runs {}", self.runs));
        }
        if self.seed != 1 {
            typed.push_str(&format!(" --seed {}", self.seed));
        }
        if self.imperfections {
            typed.push_str(" --imperfections");
        }
        if self.margins {
            typed.push_str(" --margins");
        }
        if self.transitions {
            typed.push_str(" --transitions");
        }
        typed
    }
}

/// The table with the stored motions; `None` if there are none, or if they were made for other values of the rig.
fn with_swing_up(file: &Path, rig: &Rig, table: &TableValues) -> Option<TableValues> {
    let stored = Stored::beside(file).ok()?;
    with_motions(rig, table.clone(), &motions(rig, &stored).ok()?, &[]).ok()
}

/// A simulated run of the motions of `table`; `None` if it has none or the run fails.
fn demonstration(rig: &Rig, table: &TableValues, seed: u64) -> Option<Demonstration> {
    Script::draw(rig, table, seed, false).ok()?.run(table).ok()
}

/// A simulated run through all motions that are stored beside the rig file.
fn route(file: &Path, rig: &Rig, table: &TableValues, seed: u64) -> Result<Demonstration, Failure> {
    let table = with_stored_motions(file, rig, table.clone(), Wanted::Transitions)?;
    let script = Script::route(rig, &table, seed).map_err(|source| Failure::of_rig(&rig.name, source))?;
    Ok(with_spinner("the route", || script.run(&table)).map_err(RunError::from)?)
}

fn write_into(folder: &Path, name: &str, contents: &[u8]) -> Result<PathBuf, Failure> {
    let path = folder.join(name);
    write_atomically(&path, contents)?;
    Ok(path)
}

fn default_page(rig: &Path) -> PathBuf {
    PathBuf::from(rig.file_name().unwrap_or(rig.as_os_str())).with_extension("html")
}
