//! Firmware images: the contents of flash that an ELF file defines.

use std::sync::Arc;

use object::{Object, ObjectSymbol};

use crate::lines::Lines;

/// A firmware image: contents of flash, symbols and debug information.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    pub(crate) segments: Vec<(u32, Vec<u8>)>,
    /// Name, address, bytes.
    symbols: Vec<(String, u32, u32)>,
    /// The whole file, for its debug information.
    file: Arc<[u8]>,
}

/// Why a file is not an image for the chip.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// Not an ELF file.
    #[error("not an ELF file: {0}")]
    Elf(#[from] object::read::Error),
    /// No part of the file is loaded into flash.
    #[error("the file puts nothing into flash at 0x0800_0000")]
    Empty,
    /// A part of the file is loaded outside flash.
    #[error("the file puts {bytes} bytes to {address:#010x}, where no flash is")]
    Outside {
        /// Load address of that part.
        address: u64,
        /// Its size in bytes.
        bytes: u64,
    },
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// [`ImageError`]
    pub fn from_elf(bytes: &[u8]) -> Result<Self, ImageError> {
        let file = object::read::elf::ElfFile32::<object::Endianness>::parse(bytes)?;
        let mut segments = Vec::new();
        for segment in file.elf_program_headers() {
            use object::read::elf::ProgramHeader;
            let endian = file.endian();
            if segment.p_type(endian) != object::elf::PT_LOAD || segment.p_filesz(endian) == 0 {
                continue;
            }
            let address = segment.p_paddr(endian);
            let data = segment.data(endian, bytes).map_err(|()| ImageError::Empty)?;
            if !(0x0800_0000..0x0810_0000).contains(&address) {
                return Err(ImageError::Outside { address: address.into(), bytes: data.len() as u64 });
            }
            segments.push((address, data.to_vec()));
        }
        if segments.is_empty() {
            return Err(ImageError::Empty);
        }
        let symbols = file
            .symbols()
            .filter_map(|symbol| {
                Some((symbol.name().ok()?.to_owned(), symbol.address() as u32, symbol.size() as u32))
            })
            .collect();
        Ok(Self { segments, symbols, file: bytes.into() })
    }

    /// An image of raw bytes at the beginning of flash, vector table first, without symbols: for directed programs.
    pub fn from_flash(bytes: Vec<u8>) -> Self {
        Self { segments: vec![(0x0800_0000, bytes)], symbols: Vec::new(), file: Arc::default() }
    }

    /// The same image with other bytes at an address of flash: for negative controls.
    pub fn with_bytes(mut self, address: u32, bytes: Vec<u8>) -> Self {
        self.segments.push((address, bytes));
        self
    }

    /// Lookup from addresses to source lines; `None` if the file has no debug information that can be read.
    pub fn lines(&self) -> Option<Lines<'_>> {
        Lines::parse(&self.file).ok().filter(|_| !self.file.is_empty())
    }

    /// File and line of the instruction at an address, if the debug information contains it.
    pub fn source_line(&self, address: u32) -> Option<String> {
        self.lines()?.line(address)
    }

    /// Address of the symbol with this (mangled) name.
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.iter().find(|(known, ..)| known == name).map(|&(_, address, _)| address)
    }

    /// Address range of the first function or variable whose (mangled) name contains `part_of_name`.
    pub fn object(&self, part_of_name: &str) -> Option<std::ops::Range<u32>> {
        let found = self.symbols.iter().find(|(name, _, bytes)| *bytes > 0 && name.contains(part_of_name));
        found.map(|&(_, address, bytes)| address..address + bytes)
    }

    /// Contents of flash up to the end of the image; gaps are erased (0xff).
    pub fn flash(&self) -> Vec<u8> {
        let mut flash = vec![0xff; self.end()];
        for (address, bytes) in &self.segments {
            let begin = (address & 0x00ff_ffff) as usize;
            flash[begin..begin + bytes.len()].copy_from_slice(bytes);
        }
        flash
    }

    /// Number of bytes from the beginning of flash to the end of the image.
    pub fn end(&self) -> usize {
        let end = |(address, bytes): &(u32, Vec<u8>)| (address & 0x00ff_ffff) as usize + bytes.len();
        self.segments.iter().map(end).max().unwrap_or(0)
    }
}
