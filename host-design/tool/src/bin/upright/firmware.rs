//! `upright firmware`: everything about the image, from building to monitoring.

mod board;
mod boards;
mod build;
mod built;
mod cycles;
mod drive;
mod flash;
mod monitor;
mod prebuild;
mod run;
mod size;

pub(crate) use monitor::lines_of_stdin;

use clap::{Args, Subcommand};

use upright_command::Failure;

/// Builds, measures, runs, flashes and monitors the firmware image.
#[derive(Args)]
pub(crate) struct FirmwareCommand {
    #[command(subcommand)]
    command: FirmwareSubcommand,
}

#[derive(Subcommand)]
enum FirmwareSubcommand {
    Boards(boards::BoardsCommand),
    Build(build::BuildCommand),
    Prebuild(prebuild::PrebuildCommand),
    Cycles(Box<cycles::CyclesCommand>),
    Size(size::SizeCommand),
    Flash(flash::FlashCommand),
    Run(Box<run::RunCommand>),
    Monitor(monitor::MonitorCommand),
}

impl FirmwareCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.command {
            FirmwareSubcommand::Boards(command) => command.run(),
            FirmwareSubcommand::Build(command) => command.run(),
            FirmwareSubcommand::Prebuild(command) => command.run(),
            FirmwareSubcommand::Cycles(command) => command.run(),
            FirmwareSubcommand::Size(command) => command.run(),
            FirmwareSubcommand::Flash(command) => command.run(),
            FirmwareSubcommand::Run(command) => command.run(),
            FirmwareSubcommand::Monitor(command) => command.run(),
        }
    }
}
