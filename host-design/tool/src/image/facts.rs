//! The boards as a list of facts.

use super::board::BoardName;
use super::pico_board::PicoBoard;
use super::pico_limits::{PICO_ENCODERS, PICO_TICK_S};

/// A board that there is an image for.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BoardFacts {
    /// Name on the command line.
    pub name: &'static str,
    /// What it is sold as.
    pub product: &'static str,
    /// Its microcontroller.
    pub chip: &'static str,
    /// Number of encoders that it counts.
    pub encoders: usize,
    /// Shortest and longest tick that it can make (s).
    pub tick_s: [f64; 2],
    /// Where its image has been executed.
    pub executed: Vec<&'static str>,
}

/// No image has run on a real board yet.
const REAL: &str = "real board: none yet";

/// All boards; the first one is the default.
pub fn board_facts() -> Vec<BoardFacts> {
    let f4 = BoardName::ALL.map(|board| BoardFacts {
        name: board.name(),
        product: board.product(),
        chip: &board.chip()[..9],
        encoders: board.encoders(),
        tick_s: board.tick_s(),
        executed: vec!["virtual board", REAL],
    });
    let pico = PicoBoard::ALL.map(|board| BoardFacts {
        name: board.name(),
        product: board.product(),
        chip: board.chip(),
        encoders: PICO_ENCODERS,
        tick_s: PICO_TICK_S,
        executed: vec![board.executed(), REAL],
    });
    f4.into_iter().chain(pico).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_boards_have_the_same_name() {
        let mut names: Vec<_> = board_facts().into_iter().map(|facts| facts.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), board_facts().len());
        assert!(board_facts().iter().all(|facts| facts.executed.ends_with(&[REAL])));
    }
}
