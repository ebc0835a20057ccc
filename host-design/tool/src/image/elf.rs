//! An image as the linker left it: sections, functions, variables and the vector table.

use std::path::{Path, PathBuf};

use object::read::elf::ElfFile32;
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use upright::flash_image::REFERENCE;

/// A file that is not an image of this firmware.
#[derive(Debug, thiserror::Error)]
pub enum ElfError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not a 32-bit ELF file.
    #[error("{}: not a 32-bit ELF file ({source}); `upright firmware build` makes one", path.display())]
    Format {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: object::Error,
    },
    /// The file cannot be changed.
    #[error("{}: {source}", path.display())]
    Rewrite {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: object::build::Error,
    },
    /// A section or symbol that every image has is missing.
    #[error("{}: no {what}; `upright firmware build` makes an image that has it", path.display())]
    Missing {
        /// Which file.
        path: PathBuf,
        /// What is missing.
        what: &'static str,
    },
}

/// A section that is loaded or cleared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LinkedSection {
    pub(crate) name: String,
    pub(crate) address: u32,
    pub(crate) bytes: u32,
    pub(crate) in_flash: bool,
    pub(crate) in_ram: bool,
}

/// The microcontroller of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ImageChip {
    /// Code and constants stay in flash.
    F4,
    /// Code and constants are copied into RAM.
    Rp2040,
    /// The same, on a processor as the first one's.
    Rp2350,
}

impl ImageChip {
    /// Only an RP2040's image has a second stage of the boot loader, only an RP2350's says what it is.
    fn of(elf: &ElfFile32) -> Self {
        let has = |name| elf.section_by_name(name).is_some_and(|section| section.size() > 0);
        match (has(".boot2"), has(".start_block")) {
            (true, _) => Self::Rp2040,
            (false, true) => Self::Rp2350,
            (false, false) => Self::F4,
        }
    }

    /// Whether any of the chips has flash there.
    pub(super) fn has_flash_at(address: u64) -> bool {
        [Self::F4, Self::Rp2040].into_iter().any(|chip| chip.flash().contains(&address))
    }

    fn flash(self) -> std::ops::Range<u64> {
        match self {
            Self::F4 => 0x0800_0000..0x1000_0000,
            Self::Rp2040 | Self::Rp2350 => 0x1000_0000..0x1020_0000,
        }
    }

    /// Largest frame that the processor stacks at exception entry (bytes): 8 words and one for alignment (Armv6-M
    /// Architecture Reference Manual, B1.5.6), and 18 of the floating-point unit (Armv7-M, B1.5.7).
    pub(crate) fn exception_frame(self) -> u32 {
        match self {
            Self::F4 | Self::Rp2350 => 108,
            Self::Rp2040 => 36,
        }
    }
}

/// A function, or a variable or constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Item {
    /// Demangled, with its path.
    pub(crate) name: String,
    pub(crate) address: u32,
    pub(crate) size: u32,
}

/// Machine code without the constants between instructions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Code {
    pub(crate) address: u32,
    pub(crate) halfwords: Vec<u16>,
}

/// An image, read from its ELF file.
#[derive(Debug)]
pub struct LinkedImage {
    pub(crate) bytes: Vec<u8>,
    pub(crate) sections: Vec<LinkedSection>,
    /// By address, none overlapping.
    pub(crate) functions: Vec<Item>,
    pub(crate) data: Vec<Item>,
    /// `(address, instructions follow)`, by address: the mapping symbols `$t` and `$d` of the Arm ELF specification.
    mapping: Vec<(u32, bool)>,
    /// Sections of code: their addresses and bytes.
    code: Vec<(u32, Vec<u8>)>,
    pub(crate) chip: ImageChip,
    /// Handlers by their number in the vector table, from 1 (reset).
    pub(crate) vectors: Vec<(usize, u32)>,
    /// Where the stack begins, and how many bytes memory.x reserves for it.
    pub(crate) stack_start: u32,
    pub(crate) stack_reserved: u32,
}

impl LinkedImage {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// [`ElfError`] if it cannot be read or is not an image of this firmware.
    pub fn read(path: &Path) -> Result<Self, ElfError> {
        let bytes = std::fs::read(path).map_err(|source| ElfError::Read { path: path.to_owned(), source })?;
        let format = |source| ElfError::Format { path: path.to_owned(), source };
        let missing = |what| ElfError::Missing { path: path.to_owned(), what };
        let elf: ElfFile32 = ElfFile32::parse(&bytes[..]).map_err(format)?;

        let chip = ImageChip::of(&elf);
        let sections = sections(&elf, chip).map_err(format)?;
        let code = code_sections(&elf).map_err(format)?;
        code.first().ok_or_else(|| missing("section of code"))?;
        let table = elf.section_by_name(".vector_table").ok_or_else(|| missing("section .vector_table"))?;
        let vectors = handlers(table.data().map_err(format)?);

        let (mut functions, mut data, mut mapping) = (Vec::new(), Vec::new(), Vec::new());
        let (mut stack_start, mut stack_end) = (None, None);
        for symbol in elf.symbols() {
            let name = symbol.name().map_err(format)?;
            let address = symbol.address() as u32;
            let item = |address| Item {
                name: format!("{:#}", rustc_demangle::demangle(name)),
                address,
                size: symbol.size() as u32,
            };
            match name {
                "_stack_start" => stack_start = Some(address),
                "_stack_end" => stack_end = Some(address),
                _ if name == "$t" || name.starts_with("$t.") => mapping.push((address, true)),
                _ if name == "$d" || name.starts_with("$d.") => mapping.push((address, false)),
                _ if symbol.kind() == SymbolKind::Text => functions.push(item(address & !1)),
                _ if symbol.kind() == SymbolKind::Data && symbol.size() > 0 => data.push(item(address)),
                _ => {}
            }
        }
        let (stack_start, stack_reserved) = match (stack_start, stack_end) {
            (Some(start), Some(end)) if start > end => (start, start - end),
            _ => return Err(missing("symbols _stack_start above _stack_end")),
        };
        mapping.sort_unstable();
        let functions = without_aliases(functions, &code);
        let data = without_overlap(data);
        Ok(Self {
            sections,
            functions,
            data,
            mapping,
            code,
            chip,
            vectors,
            stack_start,
            stack_reserved,
            bytes,
        })
    }

    /// The address of the function with this name.
    pub fn address_of(&self, function: &str) -> Option<u32> {
        self.functions.iter().find(|item| item.name == function).map(|item| item.address)
    }

    /// The machine code of a function.
    pub(crate) fn code(&self, function: &Item) -> Vec<Code> {
        let Some((base, text)) = code_at(&self.code, function.address) else { return Vec::new() };
        let end = base + text.len() as u32;
        let mut pieces: Vec<Code> = Vec::new();
        let mut address = function.address;
        while address < function.address + function.size {
            let marks = self.mapping.partition_point(|(mark, _)| *mark <= address);
            let next = self.mapping.get(marks).map_or(u32::MAX, |(mark, _)| *mark);
            let end = next.min(function.address + function.size).min(end);
            // Bytes that no mapping symbol precedes are code: some assemblers emit none.
            if marks == 0 || self.mapping[marks - 1].1 {
                let from = (address - base) as usize;
                let (halfwords, _) = text[from..(end - base) as usize].as_chunks::<2>();
                let halfwords = halfwords.iter().map(|bytes| u16::from_le_bytes(*bytes)).collect();
                pieces.push(Code { address, halfwords });
            }
            address = end;
        }
        pieces
    }

    /// The section that an address is in.
    pub(crate) fn section_at(&self, address: u32) -> Option<&LinkedSection> {
        let contains =
            |section: &&LinkedSection| (section.address..section.address + section.bytes).contains(&address);
        self.sections.iter().find(contains)
    }

    /// The word at an address in the code section, such as a constant between instructions.
    pub(crate) fn word_in_code(&self, address: u32) -> Option<u32> {
        let (base, text) = code_at(&self.code, address)?;
        let at = (address - base) as usize;
        let bytes = text.get(at..at + 4)?;
        bytes.try_into().ok().map(u32::from_le_bytes)
    }

    /// The function that contains an address.
    pub(crate) fn function_at(&self, address: u32) -> Option<usize> {
        let after = self.functions.partition_point(|function| function.address <= address);
        let index = after.checked_sub(1)?;
        let function = &self.functions[index];
        (address < function.address + function.size).then_some(index)
    }
}

/// The handlers in a vector table: number and address. Two words hold the image's checksum.
fn handlers(table: &[u8]) -> Vec<(usize, u32)> {
    let (words, _) = table.as_chunks::<4>();
    let words = words.iter().map(|word| u32::from_le_bytes(*word)).enumerate().skip(1);
    words
        .filter(|(number, word)| *word != 0 && !REFERENCE.contains(number))
        .map(|(number, word)| (number, word & !1))
        .collect()
}

/// Addresses and bytes of the sections of code.
fn code_sections(elf: &ElfFile32) -> Result<Vec<(u32, Vec<u8>)>, object::Error> {
    let code = elf.sections().filter(|section| section.kind() == SectionKind::Text);
    code.map(|section| Ok((section.address() as u32, section.data()?.to_vec()))).collect()
}

/// The section of code that an address is in.
fn code_at(code: &[(u32, Vec<u8>)], address: u32) -> Option<(u32, &[u8])> {
    let contains = |(base, bytes): &&(u32, Vec<u8>)| {
        address.checked_sub(*base).is_some_and(|at| (at as usize) < bytes.len())
    };
    code.iter().find(contains).map(|(base, bytes)| (*base, bytes.as_slice()))
}

/// The sections that are loaded or cleared.
fn sections(elf: &ElfFile32, chip: ImageChip) -> Result<Vec<LinkedSection>, object::Error> {
    let mut sections = Vec::new();
    for section in elf.sections() {
        let (name, address) = (section.name()?, section.address());
        if address == 0 || section.size() == 0 {
            continue; // debugging information
        }
        let in_ram = !chip.flash().contains(&address);
        let in_flash = section.kind() != SectionKind::UninitializedData
            && section.file_range().is_some_and(|(_, size)| size > 0);
        sections.push(LinkedSection {
            name: name.to_owned(),
            address: address as u32,
            bytes: section.size() as u32,
            in_flash,
            in_ram,
        });
    }
    Ok(sections)
}

/// Counts each byte once: the compiler merges small variables into one, and keeps their names.
fn without_overlap(mut data: Vec<Item>) -> Vec<Item> {
    data.sort_by_key(|item| (item.address, std::cmp::Reverse(item.size)));
    let mut counted = 0;
    for item in &mut data {
        let end = item.address + item.size;
        item.address = item.address.max(counted);
        item.size = end.saturating_sub(item.address);
        counted = counted.max(end);
    }
    data.retain(|item| item.size > 0);
    data
}

/// Keeps one name for each address, if possible one with a size; a function without a size, from assembly, extends to
/// the next function, or to the end of its section.
fn without_aliases(mut functions: Vec<Item>, code: &[(u32, Vec<u8>)]) -> Vec<Item> {
    functions.retain(|function| code_at(code, function.address).is_some());
    functions.sort_by_key(|function| (function.address, std::cmp::Reverse(function.size)));
    functions.dedup_by_key(|function| function.address);
    for index in 0..functions.len() {
        let next = functions.get(index + 1).map_or(u32::MAX, |next| next.address);
        let function = &mut functions[index];
        let end = code_at(code, function.address).map_or(next, |(base, bytes)| base + bytes.len() as u32);
        let next = next.min(end);
        if function.size == 0 {
            function.size = next.saturating_sub(function.address);
        }
        function.size = function.size.min(next.saturating_sub(function.address));
    }
    functions.retain(|function| function.size > 0);
    functions
}
