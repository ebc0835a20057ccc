//! Bytes made small for the page: `page/lzma.js` has the way back.

use std::io::Write;

use lzma_rust2::{LzmaOptions, LzmaWriter};

/// Smallest size, at the price of time.
const PRESET: u32 = 9;
/// A module is no table: where a byte stands says little about it, the byte before it says much.
const LITERAL_CONTEXT: u32 = 4;
const POSITION: u32 = 0;

/// The bytes as a `.lzma` file, whose header has their number.
pub(super) fn packed(bytes: &[u8]) -> Vec<u8> {
    let options = LzmaOptions { lc: LITERAL_CONTEXT, pb: POSITION, ..LzmaOptions::with_preset(PRESET) };
    let written =
        LzmaWriter::new_use_header(Vec::new(), &options, Some(bytes.len() as u64)).and_then(|mut writer| {
            writer.write_all(bytes)?;
            writer.finish()
        });
    // Writing into memory does not fail.
    written.unwrap_or_default()
}
