//! An image as the linker left it: sections, functions, variables and the vector table.

use std::path::{Path, PathBuf};

use object::read::elf::ElfFile32;
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

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
    pub(crate) bytes: u32,
    pub(crate) in_flash: bool,
    pub(crate) in_ram: bool,
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
    text: (u32, Vec<u8>),
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

        let sections = sections(&elf).map_err(format)?;
        let text = elf.section_by_name(".text").ok_or_else(|| missing("section .text"))?;
        let text = (text.address() as u32, text.data().map_err(format)?.to_vec());
        let table = elf.section_by_name(".vector_table").ok_or_else(|| missing("section .vector_table"))?;
        let (words, _) = table.data().map_err(format)?.as_chunks::<4>();
        let vectors: Vec<_> = words
            .iter()
            .map(|word| u32::from_le_bytes(*word))
            .enumerate()
            .skip(1)
            .filter(|(_, word)| *word != 0)
            .map(|(number, word)| (number, word & !1))
            .collect();

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
        let end = text.0 + text.1.len() as u32;
        let functions = without_aliases(functions, end);
        let data = without_overlap(data);
        Ok(Self { sections, functions, data, mapping, text, vectors, stack_start, stack_reserved, bytes })
    }

    /// The machine code of a function.
    pub(crate) fn code(&self, function: &Item) -> Vec<Code> {
        let (base, text) = &self.text;
        let mut pieces: Vec<Code> = Vec::new();
        let mut address = function.address;
        while address < function.address + function.size {
            let marks = self.mapping.partition_point(|(mark, _)| *mark <= address);
            let next = self.mapping.get(marks).map_or(u32::MAX, |(mark, _)| *mark);
            let end = next.min(function.address + function.size);
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

    /// The word at an address in the code section, such as a constant between instructions.
    pub(crate) fn word_in_code(&self, address: u32) -> Option<u32> {
        let at = address.checked_sub(self.text.0)? as usize;
        let bytes = self.text.1.get(at..at + 4)?;
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

/// The sections that are loaded or cleared.
fn sections(elf: &ElfFile32) -> Result<Vec<LinkedSection>, object::Error> {
    let mut sections = Vec::new();
    for section in elf.sections() {
        let (name, address) = (section.name()?, section.address());
        if address == 0 || section.size() == 0 {
            continue; // debugging information
        }
        let in_ram = !(0x0800_0000..0x1000_0000).contains(&address);
        let in_flash = section.kind() != SectionKind::UninitializedData
            && section.file_range().is_some_and(|(_, size)| size > 0);
        sections.push(LinkedSection {
            name: name.to_owned(),
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
/// the next function.
fn without_aliases(mut functions: Vec<Item>, end: u32) -> Vec<Item> {
    functions.sort_by_key(|function| (function.address, std::cmp::Reverse(function.size)));
    functions.dedup_by_key(|function| function.address);
    for index in 0..functions.len() {
        let next = functions.get(index + 1).map_or(end, |next| next.address);
        let function = &mut functions[index];
        if function.size == 0 {
            function.size = next.saturating_sub(function.address);
        }
        function.size = function.size.min(next.saturating_sub(function.address));
    }
    functions.retain(|function| function.size > 0);
    functions
}
