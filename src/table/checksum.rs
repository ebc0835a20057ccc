//! The checksum of frames and gain tables.

use crate::table::part::{Part, Words};

/// Continues the CRC-32 (ISO-HDLC) `crc` of earlier bytes (0 if there are none) with `bytes`.
pub fn crc32(crc: u32, bytes: &[u8]) -> u32 {
    #[cfg(target_os = "none")]
    return with_a_small_table(crc, bytes);
    #[cfg(not(target_os = "none"))]
    {
        let mut hasher = crc32fast::Hasher::new_with_initial(crc);
        hasher.update(bytes);
        hasher.finalize()
    }
}

/// Takes four bits at a time: the lookup table needs 64 bytes of flash instead of the usual 1024.
#[cfg(any(test, target_os = "none"))]
fn with_a_small_table(crc: u32, bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!crc, |crc, &byte| {
        let crc = crc ^ u32::from(byte);
        let crc = (crc >> 4) ^ NIBBLES[(crc & 15) as usize];
        (crc >> 4) ^ NIBBLES[(crc & 15) as usize]
    })
}

/// [`crc32`] of the four bytes of `word`, the low one first.
fn crc32_of_word(crc: u32, word: u32) -> u32 {
    !(0..8).fold(!crc ^ word, |crc, _| (crc >> 4) ^ NIBBLES[(crc & 15) as usize])
}

/// Change of the register for each value of the four bits shifted out.
const NIBBLES: [u32; 16] = {
    let mut nibbles = [0; 16];
    let mut nibble = 0;
    while nibble < 16 {
        let mut crc = nibble as u32;
        let mut bit = 0;
        while bit < 4 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
            bit += 1;
        }
        nibbles[nibble] = crc;
        nibble += 1;
    }
    nibbles
};

/// Checksum of all words of `table`, as little-endian bytes in the order of declaration.
#[cfg(target_os = "none")]
pub(crate) fn checksum(table: &impl Part) -> u32 {
    let mut scan = ChecksumScan::default();
    loop {
        if let Some(crc) = scan.next_words(table, u32::MAX) {
            return crc;
        }
    }
}

/// The same, with many words at once.
#[cfg(not(target_os = "none"))]
pub(crate) fn checksum(table: &impl Part) -> u32 {
    let leaves = (0..).map_while(|mut leaf| table.part(&mut leaf));
    leaves.fold(0, |crc, leaf| {
        let (mut crc, mut bytes, mut length) = (crc, [0; 1024], 0);
        for word in (0..).map_while(|word| leaf.get(word)) {
            if length == bytes.len() {
                crc = crc32(crc, &bytes);
                length = 0;
            }
            // There is room: the length is a multiple of 4.
            bytes[length..length + 4].copy_from_slice(&word.to_le_bytes());
            length += 4;
        }
        crc32(crc, &bytes[..length])
    })
}

/// Computes the same checksum a few words per call, so that the work is spread over many ticks.
#[derive(Debug, Clone, Copy, Default)]
pub struct ChecksumScan<'t> {
    /// Number of the current leaf of the table, see [`Part::part`].
    at: u16,
    /// The current leaf, once it is found: finding it takes as long as several of its words.
    leaf: Option<Words<'t>>,
    /// Next word within the leaf.
    word: u16,
    /// Checksum of the words so far.
    crc: u32,
}

impl<'t> ChecksumScan<'t> {
    /// Adds the next word of `table`. After the last word, returns the checksum of all words and starts again.
    pub fn next(&mut self, table: &'t impl Part) -> Option<u32> {
        self.next_words(table, 1)
    }

    /// The same with up to `words` words. The end of a leaf counts as one, and so does the end of the table.
    ///
    /// Generic, because a call through a pointer would leave the stack of the image without a bound.
    pub fn next_words(&mut self, table: &'t impl Part, words: u32) -> Option<u32> {
        for _ in 0..words {
            if self.leaf.is_none() {
                self.leaf = table.part(&mut usize::from(self.at));
            }
            match self.leaf {
                Some(leaf) => self.next_of(leaf),
                None => return Some(core::mem::take(self).crc),
            }
        }
        None
    }

    /// Adds the next word of the current leaf, or, at its end, moves on to the next leaf.
    fn next_of(&mut self, leaf: Words<'t>) {
        match leaf.get(usize::from(self.word)) {
            Some(word) => (self.crc, self.word) = (crc32_of_word(self.crc, word), self.word + 1),
            None => (self.at, self.leaf, self.word) = (self.at + 1, None, 0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ChecksumScan, checksum, crc32, crc32_of_word, with_a_small_table};
    use crate::gains::TABLE;
    use proptest::prelude::*;

    #[test]
    fn the_check_value_of_the_catalogue_comes_out() {
        assert_eq!(crc32(0, b"123456789"), 0xcbf4_3926);
        assert_eq!(with_a_small_table(0, b"123456789"), 0xcbf4_3926);
    }

    proptest! {
        #[test]
        fn host_and_target_have_the_same_checksum(crc: u32, bytes: std::vec::Vec<u8>) {
            prop_assert_eq!(crc32(crc, &bytes), with_a_small_table(crc, &bytes));
        }
    }

    #[test]
    fn a_word_counts_as_its_bytes() {
        for (crc, word) in [(0, 0x0403_0201u32), (0x1234_5678, 0x8765_4321)] {
            assert_eq!(crc32_of_word(crc, word), crc32(crc, &word.to_le_bytes()));
        }
    }

    #[test]
    fn a_checksum_in_pieces_is_that_of_the_whole() {
        assert_eq!(crc32(crc32(0, b"1234"), b"56789"), 0xcbf4_3926);
    }

    #[test]
    fn a_scan_gives_the_same_checksum_however_many_words_it_takes_at_once() {
        for words in [1, 2, 7, 8, 1000, u32::MAX] {
            let mut scan = ChecksumScan::default();
            // Twice, because it starts again.
            for _ in 0..2 {
                let found = (0..10_000).find_map(|_| scan.next_words(&TABLE, words));
                assert_eq!(found, Some(checksum(&TABLE)), "{words}");
            }
        }
    }
}
