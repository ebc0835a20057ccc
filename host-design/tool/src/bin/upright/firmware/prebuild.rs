//! `upright firmware prebuild`

use std::path::{Path, PathBuf};

use clap::Args;
use upright::boards::{BOARDS, BoardRow};
use upright_design::table::write_atomically;
use upright_tool::image::{self, ClassTicks, PREBUILT_FILE, Prebuilt, check_table, compiler};

use super::board::board;
use super::built::{ForRig, designed};
use super::cycles::check_ticks;
use crate::building::building;
use crate::variation::Wanted;
use upright_command::Failure;

/// Compiles the images for boards and rigs like these, with and without motions, measures their ticks, and packs them
/// into a file. `build` and `flash` write the tables of any rig with the same numbers of links and kinds of drive and
/// sensors into them, without a compiler.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware prebuild rigs/single-quanser-ip02.toml rigs/quadruple-paper.toml
  upright firmware prebuild rigs/single-quanser-ip02.toml --board pico --out pico.lzma")]
pub(crate) struct PrebuildCommand {
    /// Rig files (TOML); of rigs of the same kind, the ticks of the first one are measured
    #[arg(required = true)]
    rigs: Vec<PathBuf>,
    /// Boards, by the names that `upright firmware boards` lists [default: all]
    #[arg(long = "board", value_name = "NAME", value_parser = board)]
    boards: Vec<&'static BoardRow>,
    /// File for the images
    #[arg(long, value_name = "FILE", default_value = PREBUILT_FILE)]
    out: PathBuf,
}

impl PrebuildCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let boards = if self.boards.is_empty() { BOARDS.iter().collect() } else { self.boards };
        let mut prebuilt = Prebuilt::none_by(&compiler()?.version);
        for path in &self.rigs {
            take_in_kind(&mut prebuilt, path, &boards)?;
        }
        let packed = prebuilt.packed();
        write_atomically(&self.out, &packed)?;
        eprintln!("{}: {} images, {} bytes", self.out.display(), prebuilt.count(), packed.len());
        Ok(())
    }
}

/// Compiles the images for rigs like that of this file, for those of the boards that can serve it.
fn take_in_kind(prebuilt: &mut Prebuilt, path: &Path, boards: &[&'static BoardRow]) -> Result<(), Failure> {
    let (rig, with_motions) = designed(path, Wanted::SwingUp)?;
    let mut tables = vec![with_motions];
    if tables[0].swing_up.is_some() {
        let mut without = tables[0].clone();
        without.swing_up = None;
        tables.push(without);
    }
    for table in tables {
        let is_wanted =
            |board: &&&'static BoardRow| check_table(board, &table).is_ok() && !prebuilt.has(board, &table);
        for board in boards.iter().filter(is_wanted).copied().collect::<Vec<_>>() {
            let mut image = building(board, || image::build_for(board, &rig, &table))?;
            // What is packed does not depend on what was built here before.
            image.ticks = ClassTicks::unknown();
            let mut built = ForRig { image, rig: rig.clone(), table: table.clone() };
            check_ticks(board, &mut built)?;
            prebuilt.take_in(board, &table, &built.image.ticks)?;
        }
    }
    Ok(())
}
