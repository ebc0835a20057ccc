//! The checksum of an image in flash. The tool that links an image writes it into the vector table; the board compares
//! it at every start, so code that was damaged before, by whatever, never drives the motor.

use crate::table::checksum::crc32;

/// Number of the word of the vector table that holds the checksum: ARM reserves it on every Cortex-M, and no processor
/// reads it (Armv7-M Architecture Reference Manual, B1.5.3).
pub const REFERENCE_WORD: usize = 8;

/// Its place in the image (bytes).
const REFERENCE: core::ops::Range<usize> = 4 * REFERENCE_WORD..4 * (REFERENCE_WORD + 1);

/// CRC-32 of `image`, which begins with the vector table, without the word that holds the checksum.
pub fn checksum(image: &[u8]) -> u32 {
    let before = image.get(..REFERENCE.start).unwrap_or(image);
    let after = image.get(REFERENCE.end..).unwrap_or_default();
    crc32(crc32(0, before), after)
}

/// The checksum that `image` had when it was linked; 0 if nothing has been written there.
pub fn reference(image: &[u8]) -> u32 {
    let word = image.get(REFERENCE).and_then(|bytes| bytes.try_into().ok());
    word.map_or(0, u32::from_le_bytes)
}

/// Sum, and sum of the sums, of words, modulo 2³² (Fletcher's checksum): a bit that changes changes both. For the
/// checks while the motor runs, because a word takes a few cycles, and its CRC-32 a hundred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WordSums {
    plain: u32,
    weighted: u32,
}

impl WordSums {
    /// Continues with these words.
    pub fn add(&mut self, words: &[u32]) {
        for &word in words {
            self.plain = self.plain.wrapping_add(word);
            self.weighted = self.weighted.wrapping_add(self.plain);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_of_all_bits_but_its_own_word() {
        let mut image: std::vec::Vec<u8> = (0..100).collect();
        let whole = checksum(&image);
        assert_eq!(reference(&image), 0x2322_2120);
        for at in 0..image.len() {
            for bit in 0..8 {
                image[at] ^= 1 << bit;
                assert_eq!(checksum(&image) == whole, REFERENCE.contains(&at), "byte {at}, bit {bit}");
                image[at] ^= 1 << bit;
            }
        }
        assert_eq!((reference(&image[..35]), checksum(&[])), (0, 0));
    }

    #[test]
    fn the_sums_notice_every_bit_and_every_two_words_that_are_swapped() {
        let words: std::vec::Vec<u32> = (1..60).map(|word| word * 0x0123_4567).collect();
        let sums = |words: &[u32]| {
            let mut sums = WordSums::default();
            words.chunks(7).for_each(|part| sums.add(part));
            sums
        };
        let whole = sums(&words);
        for at in 0..words.len() {
            for bit in 0..32 {
                let mut changed = words.clone();
                changed[at] ^= 1 << bit;
                assert_ne!(sums(&changed), whole, "word {at}, bit {bit}");
            }
            let mut swapped = words.clone();
            swapped.swap(at, 0);
            assert_eq!(sums(&swapped) == whole, at == 0, "word {at}");
        }
    }
}
