//! The image that is flashed, on the virtual board.

mod compared;
mod cycles;
mod places;
mod virtual_board;

pub use compared::Compared;
pub use cycles::{Span, TickCycles, TickFigures, TooLong, measure};
pub use virtual_board::{Event, Events, RULES, VirtualBoard};
