//! Lookup from the address of an instruction to its source, by the debug information of an image.

use addr2line::Context;
use addr2line::gimli::{Dwarf, EndianSlice, Error, LittleEndian, SectionId};
use object::{Object, ObjectSection};

/// Debug information that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct LinesError(#[from] Error);

/// Lookup from addresses to source lines and functions, by the debug information of an image.
pub struct Lines<'a> {
    context: Context<EndianSlice<'a, LittleEndian>>,
}

impl<'a> Lines<'a> {
    /// Reads the debug information of an ELF file, given by its bytes; a file without any has no lines.
    ///
    /// # Errors
    /// [`LinesError`] if it is damaged.
    pub fn parse(file: &'a [u8]) -> Result<Self, LinesError> {
        let elf = object::read::elf::ElfFile32::<object::Endianness>::parse(file).ok();
        let section = |id: SectionId| {
            let found = elf.as_ref().and_then(|elf| elf.section_by_name(id.name()));
            let data = found.and_then(|section| section.data().ok()).unwrap_or_default();
            Ok::<_, Error>(EndianSlice::new(data, LittleEndian))
        };
        Ok(Self { context: Context::from_dwarf(Dwarf::load(section)?)? })
    }

    /// Pieces of the code between two addresses: the bytes of each, and its source file, empty if it is unknown.
    ///
    /// # Errors
    /// [`LinesError`] if the debug information is damaged.
    pub fn files(&self, addresses: std::ops::Range<u32>) -> Result<Vec<(u32, &str)>, LinesError> {
        let (begin, end) = (u64::from(addresses.start), u64::from(addresses.end));
        let pieces = self.context.find_location_range(begin, end)?;
        let with_bytes = pieces.map(|(address, length, location)| {
            let bytes = (address + length).min(end).saturating_sub(address.max(begin)) as u32;
            (bytes, location.file.unwrap_or_default())
        });
        Ok(with_bytes.collect())
    }

    /// File and line of an instruction, as `src/image/main.rs:42`. If a library function is inlined there, this is the
    /// line of the program's own code that it is inlined into.
    pub fn line(&self, address: u32) -> Option<String> {
        let mut frames = self.context.find_frames(address.into()).skip_all_loads().ok()?;
        let mut innermost = None;
        while let Ok(Some(frame)) = frames.next() {
            let Some((file, line)) = frame.location.and_then(|place| Some((place.file?, place.line?))) else {
                continue;
            };
            let text = format!("{file}:{line}");
            if !["/registry/", "/library/"].iter().any(|library| file.replace('\\', "/").contains(library)) {
                return Some(text);
            }
            innermost.get_or_insert(text);
        }
        innermost
    }

    /// Linker names of the functions that an instruction belongs to: first the innermost inlined one, last the one
    /// that is not inlined.
    pub fn functions(&self, address: u32) -> Vec<String> {
        let Ok(mut frames) = self.context.find_frames(address.into()).skip_all_loads() else {
            return Vec::new();
        };
        let mut names = Vec::new();
        while let Ok(Some(frame)) = frames.next() {
            let name = frame.function.and_then(|function| Some(function.raw_name().ok()?.into_owned()));
            names.push(name.unwrap_or_default());
        }
        names
    }
}
