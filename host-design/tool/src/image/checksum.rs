//! The checksum that an image carries and reports of itself, so that a damaged one never arms, and a person can tell
//! which image a board runs; and the hash of a file.

use std::path::Path;

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSection};
use sha2::{Digest, Sha256};
use upright::flash_image::{REFERENCE, WordSums};
use upright_board::Image;

use super::elf::{ElfError, ImageChip};

/// Checksum of what an image puts into flash: the firmware's [`Info::image`](upright::protocol::message::Info::image).
pub fn flash_checksum(image: &Image) -> u32 {
    of_image(&image.flash()).weighted
}

/// The checksum of the `bytes` of an image.
fn of_image(bytes: &[u8]) -> WordSums {
    let words: Vec<u32> = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    WordSums::of_image(&words)
}

/// The ELF file `elf` with the [checksum](upright::flash_image) of its image in the vector table. Without it, the
/// firmware does not arm.
///
/// # Errors
/// [`ElfError`] if it is not the ELF file of an image.
pub(super) fn with_reference(path: &Path, mut elf: Vec<u8>) -> Result<Vec<u8>, ElfError> {
    let format = |source| ElfError::Format { path: path.to_owned(), source };
    let missing = |what| ElfError::Missing { path: path.to_owned(), what };
    let file = ElfFile32::<Endianness>::parse(&elf[..]).map_err(format)?;
    let table = file.section_by_name(".vector_table").ok_or_else(|| missing("section .vector_table"))?;
    let (begin, mut place) = (table.address(), None);
    let (mut flash, word) = (Vec::new(), begin + 4 * REFERENCE.start as u64);
    for segment in file.elf_program_headers() {
        let address = u64::from(segment.p_paddr(file.endian()));
        let bytes = segment.data(file.endian(), &elf[..]).unwrap_or_default();
        let end = address + bytes.len() as u64;
        if segment.p_type(file.endian()) != object::elf::PT_LOAD
            || !ImageChip::has_flash_at(address)
            || end <= begin
        {
            continue;
        }
        // What no segment fills stays erased.
        let offset = address.max(begin) - begin;
        let bytes = &bytes[begin.saturating_sub(address) as usize..];
        flash.resize(flash.len().max(offset as usize + bytes.len()), 0xff);
        flash[offset as usize..][..bytes.len()].copy_from_slice(bytes);
        if (address..end).contains(&word) {
            place = Some((u64::from(segment.p_offset(file.endian())) + word - address) as usize);
        }
    }
    let place =
        place.filter(|place| place + 8 <= elf.len()).ok_or_else(|| missing("vector table in flash"))?;
    let WordSums { plain, weighted } = of_image(&flash);
    elf[place..place + 4].copy_from_slice(&plain.to_le_bytes());
    elf[place + 4..place + 8].copy_from_slice(&weighted.to_le_bytes());
    Ok(elf)
}

/// SHA-256 of a file's `bytes`, in hexadecimal digits.
pub fn file_hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |hash, byte| hash + &format!("{byte:02x}"))
}
