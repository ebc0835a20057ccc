//! Files in the format UF2, which the boot loader of a Raspberry Pi Pico or Pico 2 writes into its flash.

use object::Endianness;
use object::read::elf::{ElfFile32, ProgramHeader};

use super::elf::ElfError;
use std::path::Path;

/// Flash of a Pico, and the first half of a Pico 2's.
const FLASH: std::ops::Range<u32> = 0x1000_0000..0x1020_0000;
/// Bytes in a block, which is a page of the flash.
const PAGE: usize = 256;

/// The UF2 file of this family for an ELF file: a block of 512 bytes for each page of flash, from the first to the last
/// in use.
///
/// # Errors
/// [`ElfError`] if it is not an ELF file, or puts nothing into flash.
pub fn uf2(family: u32, path: &Path, elf: &[u8]) -> Result<Vec<u8>, ElfError> {
    let format = |source| ElfError::Format { path: path.to_owned(), source };
    let file = ElfFile32::<Endianness>::parse(elf).map_err(format)?;
    let mut flash = Vec::new();
    for segment in file.elf_program_headers() {
        let address = segment.p_paddr(file.endian());
        let bytes = segment.data(file.endian(), elf).unwrap_or_default();
        if segment.p_type(file.endian()) == object::elf::PT_LOAD && FLASH.contains(&address) {
            let begin = (address - FLASH.start) as usize;
            // What no segment fills stays erased, as the image's checksum takes it.
            flash.resize(flash.len().max(begin + bytes.len()), 0xff);
            flash[begin..begin + bytes.len()].copy_from_slice(bytes);
        }
    }
    if flash.is_empty() {
        return Err(ElfError::Missing { path: path.to_owned(), what: "contents of a Pico's flash" });
    }
    let pages = flash.len().div_ceil(PAGE);
    let blocks = flash.chunks(PAGE).enumerate();
    Ok(blocks.flat_map(|(number, page)| block(family, number as u32, pages as u32, page)).collect())
}

/// A block: <https://github.com/microsoft/uf2>.
fn block(family: u32, number: u32, blocks: u32, page: &[u8]) -> [u8; 512] {
    /// The flags say that a family follows.
    const FAMILY_PRESENT: u32 = 0x2000;
    let address = FLASH.start + number * PAGE as u32;
    let words = [0x0a32_4655, 0x9e5d_5157, FAMILY_PRESENT, address, PAGE as u32, number, blocks, family];
    let mut block = [0; 512];
    for (place, word) in block.chunks_exact_mut(4).zip(words) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    block[32..32 + page.len()].copy_from_slice(page);
    block[508..].copy_from_slice(&0x0ab1_6f30_u32.to_le_bytes());
    block
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_has_the_fields_of_the_format() {
        let block = block(0xe48b_ff56, 2, 3, &[7; 3]);
        let word = |at: usize| u32::from_le_bytes(block[at..at + 4].try_into().unwrap());
        assert_eq!((word(0), word(4), word(508)), (0x0a32_4655, 0x9e5d_5157, 0x0ab1_6f30));
        assert_eq!((word(12), word(16), word(20), word(24)), (0x1000_0200, 256, 2, 3));
        assert_eq!(word(28), 0xe48b_ff56);
        assert_eq!(block[32..36], [7, 7, 7, 0]);
    }

    #[test]
    fn other_files_are_refused() {
        assert!(uf2(0, Path::new("x"), b"not an ELF file").unwrap_err().to_string().contains("ELF"));
    }
}
