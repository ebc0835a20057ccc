//! Where the firmware runs (option `--target`), and the image that is needed there.

use std::path::Path;

use clap::ValueEnum;
use upright::boards::DEFAULT_BOARD;
use upright_board::{Conditions, Image};
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_tool::image;
use upright_tool::in_the_loop::RunPlace;

use crate::building::building;
use upright_command::Failure;

/// Where the firmware runs.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TargetOption {
    /// In this process
    Host,
    /// As the image that is flashed, on the virtual board
    Board,
}

/// A firmware, built for its target.
pub(crate) enum Built {
    Host,
    Board(Image, Conditions),
}

impl TargetOption {
    /// Its name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            TargetOption::Host => "host",
            TargetOption::Board => "board",
        }
    }

    /// Builds the image with the table of the rig and prints its path and hash; on the host, no image is needed.
    pub(crate) fn built(self, rig: &Rig, table: &TableValues) -> Result<Built, Failure> {
        match self {
            TargetOption::Host => Ok(Built::Host),
            TargetOption::Board => {
                let image = building(DEFAULT_BOARD, || image::build_for(DEFAULT_BOARD, rig, table))?;
                Ok(Built::Board(read(&image.elf)?, image::conditions(DEFAULT_BOARD, 1)?))
            }
        }
    }
}

impl Built {
    /// The place to run it; `seed` determines everything random about the virtual board.
    pub(crate) fn place(&self, seed: u64) -> RunPlace<'_> {
        match self {
            Built::Host => RunPlace::Host,
            Built::Board(image, typical) => {
                RunPlace::Board { image, conditions: Conditions { seed, ..*typical } }
            }
        }
    }
}

/// Reads the image that is flashed; prints its path and hash, and the checksum that the monitor shows.
pub(crate) fn read(path: &Path) -> Result<Image, Failure> {
    let bytes = std::fs::read(path)?;
    eprintln!("{} ({:.16})", path.display(), image::file_hash(&bytes));
    let image =
        Image::from_elf(&bytes).map_err(|error| Failure::argument(format!("{}: {error}", path.display())))?;
    eprintln!("the monitor shows it as image {:08x}", image::flash_checksum(&image));
    Ok(image)
}
