//! `upright firmware`: the image, on its way from the source to the board.

mod run;

use clap::{Args, Subcommand};

use crate::failure::Failure;

/// Builds, measures, runs and flashes the firmware image.
#[derive(Args)]
pub(crate) struct Firmware {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Run(run::Run),
}

impl Firmware {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.command {
            Command::Run(command) => command.run(),
        }
    }
}
