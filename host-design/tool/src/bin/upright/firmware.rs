//! `upright firmware`: everything about the image, from building to monitoring.

mod board;
mod build;
mod built;
mod cycles;
mod flash;
mod monitor;
mod run;
mod size;

pub(crate) use monitor::lines_of_stdin;

use clap::{Args, Subcommand};

use crate::failure::Failure;

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
