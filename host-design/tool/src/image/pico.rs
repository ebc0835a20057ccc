//! The images for a Raspberry Pi Pico and a Pico 2, which are a crate of their own: `boards/rp2040/`.

use std::path::{Path, PathBuf};

use upright_design::rig::Rig;
use upright_design::table::{TableValues, gains_source, write_atomically};

use super::build::{PROFILE, counts_all, images, one_at_a_time};
use super::checksum::with_reference;
use super::compiler::{Compiler, compiler_for_chips};
use super::error::BuildError;
use super::pico_board::PicoBoard;
use super::pico_limits::{PicoError, check};
use super::uf2::uf2;
use crate::project::checkout;

/// The files of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PicoImage {
    /// For a debugger.
    pub elf: PathBuf,
    /// For the drive that the board shows while BOOTSEL is held.
    pub uf2: PathBuf,
}

/// Checks what a board can do for this rig, as far as that is known before it is designed.
///
/// # Errors
/// [`PicoError`] if the board counts too few encoders, or cannot make the tick.
pub fn check_rig_for_pico(board: PicoBoard, rig: &Rig) -> Result<(), PicoError> {
    check(board, rig.sensors().len(), rig.tick.period_s, false, None)
}

/// Builds the image for this board with the table of `rig`.
///
/// # Errors
/// [`BuildError`] if the board cannot run this rig, there is no compiler, or it fails.
pub fn build_pico(board: PicoBoard, rig: &Rig, table: &TableValues) -> Result<PicoImage, BuildError> {
    check(board, table.sensors(), rig.tick.period_s, table.swing_up.is_some(), table.drive.pulses())?;
    counts_all(table)?;
    let name = format!(
        "{}-{:016x}-{:08x}-{:08x}",
        board.name(),
        rig.hash(),
        table.crc(),
        table.swing_up_crc().unwrap_or_default()
    );
    let gains = images()?.join(format!("{name}.rs"));
    let source = gains_source(rig, table);
    if std::fs::read_to_string(&gains).ok().as_ref() != Some(&source) {
        write_atomically(&gains, source.as_bytes())?;
    }
    let _others_wait = one_at_a_time()?;
    let bytes = compiled(board.target(), &gains)?;
    let image =
        PicoImage { elf: images()?.join(format!("{name}.elf")), uf2: images()?.join(format!("{name}.uf2")) };
    write_atomically(&image.elf, &bytes)?;
    write_atomically(&image.uf2, &uf2(board.family(), &image.elf, &bytes)?)?;
    Ok(image)
}

/// Compiles the image; returns the ELF file.
fn compiled(target: &str, gains: &Path) -> Result<Vec<u8>, BuildError> {
    let Compiler { program, mut cargo, target_directory, .. } = compiler_for_chips(&[target])?;
    cargo.current_dir(checkout()?.join("boards/rp2040")).env("UPRIGHT_GAINS", gains);
    cargo.args(["build", "--quiet", "--profile", PROFILE, "--locked", "--target", target]);
    let output = cargo.output().map_err(|source| BuildError::Start(program, source))?;
    if !output.status.success() {
        return Err(BuildError::Compiler(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    let path = target_directory.join(target).join(PROFILE).join("upright-rp2040");
    match std::fs::read(&path) {
        Ok(elf) => Ok(with_reference(&path, elf)?),
        Err(source) => Err(BuildError::File { path, source }),
    }
}
