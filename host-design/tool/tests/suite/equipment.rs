//! The image, if this machine has a compiler for it.

use std::path::PathBuf;

use upright::boards::BoardRow;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_tool::image::{BuildError, build_for};

pub(crate) use upright_test_support::equipment::{is_required, not_exercised};
use upright_test_support::published::rig_and_table;

/// What was built or found; `None` if it needs the missing compiler for the image. `what` it is for.
pub(crate) fn if_possible<T>(result: Result<T, BuildError>, what: &str) -> Option<T> {
    let is_missing = |error: &BuildError| matches!(error, BuildError::NoCompiler(_));
    upright_test_support::equipment::if_possible(result, is_missing, what)
}

/// The image for the rig of the committed gain table.
pub(crate) fn built(board: &'static BoardRow) -> Option<PathBuf> {
    let (rig, table) = rig_and_table("quadruple-paper");
    built_for(board, rig, table)
}

/// The image with this table.
pub(crate) fn built_for(board: &'static BoardRow, rig: &Rig, table: &TableValues) -> Option<PathBuf> {
    if_possible(build_for(board, rig, table), "an image").map(|image| image.elf)
}
