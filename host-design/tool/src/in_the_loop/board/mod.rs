//! The image that is flashed, on the virtual board.

mod absolute;
mod compared;
mod cycles;
mod places;
mod pulse_count;
mod virtual_board;

pub use compared::Compared;
pub use cycles::{Span, TickCycles, TickFigures, TooLong, measure};
pub use pulse_count::PulseWatch;
pub use virtual_board::{Event, Events, RULES, VirtualBoard};
