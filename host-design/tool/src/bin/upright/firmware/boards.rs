//! `upright firmware boards`

use clap::Args;
use upright_tool::image::{BoardFacts, board_facts};

use crate::failure::Failure;
use crate::output::print;

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

impl BoardsCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let facts = board_facts();
        print(self.json, &serde_json::json!(facts), || table(&facts))?;
        Ok(())
    }
}

fn table(facts: &[BoardFacts]) -> String {
    let mut text = format!(
        "{:<15} {:<27} {:<10} {:>8}  {:<16} {}\n",
        "board", "product", "chip", "encoders", "tick", "executed"
    );
    for BoardFacts { name, product, chip, encoders, tick_s: [shortest_s, longest_s], executed } in facts {
        let ms = |time_s: &f64| (time_s * 1e6).round() / 1e3;
        let tick = format!("{} to {} ms", ms(shortest_s), ms(longest_s));
        text += &format!(
            "{name:<15} {product:<27} {chip:<10} {encoders:>8}  {tick:<16} {}\n",
            executed.join("; ")
        );
    }
    text
}
