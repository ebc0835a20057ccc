//! The checksum of frames and gain tables.

use crate::table::part::Part;

/// Continues the CRC-32 (ISO-HDLC) `crc` of earlier bytes (0 if there are none) with `bytes`.
///
/// Takes four bits at a time: the lookup table needs 64 bytes instead of the usual 1024.
#[inline(never)]
pub fn crc32(crc: u32, bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!crc, |crc, &byte| {
        let crc = crc ^ u32::from(byte);
        let crc = (crc >> 4) ^ NIBBLES[(crc & 15) as usize];
        (crc >> 4) ^ NIBBLES[(crc & 15) as usize]
    })
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
pub(crate) fn checksum(table: &dyn Part) -> u32 {
    let leaves = (0..).map_while(|leaf| table.part(&mut { leaf }));
    leaves.fold(0, |crc, leaf| {
        (0..).map_while(|word| leaf.get(word)).fold(crc, |crc, word| crc32(crc, &word.to_le_bytes()))
    })
}

/// The same checksum, one word per call, so that the work is spread over many ticks.
#[derive(Debug, Clone, Copy, Default)]
pub struct ChecksumScan {
    /// Current leaf of the table, see [`Part::part`].
    leaf: u16,
    /// Next word within the leaf.
    word: u16,
    /// Checksum of the words so far.
    crc: u32,
}

impl ChecksumScan {
    /// Adds the next word of `table`. After the last word, returns the checksum of all words and starts again.
    pub fn next(&mut self, table: &dyn Part) -> Option<u32> {
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
