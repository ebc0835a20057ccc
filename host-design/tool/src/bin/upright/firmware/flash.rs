//! `upright firmware flash`

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use upright::boards::Family;

use super::board::BoardOption;
use super::built::{CodeOrigin, built};
use super::cycles::check_ticks;
use super::drive::copy_to_drive;
use crate::variation::Wanted;
use upright_command::Failure;

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

impl FlashCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let wanted = if self.no_motions { Wanted::Nothing } else { Wanted::from_option(self.transitions) };
        let board = self.on.board;
        let build = || built(board, self.rig.as_deref(), wanted, CodeOrigin::from_option(self.from_source));
        match &board.family {
            Family::Rp(rp) => copy_to_drive(board, rp.chip.drive(), build()?.image.flashed()),
            Family::F4(f4) => {
                // Checked first, because building the image takes longer.
                if Command::new(PROBE_RS).arg("--version").output().is_err() {
                    return Err(Failure::no_program(
                        "probe-rs is missing: install it (https://probe.rs, or `cargo install probe-rs-tools --locked`)",
                    ));
                }
                let mut built = build()?;
                check_ticks(board, &mut built)?;
                let chip = format!("{}{}", f4.chip.name(), f4.package);
                probe_rs(&["download", "--verify", "--chip", &chip], Some(&built.image.elf))?;
                probe_rs(&["reset", "--chip", &chip], None)
            }
        }
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
