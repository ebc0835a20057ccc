//! The image of a rig, and the design that it is built from.

use std::path::Path;

use upright::boards::BoardRow;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_tool::image::{self, BuiltImage, CommittedGains};

use crate::building::building;
use crate::variation::{Wanted, with_stored_motions, with_table};
use upright_command::Failure;

/// An image, and the rig and table that it is built from; none if it has src/gains.rs and that is made from no rig in
/// `rigs/`.
pub(super) struct ForRig {
    pub(super) image: BuiltImage,
    pub(super) design: Option<(Rig, TableValues)>,
}

/// Builds the image with the table of the rig and its stored motions, or with src/gains.rs as it is.
pub(super) fn built(board: &'static BoardRow, rig: Option<&Path>, wanted: Wanted) -> Result<ForRig, Failure> {
    if let Some(path) = rig {
        let (rig, table) = designed_for(board, path, wanted)?;
        let image = building(board, || image::build_for(board, &rig, &table))?;
        return Ok(ForRig { image, design: Some((rig, table)) });
    }
    let design = match CommittedGains::read()?.rig() {
        // src/gains.rs has no motions.
        Some(path) => Some(designed_for(board, &path, Wanted::Nothing)?),
        None => None,
    };
    if let Some((_, table)) = &design {
        image::check_table(board, table)?;
    }
    let image = building(board, || image::build(board))?;
    Ok(ForRig { image, design })
}

/// The same as [`designed`], for a board that can run the rig as far as that is known before.
fn designed_for(
    board: &'static BoardRow,
    path: &Path,
    wanted: Wanted,
) -> Result<(Rig, TableValues), Failure> {
    image::check_rig(board, &Rig::from_path(path)?)?;
    designed(path, wanted)
}

/// Reads this rig file and designs its table, with the stored motions.
pub(super) fn designed(path: &Path, wanted: Wanted) -> Result<(Rig, TableValues), Failure> {
    let rig = Rig::from_path(path)?;
    let (_, table) = with_table(&rig, path, Gains::Sampled)?;
    let table = with_stored_motions(path, &rig, table, wanted)?;
    Ok((rig, table))
}
