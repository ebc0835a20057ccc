//! `upright firmware flash`

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;

use super::board::{AnyBoard, AnyBoardOption};
use super::built::{built, built_for_pico};
use super::cycles::check_ticks;
use super::drive::copy_to_drive;
use crate::failure::Failure;
use crate::variation::Wanted;

const PROBE_RS: &str = "probe-rs";

/// Builds and checks the image of a board as `build` does, writes it to the board with probe-rs, verifies it, and
/// starts it. For a Pico or Pico 2, it copies the image to the drive that appears while BOOTSEL is held at power-on.
///
/// The firmware starts disarmed: the motor stays off.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware flash                                      with src/gains.rs as it is
  upright firmware flash rigs/single-quanser-ip02.toml --board nucleo-f446")]
pub(crate) struct FlashCommand {
    /// Rig file (TOML) to design the table from [default: the table in src/gains.rs]
    rig: Option<PathBuf>,
    #[command(flatten)]
    on: AnyBoardOption,
    /// Include the stored motions between other equilibria
    #[arg(long, requires = "rig")]
    transitions: bool,
    /// Leave the stored motions out
    #[arg(long, requires = "rig", conflicts_with = "transitions")]
    no_motions: bool,
}

impl FlashCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let wanted = if self.no_motions { Wanted::Nothing } else { Wanted::from_option(self.transitions) };
        let board = match self.on.board {
            AnyBoard::Pico(board) => {
                return copy_to_drive(board, &built_for_pico(board, self.rig.as_deref(), wanted)?.uf2);
            }
            AnyBoard::F4(board) => board,
        };
        // Checked first, because building the image takes longer.
        if Command::new(PROBE_RS).arg("--version").output().is_err() {
            return Err(Failure::no_program(
                "probe-rs is missing: install it (https://probe.rs, or `cargo install probe-rs-tools --locked`)",
            ));
        }
        let image = built(board, self.rig.as_deref(), wanted)?;
        check_ticks(board, self.rig.as_deref(), wanted, &image)?;
        probe_rs(&["download", "--verify", "--chip", board.chip()], Some(&image))?;
        probe_rs(&["reset", "--chip", board.chip()], None)
    }
}

/// Runs probe-rs, which prints its own messages and progress.
fn probe_rs(arguments: &[&str], image: Option<&Path>) -> Result<(), Failure> {
    let status = Command::new(PROBE_RS).args(arguments).args(image).status()?;
    if status.success() {
        Ok(())
    } else {
        Err(Failure::check(format!(
            "probe-rs {} ended with {status}; is the probe connected and the board powered?",
            arguments[0]
        )))
    }
}
