//! Bytes made small, for the page and for prebuilt images. In a browser, `site/page/lzma.js` has the way back.

use std::io::{Read, Write};

use lzma_rust2::{LzmaOptions, LzmaReader, LzmaWriter};

/// Smallest size, at the price of time.
const PRESET: u32 = 9;
/// Code is no table: where a byte stands says little about it, the byte before it says much.
const LITERAL_CONTEXT: u32 = 4;
const POSITION: u32 = 0;

/// The bytes as a `.lzma` file, whose header has their number.
pub(crate) fn packed(bytes: &[u8]) -> Vec<u8> {
    let options = LzmaOptions { lc: LITERAL_CONTEXT, pb: POSITION, ..LzmaOptions::with_preset(PRESET) };
    let written =
        LzmaWriter::new_use_header(Vec::new(), &options, Some(bytes.len() as u64)).and_then(|mut writer| {
            writer.write_all(bytes)?;
            writer.finish()
        });
    // Writing into memory does not fail.
    written.unwrap_or_default()
}

/// The bytes that were [`packed`].
///
/// # Errors
/// The reader's, if they are not, or if the end is missing.
pub(crate) fn unpacked(packed: &[u8]) -> std::io::Result<Vec<u8>> {
    /// A file that needs more memory is damaged (KiB).
    const MOST_MEMORY: u32 = 1 << 18;
    let mut bytes = Vec::new();
    LzmaReader::new_mem_limit(packed, MOST_MEMORY, None)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_packed_comes_back_and_half_of_it_does_not() {
        let bytes: Vec<u8> = (0..50_000_u32).map(|number| ((number * number) >> 7) as u8).collect();
        let small = packed(&bytes);
        assert!(small.len() < bytes.len());
        assert_eq!(unpacked(&small).unwrap(), bytes);
        assert!(unpacked(&small[..small.len() / 2]).is_err());
        assert!(unpacked(&[0xff; 100]).is_err());
    }
}
