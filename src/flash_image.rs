//! What the tool writes into an image after it was compiled: the tables of a rig, behind the code, and a checksum.
//!
//! The code of an image is the same for all rigs of a size, so that a rig needs no compiler. Behind it, from the next
//! word on, follow the words of
//!
//! | words | content |
//! |---|---|
//! | 1 | [`MARK`] |
//! | 1 | [`LAYOUT`] |
//! | 1 | CRC-32 of the board's name |
//! | 1 | states, and sensors times 65536 |
//! | 1 | number of words of the gain table |
//! | 1 | number of words of the swing-up; 0 without one |
//! | … | the gain table, as [`WordReader`] takes it |
//! | … | the swing-up |
//!
//! The checksum of all of it is in the vector table; the board compares it at every start, so an image that was damaged
//! before, by whatever, never drives the motor.

use core::ops::Range;

use crate::table::checksum::crc32;
use crate::table::{Fill, FillTransitions, TransitionTable, WordReader};

/// First word of the tables: "UPRT" in memory.
pub const MARK: u32 = u32::from_le_bytes(*b"UPRT");

/// Version of their layout; another one is refused.
pub const LAYOUT: u32 = 1;

/// Number of words before the gain table.
const HEADER: usize = 6;

/// The tables in an image for one board and one size of rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageTables<'t> {
    /// All words, for the checksum; none, if there are no tables.
    pub words: &'t [u32],
    /// Those of the gain table; none, if they are for another board or size.
    gains: &'t [u32],
    /// Those of the swing-up.
    swing_up: &'t [u32],
}

impl<'t> ImageTables<'t> {
    /// What comes before the words of the gain table and of the swing-up, if these are so many.
    pub fn header(
        board: &str,
        [states, sensors]: [usize; 2],
        [gains, swing_up]: [usize; 2],
    ) -> [u32; HEADER] {
        let size = (states | sensors << 16) as u32;
        [MARK, LAYOUT, crc32(0, board.as_bytes()), size, gains as u32, swing_up as u32]
    }

    /// The tables at the beginning of `flash`, in an image for `board` and rigs of this size. Words that are no tables,
    /// or are those of something else, are taken as a table of zeros, which the firmware refuses.
    pub fn at(flash: &'t [u32], board: &str, size: [usize; 2]) -> Self {
        let none = Self { words: &[], gains: &[], swing_up: &[] };
        let Some(&[.., gains, swing_up]) = flash.first_chunk::<HEADER>() else { return none };
        let lengths = [gains as usize, swing_up as usize];
        let Some((gains, rest)) = flash.get(HEADER..).and_then(|rest| rest.split_at_checked(lengths[0]))
        else {
            return none;
        };
        let Some(swing_up) = rest.get(..lengths[1]) else { return none };
        let Some(words) = flash.get(..HEADER + gains.len() + swing_up.len()) else { return none };
        match words.starts_with(&Self::header(board, size, lengths)) {
            true => Self { words, gains, swing_up },
            false => Self { words, ..none },
        }
    }

    /// Fills the gain table.
    pub fn fill_gains(&self, table: &mut impl Fill<'t>) {
        table.fill(&mut WordReader::new(self.gains));
    }

    /// Fills the swing-up, with this room for transitions.
    pub fn fill_swing_up(&self, table: &mut impl FillTransitions<'t>, room: &'t mut [TransitionTable<'t>]) {
        let mut words = WordReader::new(self.swing_up);
        table.fill(&mut words);
        table.fill_transitions(words.skipped(), room);
    }
}

/// Numbers of the words of the vector table that hold the checksum: ARM reserves them on every Cortex-M, and no
/// processor reads them (Armv7-M Architecture Reference Manual, B1.5.3).
pub const REFERENCE: Range<usize> = 8..10;

/// Sum, and sum of the sums, of words, modulo 2³² (Fletcher's checksum): a bit that changes changes the first, words
/// that are swapped the second. A word takes a few cycles, and its CRC-32 would take a hundred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WordSums {
    /// Sum of the words.
    pub plain: u32,
    /// Sum of these sums. It identifies an image: see [`Info::image`](crate::protocol::message::Info::image).
    pub weighted: u32,
}

impl WordSums {
    /// Continues with these words.
    #[inline]
    pub fn add(&mut self, words: &[u32]) {
        for &word in words {
            self.plain = self.plain.wrapping_add(word);
            self.weighted = self.weighted.wrapping_add(self.plain);
        }
    }

    /// Of all words of `image`, which begins with the vector table, but those that hold its checksum.
    pub fn of_image(image: &[u32]) -> Self {
        let mut sums = Self::default();
        sums.add(image.get(..REFERENCE.start).unwrap_or_default());
        sums.add(image.get(REFERENCE.end..).unwrap_or_default());
        sums
    }

    /// What the words of `image` that hold its checksum say; 0 if nothing has been written there.
    #[inline]
    pub fn carried_by(image: &[u32]) -> Self {
        match image.get(REFERENCE) {
            Some(&[plain, weighted]) => Self { plain, weighted },
            _ => Self::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_of_all_bits_but_its_own_words() {
        let mut image: std::vec::Vec<u32> = (1..60).map(|word| word * 0x0123_4567).collect();
        let (whole, carried) = (WordSums::of_image(&image), WordSums::carried_by(&image));
        assert_eq!((carried.plain, carried.weighted), (image[8], image[9]));
        for at in 0..image.len() {
            for bit in 0..32 {
                image[at] ^= 1 << bit;
                let found = WordSums::of_image(&image);
                assert_eq!(found == whole, REFERENCE.contains(&at), "word {at}, bit {bit}");
                image[at] ^= 1 << bit;
            }
        }
        assert_eq!(WordSums::carried_by(&image[..9]), WordSums::default());
    }

    #[test]
    fn the_sums_notice_every_two_words_that_are_swapped() {
        let words: std::vec::Vec<u32> = (1..60).map(|word| word * 0x0123_4567).collect();
        let sums = |words: &[u32]| {
            let mut sums = WordSums::default();
            words.chunks(7).for_each(|part| sums.add(part));
            sums
        };
        for at in 0..words.len() {
            let mut swapped = words.clone();
            swapped.swap(at, 0);
            assert_eq!(sums(&swapped) == sums(&words), at == 0, "word {at}");
        }
    }
}
