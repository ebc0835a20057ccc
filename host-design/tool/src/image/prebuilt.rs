//! Images that are built already: the code for many classes of rigs in one packed file, so that a rig needs no
//! compiler.
//!
//! Unpacked, the file is the SHA-256 of what follows, as text; the number of bytes of its contents; the
//! [contents](Contents) as JSON; and the ELF files that they list, one after the other, without debugging information.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use object::build::elf::Builder;
use serde::{Deserialize, Serialize};
use upright::flash_image::LAYOUT;
use upright::table::TABLE_FORMAT;

use super::checksum::file_hash;
use super::elf::ElfError;
use super::ticks::ClassTicks;
use crate::packed::{packed, unpacked};

/// Name of the file, beside the tool.
pub const PREBUILT_FILE: &str = "upright-images.lzma";
/// Environment variable that names the file where it is elsewhere.
pub const PREBUILT_VARIABLE: &str = "UPRIGHT_IMAGES";

/// Number of digits of the checksum.
const HASH: usize = 64;

/// A file of prebuilt images that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PrebuiltError {
    /// It cannot be read.
    #[error("{}: {source}: name the file of prebuilt images in {PREBUILT_VARIABLE}, or build with --from-source", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It was changed, is not whole, or is another file.
    #[error(
        "{}: no whole file of prebuilt images: take the one of the release again, or build with --from-source",
        path.display()
    )]
    Damaged {
        /// Which file.
        path: PathBuf,
    },
    /// Its images read other tables than this tool writes.
    #[error(
        "{}: its images read tables of format {} in layout {}, and this tool writes format {TABLE_FORMAT} in layout {LAYOUT}: \
         take tool and images from the same release, or build with --from-source",
        path.display(), formats[0], formats[1]
    )]
    Format {
        /// Which file.
        path: PathBuf,
        /// Its format and layout.
        formats: [u32; 2],
    },
}

/// What a file of prebuilt images says about itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Contents {
    /// `TABLE_FORMAT` and `LAYOUT` of the sources.
    formats: [u32; 2],
    /// Output of `rustc -vV`.
    compiler: String,
    images: Vec<PackedImage>,
}

/// An image in a file of prebuilt images.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct PackedImage {
    /// Of board, numbers of states and sensors, and kinds of drive and sensors.
    class: String,
    /// The longest tick of a rig (ns), where the virtual board measures it.
    longest_ns: Option<u64>,
    bytes: usize,
}

/// Prebuilt images, by their classes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Prebuilt {
    path: PathBuf,
    compiler: String,
    /// ELF file and ticks.
    images: BTreeMap<String, (Vec<u8>, ClassTicks)>,
}

impl Prebuilt {
    /// Those in the file that the environment names, or beside the tool; `None` if there are none.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    pub fn find() -> Result<Option<Self>, PrebuiltError> {
        if let Some(path) = std::env::var_os(PREBUILT_VARIABLE).filter(|path| !path.is_empty()) {
            return Self::read(Path::new(&path)).map(Some);
        }
        let beside = std::env::current_exe().ok().map(|tool| tool.with_file_name(PREBUILT_FILE));
        beside.filter(|path| path.exists()).map(|path| Self::read(&path)).transpose()
    }

    /// Those in a file.
    ///
    /// # Errors
    /// [`PrebuiltError`] if it cannot be read, is damaged, or is of another format.
    pub fn read(path: &Path) -> Result<Self, PrebuiltError> {
        let bytes =
            std::fs::read(path).map_err(|source| PrebuiltError::Read { path: path.to_owned(), source })?;
        let damaged = || PrebuiltError::Damaged { path: path.to_owned() };
        let bytes = unpacked(&bytes).map_err(|_| damaged())?;
        let (hash, rest) = bytes.split_first_chunk::<HASH>().ok_or_else(damaged)?;
        if file_hash(rest).as_bytes() != hash {
            return Err(damaged());
        }
        let (length, rest) = rest.split_first_chunk().ok_or_else(damaged)?;
        let (contents, mut rest) =
            rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or_else(damaged)?;
        let contents: Contents = serde_json::from_slice(contents).map_err(|_| damaged())?;
        if contents.formats != [TABLE_FORMAT, LAYOUT] {
            return Err(PrebuiltError::Format { path: path.to_owned(), formats: contents.formats });
        }
        let mut images = BTreeMap::new();
        for PackedImage { class, longest_ns, bytes } in contents.images {
            let (elf, next) = rest.split_at_checked(bytes).ok_or_else(damaged)?;
            images.insert(class, (elf.to_owned(), ClassTicks::known(longest_ns)));
            rest = next;
        }
        Ok(Self { path: path.to_owned(), compiler: contents.compiler, images })
    }

    /// None yet, to be made by a compiler.
    pub fn none_by(compiler: &str) -> Self {
        Self { path: PathBuf::new(), compiler: compiler.to_owned(), images: BTreeMap::new() }
    }

    /// Adds the code of a class, without debugging information.
    ///
    /// # Errors
    /// [`ElfError`] if it is not the ELF file of an image.
    pub(super) fn add(
        &mut self,
        class: &str,
        path: &Path,
        code: &[u8],
        ticks: &ClassTicks,
    ) -> Result<(), ElfError> {
        let elf = without_debug_information(path, code)?;
        self.images.insert(class.to_owned(), (elf, ticks.clone()));
        Ok(())
    }

    /// The bytes of their file.
    pub fn packed(&self) -> Vec<u8> {
        let entry = |(class, (elf, ticks)): (&String, &(Vec<u8>, ClassTicks))| PackedImage {
            class: class.clone(),
            longest_ns: ticks.longest_ns(),
            bytes: elf.len(),
        };
        let all: Vec<u8> = self.images.values().flat_map(|(elf, _)| elf.iter().copied()).collect();
        let contents = Contents {
            formats: [TABLE_FORMAT, LAYOUT],
            compiler: self.compiler.clone(),
            images: self.images.iter().map(entry).collect(),
        };
        // A list of names and numbers is always written.
        let contents = serde_json::to_vec(&contents).unwrap_or_default();
        let bytes = [&(contents.len() as u32).to_le_bytes(), &contents[..], &all].concat();
        packed(&[file_hash(&bytes).as_bytes(), &bytes].concat())
    }

    /// Number of images.
    pub fn count(&self) -> usize {
        self.images.len()
    }

    /// Output of `rustc -vV` of the compiler that has made them.
    pub fn compiler(&self) -> &str {
        &self.compiler
    }

    /// The file, and the code of a class and its ticks.
    pub(super) fn code(&self, class: &str) -> Option<(&Path, &[u8], &ClassTicks)> {
        self.images.get(class).map(|(elf, ticks)| (self.path.as_path(), elf.as_slice(), ticks))
    }
}

/// Symbols that tables are written by, and the stack.
const SYMBOLS: [&[u8]; 5] = [b"__sidata", b"__sdata", b"__edata", b"_stack_start", b"_stack_end"];

/// The ELF file `code`, read from `path`, without what only a debugger reads: it depends on the folder of the sources.
fn without_debug_information(path: &Path, code: &[u8]) -> Result<Vec<u8>, ElfError> {
    let rewrite = |source| ElfError::Rewrite { path: path.to_owned(), source };
    let mut file = Builder::read32(code).map_err(rewrite)?;
    for section in &mut file.sections {
        let name = section.name.as_slice();
        section.delete = name.starts_with(b".debug") || name == b".comment";
    }
    for symbol in &mut file.symbols {
        symbol.delete = !SYMBOLS.contains(&symbol.name.as_slice());
    }
    file.delete_orphans();
    let mut out = Vec::new();
    file.write(&mut out).map_err(rewrite)?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two images of a few bytes.
    fn two() -> Prebuilt {
        let mut two = Prebuilt::none_by("rustc 1.0");
        for (class, byte, longest_ns) in [("pico-4x2-0", 1, None), ("weact-f405-4x2-0", 2, Some(30_000))] {
            two.images.insert(class.to_owned(), (vec![byte; 500], ClassTicks::known(longest_ns)));
        }
        two
    }

    fn read(bytes: &[u8]) -> Result<Prebuilt, PrebuiltError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        Prebuilt::read(file.path())
    }

    #[test]
    fn what_is_packed_is_read_again() {
        let (two, read) = (two(), read(&two().packed()).unwrap());
        assert_eq!((&read.images, read.compiler()), (&two.images, "rustc 1.0"));
        let (_, elf, ticks) = read.code("weact-f405-4x2-0").unwrap();
        assert_eq!((elf, ticks.bound_us().is_some()), (&[2; 500][..], true));
        assert_eq!(read.code("nucleo-f446-4x2-0"), None);
    }

    #[test]
    fn a_file_that_was_cut_or_changed_anywhere_is_refused_or_reads_the_same() {
        let whole = two().packed();
        let images = read(&whole).unwrap().images;
        for length in 0..whole.len() {
            assert!(read(&whole[..length]).is_err(), "{length} of {} bytes", whole.len());
        }
        let mut refused = 0;
        for at in 0..whole.len() {
            for bit in 0..8 {
                let mut changed = whole.clone();
                changed[at] ^= 1 << bit;
                match read(&changed) {
                    // Some bits of the packing do not count: of the dictionary's size, and of the end.
                    Ok(same) => assert_eq!(same.images, images, "bit {bit} of byte {at}"),
                    Err(_) => refused += 1,
                }
            }
        }
        assert!(refused > 8 * (whole.len() - 20), "{refused}");
    }

    #[test]
    fn images_that_read_other_tables_are_refused_with_the_numbers() {
        let whole = unpacked(&two().packed()).unwrap();
        let key = |[format, layout]: [u32; 2]| format!("\"formats\":[{format},{layout}]").into_bytes();
        let now = key([TABLE_FORMAT, LAYOUT]);
        let at = whole.windows(now.len()).position(|bytes| bytes == now).unwrap();
        for other in [[TABLE_FORMAT + 1, LAYOUT], [TABLE_FORMAT, LAYOUT + 1]] {
            let mut changed = whole.clone();
            changed[at..at + now.len()].copy_from_slice(&key(other));
            let hash = file_hash(&changed[HASH..]);
            changed[..HASH].copy_from_slice(hash.as_bytes());
            let said = read(&packed(&changed)).unwrap_err().to_string();
            assert!(said.contains(&format!("format {} in layout {}", other[0], other[1])), "{said}");
        }
    }
}
