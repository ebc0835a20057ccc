//! The image of a rig, and the design that it is built from.

use std::path::{Path, PathBuf};

use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_tool::image::{self, BoardName, PicoBoard, PicoImage};

use crate::failure::Failure;
use crate::variation::{Wanted, with_stored_motions, with_table};
use upright_tool::progress::with_spinner;

/// Builds the image with the table of the rig and its stored motions, or with src/gains.rs as it is.
pub(super) fn built(board: BoardName, rig: Option<&Path>, wanted: Wanted) -> Result<PathBuf, Failure> {
    let Some(path) = rig else {
        return Ok(with_spinner("building the image", || image::build(board))?);
    };
    let rig = Rig::from_path(path)?;
    image::check_rig(board, &rig)?;
    let table = table_of(&rig, path, wanted)?;
    Ok(with_spinner("building the image", || image::build_for(board, &rig, &table))?)
}

/// Builds the image for a Pico or a Pico 2.
pub(super) fn built_for_pico(
    board: PicoBoard,
    rig: Option<&Path>,
    wanted: Wanted,
) -> Result<PicoImage, Failure> {
    let Some(path) = rig else {
        return Err(Failure::argument("name a rig file: an image for a pico is built from one"));
    };
    let rig = Rig::from_path(path)?;
    image::check_rig_for_pico(board, &rig)?;
    let table = table_of(&rig, path, wanted)?;
    Ok(with_spinner("building the image", || image::build_pico(board, &rig, &table))?)
}

/// Reads this rig file and designs its table, with the stored motions.
pub(super) fn designed(path: &Path, wanted: Wanted) -> Result<(Rig, TableValues), Failure> {
    let rig = Rig::from_path(path)?;
    let table = table_of(&rig, path, wanted)?;
    Ok((rig, table))
}

fn table_of(rig: &Rig, path: &Path, wanted: Wanted) -> Result<TableValues, Failure> {
    let (_, table) = with_table(rig, path, Gains::Sampled)?;
    with_stored_motions(path, rig, table, wanted)
}
