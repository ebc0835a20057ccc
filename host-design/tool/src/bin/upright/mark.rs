//! `upright mark`

use std::path::PathBuf;

use clap::Args;
use upright_command::project::checkout;
use upright_command::{Failure, print};
use upright_design::table::write_atomically;
use upright_tool::marking::{csv_text, marked, table};
use upright_tool::site::lab;

/// Runs again what a class has handed in for a lab of the page, and says who has solved what.
///
/// Every answer is computed anew, with the bits of the page. A file that was changed after the page had saved it, or is
/// of another lab, does not count: exit status 1. The rig of the lab is found in rigs/ of this repository.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright mark class/ --lab lessons/03-weights.toml
  upright mark class/ --lab lessons/03-weights.toml --csv class.csv
  upright mark class/ --lab lessons/03-weights.toml --json | jq .[].name")]
pub(crate) struct MarkCommand {
    /// Folder with the files that the page has saved (JSON)
    folder: PathBuf,
    /// The lab (TOML)
    #[arg(long, value_name = "FILE")]
    lab: PathBuf,
    /// Also write the results into this file
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print the results as JSON, with the reason for each step
    #[arg(long)]
    json: bool,
}

impl MarkCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let lab = lab(&self.lab)?;
        let rig = checkout()?.join(format!("rigs/{}.toml", lab.rig));
        let rig = std::fs::read_to_string(&rig)
            .map_err(|error| Failure::argument(format!("the lab's rig, {}: {error}", rig.display())))?;
        let marked = marked(&self.folder, &lab, &rig)?;
        if let Some(path) = &self.csv {
            write_atomically(path, &csv_text(&marked)?)?;
        }
        print(self.json, &marked, || table(&marked))?;
        match marked.iter().filter(|one| one.refused.is_some()).count() {
            0 => Ok(()),
            number => Err(Failure::check(format!("{number} of {} files do not count", marked.len()))),
        }
    }
}
