//! `upright firmware`: everything about the image, from building to monitoring.

mod board;
mod build;
mod cycles;
mod flash;
mod monitor;
mod run;
mod size;
mod target;

pub(crate) use monitor::lines_of_stdin;
pub(crate) use target::{Built, Target};

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_tool::image::{self, Kind};

use crate::failure::Failure;
use crate::progress::with_spinner;
use crate::variation::{Wanted, with_stored_motions, with_table};

/// Builds, measures, runs, flashes and monitors the firmware image.
#[derive(Args)]
pub(crate) struct Firmware {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Build(build::Build),
    Cycles(Box<cycles::Cycles>),
    Size(size::Size),
    Flash(flash::Flash),
    Run(Box<run::Run>),
    Monitor(monitor::Monitor),
}

impl Firmware {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.command {
            Command::Build(command) => command.run(),
            Command::Cycles(command) => command.run(),
            Command::Size(command) => command.run(),
            Command::Flash(command) => command.run(),
            Command::Run(command) => command.run(),
            Command::Monitor(command) => command.run(),
        }
    }
}

/// Builds the image with the table of the rig and its stored motions, or with src/gains.rs as it is.
fn built(kind: Kind, rig: Option<&Path>, wanted: Wanted) -> Result<PathBuf, Failure> {
    let Some(path) = rig else {
        return Ok(with_spinner("building the image", || image::build(kind))?);
    };
    let (rig, table) = designed(path, wanted)?;
    Ok(with_spinner("building the image", || image::build_for(kind, &rig, &table))?)
}

/// Reads this rig file and designs its table, with the stored motions.
fn designed(path: &Path, wanted: Wanted) -> Result<(Rig, TableValues), Failure> {
    let rig = Rig::from_path(path)?;
    let (_, table) = with_table(&rig, path, Gains::Sampled)?;
    let table = with_stored_motions(path, &rig, table, wanted)?;
    Ok((rig, table))
}
