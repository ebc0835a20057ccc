//! What some tests need and not every machine has: a compiler for the image, QEMU, a browser. A test without it says so
//! and passes; if the environment variable `UPRIGHT_REQUIRE_IMAGE` or `UPRIGHT_REQUIRE_BROWSER` is set, it fails.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_tool::image::{ImageError, Kind, build, build_for};

/// Says on stderr what a test leaves out, in spite of the test program, which hides what a passing test prints with the
/// macros.
pub(crate) fn not_exercised(what: &str) {
    let _ = writeln!(std::io::stderr(), "not exercised: {what}");
}

/// Whether this variable demands the equipment.
pub(crate) fn is_required(variable: &str) -> bool {
    std::env::var_os(variable).is_some()
}

/// What was built or found; `None` if it needs the missing compiler for the image. `what` it is for.
pub(crate) fn if_possible<T>(result: Result<T, ImageError>, what: &str) -> Option<T> {
    match result {
        Err(error @ ImageError::NoCompiler) if !is_required("UPRIGHT_REQUIRE_IMAGE") => {
            not_exercised(&format!("{what}: {error}"));
            None
        }
        result => Some(result.unwrap()),
    }
}

/// The image with the committed gain table.
pub(crate) fn built(kind: Kind) -> Option<PathBuf> {
    if_possible(build(kind), "an image")
}

/// The image with this table.
pub(crate) fn built_for(kind: Kind, rig: &Rig, table: &TableValues) -> Option<PathBuf> {
    if_possible(build_for(kind, rig, table), "an image")
}

/// The image, if there is one and QEMU is there.
pub(crate) fn in_qemu(image: Option<PathBuf>) -> Option<PathBuf> {
    let image = image?;
    match Command::new("qemu-system-arm").arg("--version").stdout(Stdio::null()).status() {
        Ok(_) => Some(image),
        Err(error) if is_required("UPRIGHT_REQUIRE_IMAGE") => panic!("no QEMU: {error}"),
        Err(_) => {
            not_exercised("the image in QEMU: install qemu-system-arm");
            None
        }
    }
}
