//! How large an image is, by section and by the crate whose source a byte comes from.

use std::collections::BTreeMap;

use upright_board::{Lines, LinesError};

use super::elf::{Item, LinkedImage, LinkedSection};

/// Name of the gain table in RAM.
const TABLE: &str = "upright_image::app::__rtic_internal_local_init_table";

/// The section of the tables in flash, from which the one in RAM is filled.
pub(super) const TABLES: &str = ".tables";
/// The section of constants.
const CONSTANTS: &str = ".rodata";
/// The section of variables with an initial value.
const VARIABLES: &str = ".data";

/// Size of an image in bytes.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Size {
    /// Flash in all, including the initial values of variables.
    pub flash: u32,
    /// Constants in flash.
    pub constants: u32,
    /// Gain table and motions in flash.
    pub tables: u32,
    /// Static RAM: all variables, without the stack.
    pub ram: u32,
    /// The gain table in RAM.
    pub table: u32,
    /// Code and constants that run from RAM, in flash and again in RAM.
    pub copied: u32,
    /// By section, in the order of addresses.
    pub sections: Vec<ImagePart>,
    /// By crate, the largest first. Code belongs to the crate of its source line, also where it is inlined.
    pub crates: Vec<ImagePart>,
}

impl Size {
    /// Flash without tables and without constants.
    pub fn code(&self) -> u32 {
        self.flash - self.tables - self.constants
    }

    /// Static RAM without the gain table, and without what is copied there.
    pub fn variables(&self) -> u32 {
        self.ram - self.table - self.copied
    }
}

/// A part of an image, in bytes.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize)]
pub struct ImagePart {
    /// Name of a section or crate; in parentheses, a description of bytes that belong to none.
    pub name: String,
    /// Its bytes in flash.
    pub flash: u32,
    /// Its bytes of static RAM.
    pub ram: u32,
}

/// Debug information that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("the image's debug information cannot be read: {0}")]
pub struct SizeError(#[from] LinesError);

/// Measures an image.
///
/// # Errors
/// [`SizeError`] if the debug information, which gives the source of code, is damaged.
pub fn size(image: &LinkedImage) -> Result<Size, SizeError> {
    let mut sections: Vec<ImagePart> = Vec::new();
    for section in &image.sections {
        let bytes = |counts: bool| if counts { section.bytes } else { 0 };
        let (flash, ram) = (bytes(section.in_flash), bytes(section.in_ram));
        sections.push(ImagePart { name: section.name.clone(), flash, ram });
    }
    let flash: u32 = sections.iter().map(|part| part.flash).sum();
    let ram: u32 = sections.iter().map(|part| part.ram).sum();

    let mut shares: BTreeMap<String, ImagePart> = BTreeMap::new();
    let is_copied = |section: &LinkedSection| section.in_flash && section.in_ram && section.name != VARIABLES;
    let copied_section = |name: &str| image.sections.iter().any(|part| part.name == name && is_copied(part));
    let code_is_copied = copied_section(".text");
    for (name, bytes) in code_by_crate(image)? {
        let share = shares.entry(name).or_default();
        share.flash += bytes;
        share.ram += if code_is_copied { bytes } else { 0 };
    }
    let mut table = 0;
    for item in &image.data {
        let share = shares.entry(crate_of_symbol(item)).or_default();
        // Initial values of variables are few: they are left to the unnamed rest.
        if item.name == TABLE {
            table = item.size;
        }
        let Some(section) = image.section_at(item.address) else { continue };
        share.ram += if section.in_ram { item.size } else { 0 };
        share.flash += if !section.in_ram || is_copied(section) { item.size } else { 0 };
    }
    let (counted_flash, counted_ram) =
        shares.values().fold((0, 0), |(flash, ram), part| (flash + part.flash, ram + part.ram));
    let rest = shares.entry("(alignment, constants without a name)".to_owned()).or_default();
    rest.flash += flash.saturating_sub(counted_flash);
    rest.ram += ram.saturating_sub(counted_ram);
    let mut crates: Vec<ImagePart> =
        shares.into_iter().map(|(name, part)| ImagePart { name, ..part }).collect();
    crates.sort_by_key(|part| std::cmp::Reverse((part.flash, part.ram)));
    let flash_of = |name| sections.iter().filter(|part| part.name == name).map(|part| part.flash).sum();
    let (constants, tables) = (flash_of(CONSTANTS), flash_of(TABLES));
    let copied =
        image.sections.iter().filter(|section| is_copied(section)).map(|section| section.bytes).sum();
    Ok(Size { flash, constants, tables, ram, table, copied, sections, crates })
}

/// Bytes of machine code by the crate of their source line.
fn code_by_crate(image: &LinkedImage) -> Result<BTreeMap<String, u32>, SizeError> {
    let lines = Lines::parse(&image.bytes)?;
    let mut crates = BTreeMap::new();
    for function in &image.functions {
        let mut located = 0;
        for (bytes, file) in lines.files(function.address..function.address + function.size)? {
            located += bytes;
            *crates.entry(crate_of_file(file)).or_default() += bytes;
        }
        // Assembly, which has no lines.
        *crates.entry(crate_of_symbol(function)).or_default() += function.size.saturating_sub(located);
    }
    crates.retain(|_, bytes| *bytes > 0);
    Ok(crates)
}

/// The crate of a source file: a folder of cargo's registry, of Rust's library, or this project.
fn crate_of_file(path: &str) -> String {
    let folders: Vec<&str> = path.split(['/', '\\']).collect();
    let after = |name: &str| {
        let at = folders.iter().rposition(|folder| *folder == name)?;
        Some(&folders[at + 1..])
    };
    if let Some([_, package, ..]) = after("registry").and_then(|rest| rest.strip_prefix(&["src"])) {
        let version = package.match_indices('-').find(|(at, _)| {
            package[at + 1..].starts_with(|first: char| first.is_ascii_digit())
                && package[*at..].contains('.')
        });
        return version.map_or(*package, |(at, _)| &package[..at]).to_owned();
    }
    match after("library") {
        Some([name, ..]) => name.replace('-', "_"),
        _ if path.is_empty() => "(assembly)".to_owned(),
        _ => "upright".to_owned(),
    }
}

/// The crate of a function or variable by its path.
fn crate_of_symbol(item: &Item) -> String {
    let path = item.name.trim_start_matches(['<', '&', '(', '[']);
    match path.split_once("::") {
        Some(("upright_image" | "upright_rp2040", _)) => "upright".to_owned(),
        Some((name, _)) => name.to_owned(),
        None if item.name.starts_with("__INTERRUPTS")
            || item.name.starts_with("__EXCEPTIONS")
            || item.name.starts_with("__RESET_VECTOR") =>
        {
            "(vector table)".to_owned()
        }
        None if item.name.starts_with(".L") => "(alignment, constants without a name)".to_owned(),
        None => "(assembly and C symbols)".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::crate_of_file;

    #[test]
    fn a_source_file_belongs_to_its_package() {
        for (path, name) in [
            (
                "/home/me/.cargo/registry/src/index.crates.io-1949cf8c6b5b557f/nalgebra-0.35.0/src/base/ops.rs",
                "nalgebra",
            ),
            ("/x/registry/src/index.crates.io-1/cortex-m-rt-0.7.5/src/lib.rs", "cortex-m-rt"),
            ("/x/registry/src/index.crates.io-1/stm32f4xx-hal-0.23.0/src/lib.rs", "stm32f4xx-hal"),
            ("/rustc/59807616e1fa/library/core/src/slice/mod.rs", "core"),
            ("/usr/lib/rustlib/src/rust/library/compiler-builtins/src/mem.rs", "compiler_builtins"),
            ("/home/me/upright/src/controller.rs", "upright"),
        ] {
            assert_eq!(crate_of_file(path), name);
        }
    }
}
