//! Building an image.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::board::BoardName;
use super::checksum::with_reference;
use super::compiler::{Compiler, compiler, target_directory};
use super::error::{BuildError, TARGET};
use super::kept;
use crate::project::checkout;
use upright::gains::{SENSORS, TABLE, TICK_S};
use upright::table::StepMap;
use upright_design::rig::Rig;
use upright_design::table::{TableValues, gains_source, write_atomically};

/// The cargo profile that images are compiled with.
pub const PROFILE: &str = "firmware";

/// Builds the image with the committed gain table, `src/gains.rs`; returns the path of the ELF file.
///
/// # Errors
/// [`BuildError`] if the board cannot serve the table's rig, there is no compiler, or it fails.
pub fn build(board: BoardName) -> Result<PathBuf, BuildError> {
    check_board(board, SENSORS, f64::from(TICK_S), TABLE.drive.pulses())?;
    compile(board, None, board.name())
}

/// Builds the image with the table of `rig` in place of `src/gains.rs`; returns the path of the ELF file.
///
/// # Errors
/// As for [`build`].
pub fn build_for(board: BoardName, rig: &Rig, table: &TableValues) -> Result<PathBuf, BuildError> {
    check_board(board, table.sensors(), rig.tick.period_s, table.drive.pulses())?;
    reads_all(board, table)?;
    let source = gains_source(rig, table);
    let mut name = format!("{}-{:016x}-{:08x}", board.name(), rig.hash(), table.crc());
    if let Some(crc) = table.swing_up_crc() {
        name += &format!("-{crc:08x}");
    }
    let gains = images()?.join(format!("{name}.rs"));
    // An unchanged file stays as it is, so that nothing is compiled again.
    if std::fs::read_to_string(&gains).ok().as_deref() != Some(&source) {
        write_atomically(&gains, source.as_bytes())?;
    }
    compile(board, Some(&gains), &name)
}

/// Checks what the board of the image can do for this rig, as far as that is known before it is designed.
///
/// # Errors
/// [`BuildError`] if the board counts too few encoders, or cannot make the tick.
pub fn check_rig(board: BoardName, rig: &Rig) -> Result<(), BuildError> {
    check_board(board, rig.sensors().len(), rig.tick.period_s, None)
}

/// Checks what the board of the image can do before the compiler is started, whose errors name lines of the image.
fn check_board(
    board: BoardName,
    needed: usize,
    tick_s: f64,
    steps: Option<&StepMap>,
) -> Result<(), BuildError> {
    if needed > board.encoders() {
        return Err(BuildError::Encoders { board, needed });
    }
    let [shortest_s, longest_s] = board.tick_s();
    // The committed table has the tick as f32.
    let is_possible = (shortest_s * (1.0 - 1e-6)..=longest_s * (1.0 + 1e-6)).contains(&tick_s);
    if !is_possible {
        return Err(BuildError::Tick { board, tick_s });
    }
    let most = board.most_pulses_hz(tick_s);
    let rate = steps.map_or(0.0, |steps| f64::from(steps.speed_limit_m_per_s) / f64::from(steps.step_m));
    if rate > most { Err(BuildError::Pulses { board, most, rate }) } else { Ok(()) }
}

/// Checks that the board reads the absolute sensors of the table's rig, if it has any.
fn reads_all(board: BoardName, table: &TableValues) -> Result<(), BuildError> {
    if !board.reads_angles() {
        return counts_all(table);
    }
    for sensor in (0..table.sensors()).filter(|&sensor| table.absolute.is_absolute(sensor)) {
        let turn = table.absolute.turn_counts(&table.limits, sensor);
        match table.absolute.is_potentiometer(&table.limits, sensor) {
            true if sensor != 1 || turn.ilog2() != BoardName::WIPER_BITS => {
                return Err(BuildError::Potentiometer { board, link: sensor });
            }
            false if turn != 1 << BoardName::ANGLE_BITS => {
                return Err(BuildError::AngleBits { board, sensor });
            }
            _ => {}
        }
    }
    Ok(())
}

/// Checks that the table's rig has encoders alone.
pub(super) fn counts_all(table: &TableValues) -> Result<(), BuildError> {
    let absolute = (0..table.sensors()).find(|&sensor| table.absolute.is_absolute(sensor));
    absolute.map_or(Ok(()), |sensor| Err(BuildError::AbsoluteSensor { sensor }))
}

/// Waits until no other process compiles an image, and keeps others waiting until the file is dropped. The compiler
/// writes all images to the same place, and each has to be copied from there before the next is compiled.
pub(super) fn one_at_a_time() -> Result<File, BuildError> {
    let path = images()?.join("compiling");
    let locked = File::create(&path).and_then(|file| file.lock().map(|()| file));
    locked.map_err(|source| BuildError::File { path, source })
}

fn compile(board: BoardName, gains: Option<&Path>, name: &str) -> Result<PathBuf, BuildError> {
    let root = checkout()?;
    let _others_wait = one_at_a_time()?;
    let Compiler { program, version, mut cargo, target_directory } = compiler()?;
    let features = match gains {
        Some(gains) => {
            cargo.env("UPRIGHT_GAINS", gains);
            format!("{},gains-from-env", board.name())
        }
        None => board.name().to_owned(),
    };
    cargo
        .current_dir(&root)
        .args(["rustc", "--quiet", "--package", "upright", "--bin", "upright-image"])
        .args(["--profile", PROFILE, "--target", TARGET, "--features", &features]);
    // Only the image's own crate is optimised for size: the library holds the part of a tick that has to be fast.
    cargo.args(["--", "-C", "opt-level=s"]);
    let image = images()?.join(format!("{name}.elf"));
    if kept::is_current(&image, &cargo, &version) {
        return Ok(image);
    }
    kept::forget(&image);
    let begin = SystemTime::now();
    let output = cargo.output().map_err(|source| BuildError::Start(program, source))?;
    if !output.status.success() {
        return Err(BuildError::Compiler(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    let built = target_directory.join(TARGET).join(PROFILE).join("upright-image");
    let list = built.with_extension("d");
    let elf = std::fs::read(&built).map_err(|source| BuildError::File { path: built.clone(), source })?;
    write_atomically(&image, &with_reference(&built, elf)?)?;
    kept::keep(&image, &cargo, &version, begin, &list, &root)
        .map_err(|source| BuildError::File { path: list, source })?;
    Ok(image)
}

/// Directory in which images are kept; it is created if it does not exist.
pub(super) fn images() -> Result<PathBuf, BuildError> {
    let directory = target_directory()?.join("images");
    match std::fs::create_dir_all(&directory) {
        Ok(()) => Ok(directory),
        Err(source) => Err(BuildError::File { path: directory, source }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::pico_limits::tests::stepper;
    use super::*;

    #[test]
    fn what_the_board_cannot_do_is_refused_before_the_compiler_is_started() {
        let feather = BoardName::FeatherF405;
        for tick_s in [0.05, 1.1e-4] {
            let refused = check_board(feather, 2, tick_s, None).unwrap_err().to_string();
            let tick = format!("0.12 to 33 ms, and this rig's is {} ms", tick_s * 1e3);
            assert!(refused.starts_with("feather-f405") && refused.contains(&tick), "{refused}");
        }
        assert!(check_board(feather, 3, 1e-3, None).unwrap_err().to_string().contains("counts 2 encoders"));
        // As in the rig file, and as rounded in the table.
        for tick_s in [1.2e-4, f64::from(1.2e-4_f32), 1e-3, 0.033, f64::from(0.033_f32)] {
            assert!(check_board(feather, 2, tick_s, None).is_ok(), "{tick_s}");
        }
        let refused =
            |tick_s, speed| check_board(feather, 2, tick_s, Some(&stepper(speed))).unwrap_err().to_string();
        assert!(check_board(feather, 2, 1e-2, Some(&stepper(1.2))).is_ok());
        let too_many = refused(1e-2, 1.3);
        assert!(too_many.contains("25500 step pulses") && too_many.contains("26000"), "{too_many}");
        assert!(refused(1e-3, 10.5).contains("200000 step pulses"), "{}", refused(1e-3, 10.5));
    }
}
