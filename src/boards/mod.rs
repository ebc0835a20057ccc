//! The boards that there is an image for, one row for each: the images, the tool and the documents read them.
//!
//! ```
//! use upright::boards::named;
//!
//! let feather = named("feather-f405").unwrap();
//! assert_eq!((feather.encoders(), feather.chip()), (2, "STM32F405"));
//! ```
//!
//! A board of your own needs no row: it implements [`Board`](crate::board::Board).

pub mod f4;
pub mod parts;
mod row;
mod rows;
pub mod rp;
pub mod two_wires;
pub mod wiring;

pub use row::{BoardRow, Family, PULSES_HZ, cycles_per_tick};
pub use rows::BOARDS;

/// The board where none is named.
pub static DEFAULT_BOARD: &BoardRow = &BOARDS[0];

/// The board with this name.
pub const fn named(name: &str) -> Option<&'static BoardRow> {
    let mut row = 0;
    while row < BOARDS.len() {
        if is_same(BOARDS[row].name.as_bytes(), name.as_bytes()) {
            return Some(&BOARDS[row]);
        }
        row += 1;
    }
    None
}

const fn is_same(a: &[u8], b: &[u8]) -> bool {
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_board_has_a_name_of_its_own() {
        for board in &BOARDS {
            assert_eq!(named(board.name), Some(board));
        }
        assert_eq!(named("picot"), None);
        assert_eq!(named("pic"), None);
    }
}
