//! The option `--board`, of all commands that build an image for a board.

use clap::Args;
use upright_tool::image::BoardName;

#[derive(Args)]
pub(super) struct BoardOption {
    /// Board: weact-f405, olimex-h405, feather-f405, discovery-f407 or nucleo-f446
    #[arg(long, value_name = "NAME", default_value_t = BoardName::WeactF405)]
    pub(super) board: BoardName,
}
