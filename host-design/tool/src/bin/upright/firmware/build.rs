//! `upright firmware build`

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::{Board, built};
use crate::failure::Failure;

/// Builds the image of a board and prints the path of its ELF file.
///
/// The compiler is that of rustup, if its target thumbv7em-none-eabihf is installed, otherwise that of Debian; exit
/// status 4, with what to install, if there is neither.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware build                                      with src/gains.rs as it is
  upright firmware build rigs/single-quanser-ip02.toml        with the gains of another rig
  upright firmware build --board stm32f446")]
pub(crate) struct Build {
    /// Rig file (TOML), to be designed [default: the table in src/gains.rs]
    rig: Option<PathBuf>,
    /// Microcontroller of the board
    #[arg(long, value_enum, default_value_t = Board::Stm32f405)]
    board: Board,
}

impl Build {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let image = built(self.board.kind(), self.rig.as_deref())?;
        writeln!(std::io::stdout(), "{}", image.display())?;
        Ok(())
    }
}
