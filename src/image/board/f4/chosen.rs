//! The board of this image, which the environment variable UPRIGHT_BOARD names.

use upright::boards::f4::{F4Board, F4Chip};
use upright::boards::{Family, named};

/// The board's name.
pub(super) const NAME: &str = env!("UPRIGHT_BOARD");

/// The board.
pub(super) const BOARD: F4Board = match named(NAME) {
    Some(row) => match &row.family {
        Family::F4(board) => *board,
        Family::Rp(_) => panic!("UPRIGHT_BOARD: the image for this board is boards/rp2040"),
    },
    None => panic!("UPRIGHT_BOARD: no board has this name"),
};

const _: () = assert!(
    matches!(BOARD.chip, F4Chip::F446) == cfg!(feature = "stm32f446"),
    "UPRIGHT_BOARD: this board has another chip than the one of the cargo feature"
);
