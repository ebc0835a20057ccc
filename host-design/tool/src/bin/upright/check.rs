//! `upright check`

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use upright_design::rig::Rig;

use crate::failure::Failure;

/// Reads a rig file and prints all its values, with defaults filled in.
///
/// Exit status 2 if the file cannot be used; the message names line, key and remedy.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright check rigs/quadruple-paper.toml
  upright check my.toml --json | jq .plant")]
pub(crate) struct Check {
    /// Rig file (TOML)
    rig: PathBuf,
    /// Print the values as one JSON object
    #[arg(long)]
    json: bool,
}

impl Check {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        let mut out = std::io::stdout().lock();
        if self.json {
            serde_json::to_writer(&mut out, &rig).map_err(std::io::Error::from)?;
            writeln!(out)?;
        } else {
            write!(out, "{}", rig.describe())?;
        }
        Ok(())
    }
}
