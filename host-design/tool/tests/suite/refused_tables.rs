//! The flashed image refuses tables that are not for it, and what was changed, on the virtual board.

use upright::boards::{BoardRow, DEFAULT_BOARD, named};
use upright::flash_image::{LAYOUT, MARK};
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;
use upright_board::{Conditions, Image};
use upright_design::table::image_tables;

use crate::powered::{Powered, image, sealed};
use crate::published::rig_and_table;

const FLASH: u32 = 0x0800_0000;

/// Number of bytes before the tables.
fn code_bytes(image: &Image) -> usize {
    let begin = [MARK.to_le_bytes(), LAYOUT.to_le_bytes()].concat();
    let flash = image.flash();
    (0..flash.len()).step_by(4).find(|&at| flash[at..].starts_with(&begin)).unwrap()
}

/// The image with these words in place of its tables, and the checksum of that.
fn with_words(image: &Image, words: &[u32]) -> Image {
    let at = code_bytes(image);
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let end = at + bytes.len();
    sealed(image.clone().with_bytes(FLASH + at as u32, bytes), end)
}

/// The tables of a rig for a board.
fn words(rig: &'static str, board: &BoardRow) -> Vec<u32> {
    image_tables(board, &rig_and_table(rig).1)
}

/// State and fault soon after power-up.
fn started(image: &Image) -> (State, Option<Fault>) {
    let mut run = Powered::strict(image, &Conditions::f405(1));
    run.run(0.1);
    run.last()
}

#[test]
fn tables_for_another_board_size_or_layout_and_cut_ones_are_faults() {
    let Some(image) = image() else { return };
    let own = words("quadruple-robust", DEFAULT_BOARD);
    assert_eq!(started(&with_words(&image, &own)).1, None, "another rig of this kind");
    let mut newer = own.clone();
    newer[1] += 1;
    let mut cut = own.clone();
    cut.truncate(own.len() - 40);
    cut[4] -= 40;
    let mut changed = own.clone();
    changed[100] ^= 1 << 20;
    for (what, words) in [
        ("for a Pico", words("quadruple-robust", named("pico").unwrap())),
        ("for three links", words("triple-multiarm", DEFAULT_BOARD)),
        ("of another layout", newer),
        ("without its end", cut),
        ("with another bit, and the checksum of that", changed),
    ] {
        assert_eq!(started(&with_words(&image, &words)), (State::Fault, Some(Fault::Table)), "{what}");
    }
}

#[test]
fn a_bit_that_is_not_as_it_was_linked_is_a_fault_in_code_and_tables() {
    let Some(image) = image() else { return };
    let (flash, code) = (image.flash(), code_bytes(&image));
    assert_eq!(started(&image).1, None);
    // In the vectors, which nothing reads before; in constants at the end of the code; in the tables.
    for at in [0x180, code - 8, code + 4 * 100, flash.len() - 1] {
        let changed = image.clone().with_bytes(FLASH + at as u32, vec![flash[at] ^ 0x10]);
        let (state, fault) = started(&changed);
        assert_eq!(state, State::Fault, "byte {at:#x}");
        assert!(matches!(fault, Some(Fault::Image | Fault::Table)), "byte {at:#x}: {fault:?}");
    }
}
