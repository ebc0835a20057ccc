//! Inspection of images: defects of an image are found, in `tests/fixtures/unfit_image.rs`.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use serde_json::Value;
use upright::boards::DEFAULT_BOARD;
use upright_test_support::limits::{joined, output, received};
use upright_tool::image::{
    BuildError, Compiler, LinkedImage, PROFILE, StackError, TARGET, compiler, forbidden_functions,
    forbidden_in_handlers, size, stack_bound,
};

use crate::equipment::{built, if_possible};

/// Path of the flashed image; `None` without a compiler for it.
fn flashed() -> Option<&'static Path> {
    static PATH: OnceLock<Option<PathBuf>> = OnceLock::new();
    PATH.get_or_init(|| built(DEFAULT_BOARD)).as_deref()
}

/// Path of an image that must not be flashed; `None` without a compiler for it.
fn unfit() -> Option<&'static Path> {
    static PATH: OnceLock<Option<PathBuf>> = OnceLock::new();
    PATH.get_or_init(|| if_possible(built_unfit(), "an image")).as_deref()
}

fn built_unfit() -> Result<PathBuf, BuildError> {
    let Compiler { mut cargo, target_directory, .. } = compiler()?;
    cargo.current_dir(upright_test_support::repository());
    cargo.args([
        "build",
        "--quiet",
        "--package",
        "upright",
        "--bin",
        "unfit-image",
        "--features",
        "stm32f405",
    ]);
    let compiled = output(cargo.args(["--profile", PROFILE, "--target", TARGET]));
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    Ok(target_directory.join(TARGET).join(PROFILE).join("unfit-image"))
}

fn upright(arguments: &[&str]) -> Output {
    output(Command::new(env!("CARGO_BIN_EXE_upright")).args(arguments))
}

/// Runs the tool with an empty PATH.
fn upright_alone(arguments: &[&str]) -> Output {
    let nowhere = tempfile::tempdir().unwrap();
    output(Command::new(env!("CARGO_BIN_EXE_upright")).args(arguments).env("PATH", nowhere.path()))
}

/// The compiler writes every image to the same file, and other processes compile, too.
#[test]
fn an_image_waits_for_the_one_that_is_being_compiled() {
    let Some(path) = flashed() else { return };
    // Several times as long as for an image that does not wait and has been compiled before.
    let begin = Instant::now();
    built(DEFAULT_BOARD);
    let patience = (4 * begin.elapsed()).min(Duration::from_secs(3));
    let other = File::create(path.with_file_name("compiling")).unwrap();
    other.lock().unwrap();
    let (done, is_done) = mpsc::channel();
    let builder = std::thread::spawn(move || done.send(built(DEFAULT_BOARD)).unwrap());
    assert_eq!(is_done.recv_timeout(patience), Err(RecvTimeoutError::Timeout));
    other.unlock().unwrap();
    assert_eq!(received(&is_done, "the image").as_deref(), Some(path));
    joined(builder, "the image is built");
}

#[test]
fn a_panic_is_found() {
    let Some(path) = unfit() else { return };
    let image = LinkedImage::read(path).unwrap();
    let found = forbidden_functions(&image);
    assert!(found.contains(&"core::panicking::panic_fmt"), "{found:?}");
}

/// On a Pico, only what interrupts reach has to be free of panics. Its images, which CI measures, have none there.
#[test]
fn a_panic_in_an_interrupt_is_found() {
    let Some(path) = unfit() else { return };
    let image = LinkedImage::read(path).unwrap();
    let found = forbidden_in_handlers(&image).unwrap();
    assert!(found.contains(&"core::panicking::panic_fmt"), "{found:?}");
}

#[test]
fn a_recursion_has_no_bound_on_the_stack() {
    let Some(path) = unfit() else { return };
    let image = LinkedImage::read(path).unwrap();
    match stack_bound(&image) {
        Err(StackError::Recursion(name)) => assert!(name.ends_with("::dig"), "{name}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn each_byte_is_counted_once() {
    let Some(path) = flashed() else { return };
    let image = LinkedImage::read(path).unwrap();
    let size = size(&image).unwrap();
    let sum = |parts: &[upright_tool::image::ImagePart]| {
        parts.iter().fold((0, 0), |(flash, ram), part| (flash + part.flash, ram + part.ram))
    };
    assert_eq!(sum(&size.sections), (size.flash, size.ram));
    assert_eq!(sum(&size.crates), (size.flash, size.ram));
    let upright = size.crates.iter().find(|part| part.name == "upright").unwrap();
    assert!(upright.flash > 1000, "{upright:?}");
}

#[test]
fn an_image_that_must_not_ship_ends_with_status_1_after_its_figures() {
    let Some(path) = unfit() else { return };
    let output = upright(&["firmware", "size", "--json", "--elf", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    let figures: Value = serde_json::from_slice(&output.stdout).unwrap();
    let wrong = figures["wrong"].to_string();
    assert!(wrong.contains("calls itself") && wrong.contains("can panic"), "{wrong}");
}

#[test]
fn a_file_that_is_no_image_is_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.elf");
    let Some(whole) = flashed() else { return };
    let whole = std::fs::read(whole).unwrap();
    for bytes in [&b""[..], b"not an image", &whole[..60], &whole[..whole.len() / 2]] {
        std::fs::write(&path, bytes).unwrap();
        let output = upright(&["firmware", "size", "--elf", path.to_str().unwrap()]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("image.elf") && said.lines().count() == 1, "{said}");
    }
}

#[test]
fn what_is_missing_is_named_in_one_line() {
    for (command, missing) in [("build", "rustup target add"), ("flash", "probe-rs is missing")] {
        let output = upright_alone(&["firmware", command]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(4), "{said}");
        // On a busy machine, progress is reported before.
        let lines: Vec<&str> = said.lines().filter(|line| !line.contains(" s so far")).collect();
        assert!(lines.len() == 1 && lines[0].contains(missing), "{said}");
    }
}
