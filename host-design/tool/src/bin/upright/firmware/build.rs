//! `upright firmware build`

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::board::BoardOption;
use super::built::{CodeOrigin, built};
use super::cycles::check_ticks;
use crate::variation::Wanted;
use upright_command::Failure;

/// Builds the image of a board, and prints the path of its ELF file; exit status 1 if a tick takes longer than a
/// quarter of its period. For a Pico or Pico 2, it prints the path of the UF2 file, beside which the ELF file is.
///
/// Writes the tables of the rig into an image of upright-images.lzma, which lies beside the tool or is named by the
/// environment variable UPRIGHT_IMAGES. Without that file, or for a rig of another kind, it compiles the image, with
/// the compiler of rustup if its target thumbv7em-none-eabihf is installed, otherwise that of Debian. If there is
/// neither, the exit status is 4, and the message says what to install.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware build                                      with src/gains.rs as it is
  upright firmware build rigs/single-quanser-ip02.toml        with the gains and stored motions of a rig
  upright firmware build --board nucleo-f446
  upright firmware build rigs/single-quanser-ip02.toml --board pico")]
pub(crate) struct BuildCommand {
    /// Rig file (TOML) to design the table from [default: the table in src/gains.rs]
    rig: Option<PathBuf>,
    #[command(flatten)]
    on: BoardOption,
    /// Include the stored motions between other equilibria
    #[arg(long, requires = "rig")]
    transitions: bool,
    /// Leave the stored motions out
    #[arg(long, requires = "rig", conflicts_with = "transitions")]
    no_motions: bool,
    /// Compile the image, even if it is there already, as it is beside the tool of a release
    #[arg(long)]
    from_source: bool,
}

impl BuildCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let wanted = if self.no_motions { Wanted::Nothing } else { Wanted::from_option(self.transitions) };
        let mut built =
            built(self.on.board, self.rig.as_deref(), wanted, CodeOrigin::from_option(self.from_source))?;
        check_ticks(self.on.board, &mut built)?;
        writeln!(std::io::stdout(), "{}", built.image.flashed().display())?;
        Ok(())
    }
}
