//! The option `--board`, of all commands that build an image for a board.

use clap::Args;
use upright_tool::image::{BoardName, NoBoard, PicoBoard};

#[derive(Args)]
pub(super) struct BoardOption {
    /// Board: weact-f405, olimex-h405, feather-f405, discovery-f407 or nucleo-f446
    #[arg(long, value_name = "NAME", default_value_t = BoardName::WeactF405)]
    pub(super) board: BoardName,
}

/// Every board that there is an image for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AnyBoard {
    /// A board that the virtual board stands for.
    F4(BoardName),
    /// The Raspberry Pi Pico and the Pico 2.
    Pico(PicoBoard),
}

impl std::str::FromStr for AnyBoard {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        if let Some(board) = PicoBoard::ALL.into_iter().find(|board| board.name() == name) {
            return Ok(Self::Pico(board));
        }
        let others = PicoBoard::ALL.map(PicoBoard::name).join(", ");
        name.parse().map(Self::F4).map_err(|error: NoBoard| format!("{error}, {others}"))
    }
}

impl std::fmt::Display for AnyBoard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::F4(board) => board.fmt(f),
            Self::Pico(board) => f.pad(board.name()),
        }
    }
}

#[derive(Args)]
pub(super) struct AnyBoardOption {
    /// Board: a name that `upright firmware boards` lists
    #[arg(long, value_name = "NAME", default_value_t = AnyBoard::F4(BoardName::WeactF405))]
    pub(super) board: AnyBoard,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_board_is_known_by_the_name_that_it_prints() {
        let f4 = BoardName::ALL.map(AnyBoard::F4);
        for board in f4.into_iter().chain(PicoBoard::ALL.map(AnyBoard::Pico)) {
            assert_eq!(board.to_string().parse(), Ok(board));
        }
        let refused = "picot".parse::<AnyBoard>().unwrap_err();
        assert!(refused.contains("nucleo-f446, pico, pico2"), "{refused}");
    }
}
