//! The checksum of frames and gain tables.

use crate::table::part::Part;

/// CRC-32 (ISO-HDLC) of earlier bytes, whose checksum is `crc` (0 for none), and `bytes` after them.
///
/// Four bits at a time: a table of 64 bytes instead of the usual kilobyte.
#[inline(never)]
pub fn crc32(crc: u32, bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!crc, |crc, &byte| {
        let crc = crc ^ u32::from(byte);
        let crc = (crc >> 4) ^ NIBBLES[(crc & 15) as usize];
        (crc >> 4) ^ NIBBLES[(crc & 15) as usize]
    })
}

/// Change of the register for each value of the four bits that leave it.
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

/// Checksum of all words of `table` at once, as little-endian bytes in the order of declaration.
pub(crate) fn checksum(table: &impl Part) -> u32 {
    let leaves = (0..).map_while(|leaf| table.part(&mut { leaf }));
    leaves.fold(0, |crc, leaf| {
        (0..).map_while(|word| leaf.get(word)).fold(crc, |crc, word| crc32(crc, &word.to_le_bytes()))
    })
}

/// The same checksum word by word, to be spread over many ticks.
#[derive(Debug, Clone, Copy, Default)]
pub struct ChecksumScan {
    /// Leaf of the table, see [`Part::part`].
    leaf: u16,
    /// Word of the leaf.
    word: u16,
    /// Checksum of the words before.
    crc: u32,
}

impl ChecksumScan {
    /// Takes the next word of `table`. At the end gives the checksum of all words, and starts again.
    pub fn next(&mut self, table: &impl Part) -> Option<u32> {
        let Some(words) = table.part(&mut usize::from(self.leaf)) else {
            return Some(core::mem::take(self).crc);
        };
        match words.get(usize::from(self.word)) {
            Some(word) => (self.crc, self.word) = (crc32(self.crc, &word.to_le_bytes()), self.word + 1),
            None => (self.leaf, self.word) = (self.leaf + 1, 0),
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::crc32;

    #[test]
    fn the_check_value_of_the_catalogue_comes_out() {
        assert_eq!(crc32(0, b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn a_checksum_in_pieces_is_that_of_the_whole() {
        assert_eq!(crc32(crc32(0, b"1234"), b"56789"), 0xcbf4_3926);
    }
}
