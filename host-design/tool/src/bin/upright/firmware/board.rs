//! The option `--board`, of all commands that build an image.

use clap::Args;
use upright::boards::{BOARDS, BoardRow, DEFAULT_BOARD, named};

#[derive(Args)]
pub(super) struct BoardOption {
    /// Board: a name that `upright firmware boards` lists
    #[arg(long, value_name = "NAME", default_value = DEFAULT_BOARD.name, value_parser = board)]
    pub(super) board: &'static BoardRow,
}

/// Parses the name of a board.
pub(super) fn board(name: &str) -> Result<&'static BoardRow, String> {
    let names = || BOARDS.iter().map(|board| board.name).collect::<Vec<_>>().join(", ");
    named(name).ok_or_else(|| format!("no board has this name; choose one of {}", names()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_no_board_has_is_answered_with_those_that_there_are() {
        assert_eq!(board("pico2").unwrap().name, "pico2");
        let refused = board("picot").unwrap_err();
        assert!(refused.contains("nucleo-f446, pico, pico2"), "{refused}");
    }
}
