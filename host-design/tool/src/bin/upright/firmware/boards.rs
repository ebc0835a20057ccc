//! `upright firmware boards`

use clap::Args;
use serde_json::json;
use upright::boards::{BOARDS, BoardRow, Family};

use upright_command::Failure;
use upright_command::print;

/// Lists the boards that there is an image for: what each can do, and where its image has been executed.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware boards
  upright firmware boards --json | jq -r .[].name")]
pub(crate) struct BoardsCommand {
    /// Print the list as JSON
    #[arg(long)]
    json: bool,
}

/// No image has run on a real board yet.
const REAL: &str = "real board: none yet";

impl BoardsCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let facts = |board: &BoardRow| {
            json!({
                "name": board.name,
                "product": board.product,
                "chip": board.chip(),
                "encoders": board.encoders(),
                "tick_s": board.tick_us().map(|us| f64::from(us) / 1e6),
                "executed": [executed(board), REAL],
            })
        };
        print(self.json, &BOARDS.iter().map(facts).collect::<Vec<_>>(), table)?;
        Ok(())
    }
}

/// Where its image has been executed.
fn executed(board: &BoardRow) -> &'static str {
    match &board.family {
        Family::F4(_) => "virtual board",
        Family::Rp(board) => board.executed,
    }
}

fn table() -> String {
    let mut text = format!(
        "{:<15} {:<34} {:<10} {:>8}  {:<16} {}\n",
        "board", "product", "chip", "encoders", "tick", "executed"
    );
    for board in &BOARDS {
        let [shortest_ms, longest_ms] = board.tick_us().map(|us| f64::from(us) / 1e3);
        let tick = format!("{shortest_ms} to {longest_ms} ms");
        text += &format!(
            "{board:<15} {:<34} {:<10} {:>8}  {tick:<16} {}; {REAL}\n",
            board.product,
            board.chip(),
            board.encoders(),
            executed(board)
        );
    }
    text
}
