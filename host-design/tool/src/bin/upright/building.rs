//! Progress while an image is built.

use upright::boards::BoardRow;
use upright_command::progress::with_estimate;
use upright_tool::image::{BuildError, usual_duration};

/// Runs `build`, which builds an image of the board, and says meanwhile how long that still takes.
pub(crate) fn building<T>(
    board: &BoardRow,
    build: impl FnOnce() -> Result<T, BuildError>,
) -> Result<T, BuildError> {
    with_estimate("building the image", usual_duration(board)?, build)
}
