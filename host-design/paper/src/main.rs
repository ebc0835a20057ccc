//! Compares the results of the paper with ours, and writes its figures 5 to 8 and Table 2 as figures and data.

use std::error::Error;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use upright_command::progress::with_progress;
use upright_command::project::checkout;
use upright_design::design::DesignError;
use upright_design::table::write_atomically;
use upright_paper::{PaperRigs, ReproduceError, reproduce};

/// Compares the results of the paper with ours, number by number, and writes its figures 5 to 8 and Table 2 as figures
/// and data.
#[derive(Parser)]
#[command(
    name = "upright-paper",
    version,
    before_help = "\
Examples:
  cargo paper                          prints the comparison; figures, data and summary go to reproduced/
  cargo paper --rigs ../upright/rigs --out paper      from another folder
  cargo paper --no-write --json | jq '.designs.rows[] | select(.verdict != \"every_digit\")'

Exit status:
  0  done
  2  bad input: a rig file, an argument, a file that cannot be written
  3  a design problem has no solution"
)]
struct PaperCommand {
    /// Folder of quadruple-paper.toml and quadruple-paper-printed.toml [default: rigs of the checkout]
    #[arg(long, value_name = "DIR")]
    rigs: Option<PathBuf>,
    /// Folder for summary.md, all numbers (numbers.json), and all figures (SVG) and their data (CSV)
    #[arg(long, value_name = "DIR", default_value = "reproduced")]
    out: PathBuf,
    /// Write nothing
    #[arg(long, conflicts_with = "out")]
    no_write: bool,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    let Err(error) = run(PaperCommand::parse()) else { return ExitCode::SUCCESS };
    eprintln!("upright-paper: {error}");
    let is_without_solution = matches!(error.downcast_ref(), Some(ReproduceError::Design(_)))
        || error.downcast_ref::<DesignError>().is_some();
    ExitCode::from(if is_without_solution { 3 } else { 2 })
}

fn run(command: PaperCommand) -> Result<(), Box<dyn Error>> {
    let folder = command.rigs.map_or_else(default_rigs, Ok)?;
    let rigs = PaperRigs::from_folder(&folder)?;
    if !command.no_write {
        std::fs::create_dir_all(&command.out)
            .map_err(|error| format!("--out {}: cannot be created: {error}", command.out.display()))?;
    }
    let found = with_progress(|progress| reproduce(&rigs, progress))?;
    if !command.no_write {
        let mut files = found.files()?;
        files.push(("numbers.json".to_owned(), serde_json::to_vec(&found)?));
        for (name, contents) in &files {
            write_atomically(&command.out.join(name), contents)?;
        }
        eprintln!(
            "wrote summary.md, numbers.json, figures and data ({} files) to {}",
            files.len(),
            command.out.display()
        );
    }
    let text = if command.json { serde_json::to_string(&found)? + "\n" } else { found.summary() };
    Ok(std::io::stdout().lock().write_all(text.as_bytes())?)
}

fn default_rigs() -> Result<PathBuf, Box<dyn Error>> {
    let checkout = checkout()
        .map_err(|error| format!("{error}; or name the folder of the paper's rig files with --rigs"))?;
    Ok(checkout.join("rigs"))
}
