//! The checksum that an image reports of itself, so that a person can tell which image a board runs; and the hash of a
//! file.

use sha2::{Digest, Sha256};
use upright::table::checksum::crc32;
use upright_board::Image;

/// CRC-32 of what an image puts into flash: the firmware's [`Info::image`](upright::protocol::message::Info::image).
pub fn flash_checksum(image: &Image) -> u32 {
    crc32(0, &image.flash())
}

/// SHA-256 of a file's `bytes`, in hexadecimal digits.
pub fn file_hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |hash, byte| hash + &format!("{byte:02x}"))
}
