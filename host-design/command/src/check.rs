//! `upright check`

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use upright_design::rig::{Rig, key_table};

use crate::failure::Failure;
use crate::output::{print, warn_of_unusual_values};

/// Reads a rig file and prints all its values, with defaults filled in.
///
/// Exit status 2 if the file is invalid; the message names line, key and remedy.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright check rigs/quadruple-paper.toml
  upright check my.toml --json | jq .plant
  upright check --keys")]
pub struct CheckCommand {
    /// Rig file (TOML)
    #[arg(required_unless_present = "keys")]
    rig: Option<PathBuf>,
    /// Print the values as one JSON object
    #[arg(long)]
    json: bool,
    /// Print all keys of a rig file as a Markdown table: meaning, what is accepted, default
    #[arg(long, conflicts_with_all = ["rig", "json"])]
    keys: bool,
}

impl CheckCommand {
    /// Runs the command.
    ///
    /// # Errors
    /// [`Failure`] for an invalid rig file, or if stdout is closed.
    pub fn run(self) -> Result<(), Failure> {
        let Some(file) = self.rig else {
            return Ok(write!(std::io::stdout(), "{}", key_table())?);
        };
        let rig = Rig::from_path(&file)?;
        warn_of_unusual_values(&rig, &file);
        print(self.json, &rig, || rig.describe())
    }
}
