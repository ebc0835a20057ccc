//! The image, if this machine has a compiler for it.

use std::path::PathBuf;

use upright::boards::BoardRow;
use upright_design::rig::Rig;
use upright_design::table::{TableValues, gains_source};
use upright_test_support::limits::output;
use upright_test_support::repository;
use upright_tool::image::{BuildError, Compiler, PROFILE, TARGET, build_for, compiler};

/// What was built or found; `None` if it needs the missing compiler for the image. `what` it is for.
pub(crate) fn if_possible<T>(result: Result<T, BuildError>, what: &str) -> Option<T> {
    let is_missing = |error: &BuildError| matches!(error, BuildError::NoCompiler(_));
    upright_test_support::equipment::if_possible(result, is_missing, what)
}

/// The image with this table.
pub(crate) fn built_for(board: &'static BoardRow, rig: &Rig, table: &TableValues) -> Option<PathBuf> {
    if_possible(build_for(board, rig, table), "an image").map(|image| image.elf)
}

/// Builds the crate in this folder of `boards/` with a table; returns the folder of what was built.
pub(crate) fn build_crate(name: &str, rig: &Rig, table: &TableValues) -> Result<PathBuf, BuildError> {
    let Compiler { mut cargo, target_directory, .. } = compiler()?;
    let temporary = tempfile::tempdir().unwrap();
    let gains = temporary.path().join("gains.rs");
    std::fs::write(&gains, gains_source(rig, table)).unwrap();
    cargo.current_dir(repository().join("boards").join(name)).env("UPRIGHT_GAINS", gains);
    cargo.args(["build", "--quiet", "--locked", "--profile", PROFILE, "--target", TARGET]);
    let output = output(&mut cargo);
    if output.status.success() {
        return Ok(target_directory.join(TARGET).join(PROFILE));
    }
    Err(BuildError::Compiler(String::from_utf8_lossy(&output.stderr).into_owned()))
}

#[cfg(unix)]
mod tests {
    use std::process::Command;
    use std::time::Duration;

    use upright_test_support::limits::output_within;

    #[test]
    fn a_program_that_ends_in_time_gives_what_it_prints() {
        let mut shell = Command::new("sh");
        let output = output_within(shell.args(["-c", "echo done; exit 3"]), Duration::from_secs(60));
        assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(3), &b"done\n"[..]));
    }

    #[test]
    #[should_panic(expected = "after 100ms, this has not come: the end of \"sleep\" \"60\"")]
    fn a_program_that_does_not_end_is_ended() {
        output_within(Command::new("sleep").arg("60"), Duration::from_millis(100));
    }
}
