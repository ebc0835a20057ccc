//! `upright check`

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use upright_design::number::significant;
use upright_design::plant::ChainParameters;
use upright_design::rig::{Rig, key_table};

use crate::failure::Failure;
use crate::output::{print, warn_of_unusual_values};
use crate::stilling::stilling;

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

/// The speed that an arm must not reach while its links hang.
fn turning_limit(rig: &Rig) -> String {
    let parameters = rig.chain().map(ChainParameters::<f64>::of);
    match parameters.and_then(|parameters| parameters.unstable_hanging_rad_per_s()) {
        Some(speed) => format!(
            "\nthe links hang unstably while the arm turns faster than {} rad/s; stay below half of that\n",
            significant(speed, 3)
        ),
        None => String::new(),
    }
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
        print(self.json, &rig, || rig.describe() + &turning_limit(&rig) + &stilling(&rig))
    }
}
