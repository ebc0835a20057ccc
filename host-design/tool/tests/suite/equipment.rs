//! The image, if this machine has a compiler for it.

use std::path::PathBuf;

use upright::boards::BoardRow;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_tool::image::{BuildError, build, build_for};

pub(crate) use upright_test_support::equipment::{is_required, not_exercised};

/// What was built or found; `None` if it needs the missing compiler for the image. `what` it is for.
pub(crate) fn if_possible<T>(result: Result<T, BuildError>, what: &str) -> Option<T> {
    let is_missing = |error: &BuildError| matches!(error, BuildError::NoCompiler(_));
    upright_test_support::equipment::if_possible(result, is_missing, what)
}

/// The image with the committed gain table.
pub(crate) fn built(board: &'static BoardRow) -> Option<PathBuf> {
    if_possible(build(board), "an image").map(|image| image.elf)
}

/// The image with this table.
pub(crate) fn built_for(board: &'static BoardRow, rig: &Rig, table: &TableValues) -> Option<PathBuf> {
    if_possible(build_for(board, rig, table), "an image").map(|image| image.elf)
}
