//! The image of a rig, and the design that it is built from.

use std::path::Path;

use upright::boards::BoardRow;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_tool::image::{self, BuildError, BuiltImage, CommittedGains, Prebuilt};

use crate::building::building;
use crate::variation::{Wanted, with_stored_motions, with_table};
use upright_command::Failure;

/// An image, and the rig and table that it is built from.
pub(super) struct ForRig {
    pub(super) image: BuiltImage,
    pub(super) rig: Rig,
    pub(super) table: TableValues,
}

/// Where the code of an image comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CodeOrigin {
    /// Prebuilt, if the tool has it for this board and rigs like this one, otherwise compiled.
    Prebuilt,
    /// Compiled from the sources.
    Compiled,
}

impl CodeOrigin {
    /// What the option `--from-source` asks for.
    pub(super) fn from_option(from_source: bool) -> Self {
        if from_source { Self::Compiled } else { Self::Prebuilt }
    }
}

/// Builds the image with the table of the rig and its stored motions, or with src/gains.rs, which has none.
pub(super) fn built(
    board: &'static BoardRow,
    rig: Option<&Path>,
    wanted: Wanted,
    code: CodeOrigin,
) -> Result<ForRig, Failure> {
    let prebuilt = if code == CodeOrigin::Prebuilt { Prebuilt::find()? } else { None };
    let (rig, table) = match rig {
        Some(path) => designed_for(board, path, wanted)?,
        None => committed(board)?,
    };
    if let Some(prebuilt) = prebuilt {
        if let Some(image) = prebuilt.build_for(board, &rig, &table)? {
            return Ok(ForRig { image, rig, table });
        }
        eprintln!(
            "no image is prebuilt for {board} and the kinds of drive and sensors of this rig: compiling it"
        );
    }
    let image = building(board, || image::build_for(board, &rig, &table))?;
    Ok(ForRig { image, rig, table })
}

/// The rig that src/gains.rs is made from, and its table, which has to be the same.
fn committed(board: &'static BoardRow) -> Result<(Rig, TableValues), Failure> {
    let gains = CommittedGains::read()?;
    let Some(path) = gains.rig() else { return Err(BuildError::NoRig { path: gains.path }.into()) };
    let (rig, table) = designed_for(board, &path, Wanted::Nothing)?;
    if table.crc() != gains.crc {
        return Err(BuildError::OtherGains { path: gains.path, rig: path }.into());
    }
    Ok((rig, table))
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
