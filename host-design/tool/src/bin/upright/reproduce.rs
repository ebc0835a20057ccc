//! `upright reproduce`

use std::path::PathBuf;

use clap::Args;
use upright_design::table::write_atomically;
use upright_tool::project::checkout;
use upright_tool::reproduce::{PaperRigs, reproduce};

use crate::failure::Failure;
use crate::output::print;
use upright_tool::progress::with_progress;

/// Compares the results of the paper with ours, number by number, and writes its figures 5 to 8 and Table 2 as figures
/// and data.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright reproduce                          prints the comparison; figures, data and summary go to reproduced/
  upright reproduce --rigs ../upright/rigs --out paper      from another folder
  upright reproduce --no-write --json | jq '.designs.rows[] | select(.verdict != \"every_digit\")'")]
pub(crate) struct ReproduceCommand {
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

impl ReproduceCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rigs = PaperRigs::from_folder(&self.rigs.map_or_else(default_rigs, Ok)?)?;
        if !self.no_write {
            std::fs::create_dir_all(&self.out).map_err(|error| {
                Failure::argument(format!("--out {}: cannot be created: {error}", self.out.display()))
            })?;
        }
        let found = with_progress(|progress| reproduce(&rigs, progress))?;
        if !self.no_write {
            let mut files = found.files()?;
            let numbers = serde_json::to_vec(&found).map_err(std::io::Error::from)?;
            files.push(("numbers.json".to_owned(), numbers));
            for (name, contents) in &files {
                write_atomically(&self.out.join(name), contents)?;
            }
            eprintln!(
                "wrote summary.md, numbers.json, figures and data ({} files) to {}",
                files.len(),
                self.out.display()
            );
        }
        print(self.json, &found, || found.summary())
    }
}

fn default_rigs() -> Result<PathBuf, Failure> {
    let checkout = checkout().map_err(|error| {
        Failure::argument(format!("{error}; or name the folder of the paper's rig files with --rigs"))
    })?;
    Ok(checkout.join("rigs"))
}
