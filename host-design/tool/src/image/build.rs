//! Building an image.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime};

use upright::boards::{BoardRow, Family};
use upright::table::checksum::crc32;
use upright_design::rig::Rig;
use upright_design::table::{TableValues, class_source, image_tables, write_atomically};

use super::checksum::with_reference;
use super::compiler::{Compiler, compiler_for_chips, target_directory};
use super::error::{BuildError, TARGET};
use super::kept;
use super::limits::check_table;
use super::prebuilt::Prebuilt;
use super::tables::with_tables;
use super::ticks::ClassTicks;
use super::uf2::uf2;
use super::usual;
use upright_command::project::checkout;

/// The cargo profile that images are compiled with.
pub const PROFILE: &str = "firmware";

/// The files of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BuiltImage {
    /// For a debugger.
    pub elf: PathBuf,
    /// For the drive that a board shows whose boot loader has one.
    pub uf2: Option<PathBuf>,
    /// Ticks of the rigs that share its code.
    pub ticks: ClassTicks,
}

impl BuiltImage {
    /// The file that is flashed.
    pub fn flashed(&self) -> &Path {
        self.uf2.as_ref().unwrap_or(&self.elf)
    }
}

/// Builds the image with the tables of `rig`: compiles the code for rigs like it, unless that is there already, and
/// writes the tables into it.
///
/// # Errors
/// [`BuildError`] if the board cannot serve the rig, there is no compiler, or it fails.
pub fn build_for(board: &'static BoardRow, rig: &Rig, table: &TableValues) -> Result<BuiltImage, BuildError> {
    check_table(board, table)?;
    let path = compile(board, table)?;
    let code = read(&path)?;
    with_code(board, rig, table, (&path, &code, &ClassTicks::kept(&path, &code)))
}

impl Prebuilt {
    /// Builds the image with the tables of `rig` without a compiler; `None` if there is no code for rigs like it.
    ///
    /// # Errors
    /// [`BuildError`] if the board cannot serve the rig, or the image cannot be written.
    pub fn build_for(
        &self,
        board: &'static BoardRow,
        rig: &Rig,
        table: &TableValues,
    ) -> Result<Option<BuiltImage>, BuildError> {
        check_table(board, table)?;
        let code = self.code(&class_name(board, table));
        code.map(|code| with_code(board, rig, table, code)).transpose()
    }

    /// Whether there is code for rigs like that of `table`.
    pub fn has(&self, board: &BoardRow, table: &TableValues) -> bool {
        self.code(&class_name(board, table)).is_some()
    }

    /// Compiles the code for rigs like that of `table`, and takes it in, with its ticks as far as they are known.
    ///
    /// # Errors
    /// As for [`build_for`].
    pub fn take_in(
        &mut self,
        board: &'static BoardRow,
        table: &TableValues,
        ticks: &ClassTicks,
    ) -> Result<(), BuildError> {
        check_table(board, table)?;
        let path = compile(board, table)?;
        Ok(self.add(&class_name(board, table), &path, &read(&path)?, ticks)?)
    }
}

/// The image with the tables of `rig` behind this code: where it was read from, its bytes and its ticks.
fn with_code(
    board: &'static BoardRow,
    rig: &Rig,
    table: &TableValues,
    (path, code, ticks): (&Path, &[u8], &ClassTicks),
) -> Result<BuiltImage, BuildError> {
    let mut name = format!("{board}-{:016x}-{:08x}", rig.hash(), table.crc());
    if let Some(crc) = table.swing_up_crc() {
        name += &format!("-{crc:08x}");
    }
    let elf = images()?.join(format!("{name}.elf"));
    let bytes = with_reference(&elf, with_tables(path, code, &image_tables(board, table))?)?;
    write_atomically(&elf, &bytes)?;
    let ticks = ticks.clone();
    let Family::Rp(rp) = &board.family else { return Ok(BuiltImage { elf, uf2: None, ticks }) };
    let path = elf.with_extension("uf2");
    write_atomically(&path, &uf2(rp.chip.uf2_family(), &elf, &bytes)?)?;
    Ok(BuiltImage { elf, uf2: Some(path), ticks })
}

/// Name of the code for rigs like that of `table`.
fn class_name(board: &BoardRow, table: &TableValues) -> String {
    let crc = crc32(0, class_source(table).as_bytes());
    format!("{board}-{}x{}-{crc:08x}", table.states(), table.sensors())
}

/// How long it usually takes here to build an image of this board that is not there already.
///
/// # Errors
/// [`BuildError`] if there is no folder for images.
pub fn usual_duration(board: &BoardRow) -> Result<Duration, BuildError> {
    let (images, target) = (images()?, Recipe::of(&board.family).target);
    let folder = target_directory()?;
    let is_first =
        ![folder.clone(), folder.join("debian")].iter().any(|folder| has_libraries(folder, target));
    Ok(usual::duration(&images, target, is_first))
}

/// Whether libraries have been compiled for a target in cargo's folder.
fn has_libraries(folder: &Path, target: &str) -> bool {
    folder.join(target).join(PROFILE).join("deps").exists()
}

/// How the image of a family is compiled.
struct Recipe {
    /// Folder of its crate in the repository.
    folder: &'static str,
    target: &'static str,
    /// Arguments of cargo, and those of the compiler for the image's own crate.
    cargo: Vec<&'static str>,
    rustc: &'static [&'static str],
    program: &'static str,
}

impl Recipe {
    fn of(family: &Family) -> Self {
        match family {
            // Only the image's own crate is optimised for size: the library holds the part of a tick that has to be
            // fast.
            Family::F4(board) => Self {
                folder: "",
                target: TARGET,
                cargo: vec![
                    "--package",
                    "upright",
                    "--bin",
                    "upright-image",
                    "--features",
                    board.chip.feature(),
                ],
                rustc: &["-C", "opt-level=s"],
                program: "upright-image",
            },
            Family::Rp(board) => Self {
                folder: "boards/rp2040",
                target: board.chip.target(),
                cargo: vec!["--locked"],
                rustc: &[],
                program: "upright-rp2040",
            },
        }
    }
}

/// The ELF file of the code for rigs like that of `table`, without tables.
fn compile(board: &'static BoardRow, table: &TableValues) -> Result<PathBuf, BuildError> {
    let root = checkout()?;
    let _others_wait = one_at_a_time()?;
    let source = class_source(table);
    let name = class_name(board, table);
    let (gains, elf) = (images()?.join(format!("{name}.rs")), images()?.join(format!("{name}.elf")));
    // An unchanged file stays as it is, so that nothing is compiled again.
    if std::fs::read_to_string(&gains).ok().as_ref() != Some(&source) {
        write_atomically(&gains, source.as_bytes())?;
    }
    let recipe = Recipe::of(&board.family);
    let Compiler { program, version, mut cargo, target_directory } = compiler_for_chips(&[recipe.target])?;
    let folder = root.join(recipe.folder);
    cargo.current_dir(&folder).env("UPRIGHT_BOARD", board.name).env("UPRIGHT_GAINS", &gains);
    cargo.args(["rustc", "--quiet", "--profile", PROFILE, "--target", recipe.target]);
    cargo.args(&recipe.cargo).arg("--").args(recipe.rustc);
    if !kept::is_current(&elf, &cargo, &version) {
        kept::forget(&elf);
        let has_libraries = has_libraries(&target_directory, recipe.target);
        let begin = SystemTime::now();
        run(&mut cargo, program)?;
        if let (true, Ok(taken)) = (has_libraries, begin.elapsed()) {
            usual::keep(&images()?, recipe.target, taken);
        }
        let built = target_directory.join(recipe.target).join(PROFILE).join(recipe.program);
        write_atomically(&elf, &read(&built)?)?;
        let list = built.with_extension("d");
        kept::keep(&elf, &cargo, &version, begin, &list, &[&root, &folder])
            .map_err(|source| BuildError::File { path: list, source })?;
    }
    Ok(elf)
}

fn run(cargo: &mut Command, program: &'static str) -> Result<(), BuildError> {
    let output = cargo.output().map_err(|source| BuildError::Start(program, source))?;
    if output.status.success() {
        return Ok(());
    }
    Err(BuildError::Compiler(String::from_utf8_lossy(&output.stderr).into_owned()))
}

fn read(path: &Path) -> Result<Vec<u8>, BuildError> {
    std::fs::read(path).map_err(|source| BuildError::File { path: path.to_owned(), source })
}

/// Waits until no other process compiles an image, and keeps others waiting until the file is dropped. The compiler
/// writes all images to the same place, and each has to be copied from there before the next is compiled.
fn one_at_a_time() -> Result<File, BuildError> {
    let path = images()?.join("compiling");
    let locked = File::create(&path).and_then(|file| file.lock().map(|()| file));
    locked.map_err(|source| BuildError::File { path, source })
}

/// Directory in which images are kept; it is created if it does not exist. Without a checkout, it is in the current
/// folder.
fn images() -> Result<PathBuf, BuildError> {
    let directory =
        target_directory().map_or_else(|_| PathBuf::from("upright-images"), |target| target.join("images"));
    match std::fs::create_dir_all(&directory) {
        Ok(()) => Ok(directory),
        Err(source) => Err(BuildError::File { path: directory, source }),
    }
}
