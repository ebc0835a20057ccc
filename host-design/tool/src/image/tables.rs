//! Writes the tables of a rig into the code of an image.

use std::path::Path;

use object::build::elf::{Builder, SectionData};
use object::elf::{PF_R, PT_GNU_STACK, SHF_ALLOC, SHT_PROGBITS};
use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSymbol};

use super::elf::ElfError;
use super::size::TABLES;

/// The ELF file `code`, read from `path`, with `tables` behind its code: see
/// [`flash_image`](upright::flash_image).
///
/// # Errors
/// [`ElfError`] if it is not the ELF file of an image.
pub(super) fn with_tables(path: &Path, code: &[u8], tables: &[u32]) -> Result<Vec<u8>, ElfError> {
    let format = |source| ElfError::Format { path: path.to_owned(), source };
    let rewrite = |source| ElfError::Rewrite { path: path.to_owned(), source };
    let address = code_end(path, &ElfFile32::parse(code).map_err(format)?)?;
    let bytes: Vec<u8> = tables.iter().flat_map(|word| word.to_le_bytes()).collect();
    let size = bytes.len() as u64;

    let mut file = Builder::read32(code).map_err(rewrite)?;
    // Nothing reads this one here, and between header and code there is room for no further segment.
    file.segments
        .iter_mut()
        .filter(|segment| segment.p_type == PT_GNU_STACK)
        .for_each(|segment| segment.delete = true);
    let segment = file.segments.add_load_segment(PF_R, 4);
    let section = file.sections.add();
    section.name = TABLES.as_bytes().into();
    section.sh_type = SHT_PROGBITS;
    section.sh_flags = SHF_ALLOC;
    section.sh_addralign = 4;
    section.sh_size = size;
    section.data = SectionData::Data(bytes.into());
    segment.append_section(section);
    section.sh_addr = address;
    (segment.p_vaddr, segment.p_paddr) = (address, address);
    let mut out = Vec::new();
    file.write(&mut out).map_err(rewrite)?;
    Ok(out)
}

/// Where the code ends: behind the initial values of variables, which come last.
fn code_end(path: &Path, elf: &ElfFile32<Endianness>) -> Result<u64, ElfError> {
    let symbol = |name: &'static str| {
        let mut symbols = elf.symbols().filter(|symbol| symbol.name() == Ok(name));
        symbols
            .next()
            .map(|symbol| symbol.address())
            .ok_or(ElfError::Missing { path: path.to_owned(), what: name })
    };
    Ok(symbol("__sidata")? + symbol("__edata")? - symbol("__sdata")?)
}
