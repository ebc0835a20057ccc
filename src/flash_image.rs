//! The checksum of an image in flash. The tool that links an image writes it into the vector table; the board compares
//! it at every start, so code that was damaged before, by whatever, never drives the motor.

use core::ops::Range;

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
