//! Where the firmware runs, by the names of the command line, with the image that is needed there.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use upright_board::Image;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_tool::image::{self, Board, Kind};
use upright_tool::in_the_loop::{Link, Place};

use crate::failure::Failure;
use crate::progress::with_spinner;

/// The board that is a virtual one.
const BOARD: Board = Board::WeactF405;

/// Where the firmware runs.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Target {
    /// In this process
    Host,
    /// As an image in QEMU
    Qemu,
    /// As the image that is flashed, on the virtual board
    Board,
}

/// What runs there.
pub(crate) enum Built {
    Host,
    Qemu { image: PathBuf, link: Link },
    Board(Image),
}

impl Target {
    /// Its name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Target::Host => "host",
            Target::Qemu => "qemu",
            Target::Board => "board",
        }
    }

    /// Builds the image with the table of the rig, and says which one it is; on the host there is none. `link`
    /// connects the pins of an image in QEMU.
    pub(crate) fn built(self, link: Link, rig: &Rig, table: &TableValues) -> Result<Built, Failure> {
        self.built_as(Kind::Board(BOARD), link, rig, table)
    }

    /// The same with the image for identification.
    pub(crate) fn built_for_identification(self, rig: &Rig, table: &TableValues) -> Result<Built, Failure> {
        self.built_as(Kind::Identification(BOARD), Link::Files, rig, table)
    }

    fn built_as(self, board: Kind, link: Link, rig: &Rig, table: &TableValues) -> Result<Built, Failure> {
        let kind = match (self, link) {
            (Target::Host, _) => return Ok(Built::Host),
            (Target::Qemu, Link::Files) => Kind::InTheLoop,
            (Target::Qemu, Link::Usart) => Kind::InTheLoopUsart,
            (Target::Board, _) => board,
        };
        let image = with_spinner("building the image", || image::build_for(kind, rig, table))?;
        if self == Target::Board {
            return Ok(Built::Board(read(&image)?));
        }
        announced(&image)?;
        Ok(Built::Qemu { image, link })
    }
}

impl Built {
    /// The place to run it; what is random of the virtual board follows from `seed`.
    pub(crate) fn place(&self, seed: u64) -> Place<'_> {
        match self {
            Built::Host => Place::Host,
            Built::Qemu { image, link } => Place::Qemu { image, link: *link },
            Built::Board(image) => Place::Board { image, conditions: BOARD.conditions(seed) },
        }
    }
}

/// The image that is flashed; says which one it is, and what it says of itself.
pub(super) fn read(path: &Path) -> Result<Image, Failure> {
    let image = Image::from_elf(&announced(path)?)
        .map_err(|error| Failure::BadArgument(format!("{}: {error}", path.display())))?;
    eprintln!("the monitor shows it as image {:08x}", image::flash_checksum(&image));
    Ok(image)
}

/// The bytes of an ELF file that will run; says its path and its hash.
fn announced(path: &Path) -> Result<Vec<u8>, Failure> {
    let bytes = std::fs::read(path)?;
    eprintln!("{} ({:.16})", path.display(), image::file_hash(&bytes));
    Ok(bytes)
}
