//! Where the firmware runs (option `--target`), and the image that is needed there.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use upright_board::Image;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_tool::image::{self, BoardName, ImageKind};
use upright_tool::in_the_loop::{PinLink, RunPlace};

use crate::failure::Failure;
use upright_tool::progress::with_spinner;

/// The board that the virtual board simulates.
const BOARD: BoardName = BoardName::WeactF405;

/// Where the firmware runs.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TargetOption {
    /// In this process
    Host,
    /// As an image in QEMU
    Qemu,
    /// As the image that is flashed, on the virtual board
    Board,
}

/// A firmware, built for its target.
pub(crate) enum Built {
    Host,
    Qemu { image: PathBuf, link: PinLink },
    Board(Image),
}

impl TargetOption {
    /// Its name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            TargetOption::Host => "host",
            TargetOption::Qemu => "qemu",
            TargetOption::Board => "board",
        }
    }

    /// Builds the image with the table of the rig and prints its path and hash; on the host, no image is needed.
    /// `link` connects the pins of an image in QEMU.
    pub(crate) fn built(self, link: PinLink, rig: &Rig, table: &TableValues) -> Result<Built, Failure> {
        let kind = match (self, link) {
            (TargetOption::Host, _) => return Ok(Built::Host),
            (TargetOption::Qemu, PinLink::Files) => ImageKind::InTheLoop,
            (TargetOption::Qemu, PinLink::Usart) => ImageKind::InTheLoopUsart,
            (TargetOption::Board, _) => ImageKind::Board(BOARD),
        };
        let image = with_spinner("building the image", || image::build_for(kind, rig, table))?;
        if self == TargetOption::Board {
            return Ok(Built::Board(read(&image)?));
        }
        announced(&image)?;
        Ok(Built::Qemu { image, link })
    }
}

impl Built {
    /// The place to run it; `seed` determines everything random about the virtual board.
    pub(crate) fn place(&self, seed: u64) -> RunPlace<'_> {
        match self {
            Built::Host => RunPlace::Host,
            Built::Qemu { image, link } => RunPlace::Qemu { image, link: *link },
            Built::Board(image) => RunPlace::Board { image, conditions: BOARD.conditions(seed) },
        }
    }
}

/// Reads the image that is flashed; prints its path and hash, and the checksum that the monitor shows.
pub(crate) fn read(path: &Path) -> Result<Image, Failure> {
    let image = Image::from_elf(&announced(path)?)
        .map_err(|error| Failure::argument(format!("{}: {error}", path.display())))?;
    eprintln!("the monitor shows it as image {:08x}", image::flash_checksum(&image));
    Ok(image)
}

/// Reads an ELF file and prints its path and hash.
fn announced(path: &Path) -> Result<Vec<u8>, Failure> {
    let bytes = std::fs::read(path)?;
    eprintln!("{} ({:.16})", path.display(), image::file_hash(&bytes));
    Ok(bytes)
}
