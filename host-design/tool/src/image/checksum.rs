//! The checksum by which an image knows itself, and a person the image on a board.

use upright::table::checksum::crc32;
use upright_board::Image;

/// CRC-32 of what an image puts into flash: the firmware's [`Info::image`](upright::protocol::message::Info::image).
pub fn flash_checksum(image: &Image) -> u32 {
    crc32(0, &image.flash())
}
