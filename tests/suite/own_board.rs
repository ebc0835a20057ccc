//! A firmware crate made only from docs/own-board.md, outside the workspace: it builds for the target, and on the host
//! it balances with its own table.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use crate::published::table;
use upright_design::rig::Rig;
use upright_design::table::gains_source;
use upright_tool::image::{Compiler, ImageError, PROFILE, TARGET, compiler};

const DOCUMENT: &str = include_str!("../../docs/own-board.md");

/// The files in the document: a line with the name and a colon, an empty line, and a block.
fn files(document: &str) -> BTreeMap<&str, String> {
    let mut files = BTreeMap::new();
    let mut lines = document.lines().peekable();
    let mut name = None;
    while let Some(line) = lines.next() {
        if let Some((_, after)) = line.split_once('`')
            && let Some((file, "")) = after.split_once("`:")
        {
            name = Some(file);
        } else if line.starts_with("```")
            && let Some(name) = name.take()
        {
            let body = lines.by_ref().take_while(|line| *line != "```");
            files.insert(name, body.map(|line| format!("{line}\n")).collect());
        }
    }
    files
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Names of the files that differ between document and example.
fn differing(document: &str) -> Vec<String> {
    let example = |name: &str| std::fs::read_to_string(root().join("examples/own-board").join(name));
    let of_the_example = files(document).into_iter().filter(|(name, _)| *name != ".cargo/config.toml");
    let differ = of_the_example.filter(|(name, text)| {
        example(name).map(|found| found.replace("\r\n", "\n")).ok().as_ref() != Some(text)
    });
    differ.map(|(name, _)| name.to_owned()).collect()
}

#[test]
fn the_document_shows_the_files_of_the_example() {
    let names = files(DOCUMENT).into_keys().collect::<Vec<_>>();
    let wanted = [
        ".cargo/config.toml",
        "Cargo.toml",
        "memory.x",
        "rig.toml",
        "src/board.rs",
        "src/host.rs",
        "src/lib.rs",
        "src/main.rs",
    ];
    assert_eq!(names, wanted);
    assert!(
        differing(DOCUMENT).is_empty(),
        "{:?}: copy examples/own-board/ into the page",
        differing(DOCUMENT)
    );
}

#[test]
fn a_changed_line_in_the_document_is_noticed() {
    assert_eq!(differing(&DOCUMENT.replace("Bits16", "Bits32")), ["src/board.rs"]);
}

/// Writes the document's crate to a folder outside the repository, with the table of its rig.
fn foreign_crate(folder: &Path) {
    for (name, text) in files(DOCUMENT) {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        let root = root().to_str().unwrap().replace('\\', "/");
        // Published crates would be found by version. These are not published yet, so their paths become absolute.
        let text = text.replace("\"../../host-design", &format!("\"{root}/host-design"));
        std::fs::write(path, text.replace("\"../..\"", &format!("\"{root}\""))).unwrap();
    }
    let rig = Rig::from_path(&folder.join("rig.toml")).unwrap();
    std::fs::write(folder.join("src/gains.rs"), gains_source(&rig, &table(&rig))).unwrap();
    // The same versions as in this repository, for packages that both need.
    std::fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
}

fn run(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let (said, complained) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?}\n{said}{complained}");
    said.into_owned()
}

#[test]
fn a_crate_made_from_the_document_builds_for_the_target() {
    let Compiler { mut cargo, target_directory, .. } = match compiler() {
        Err(error @ ImageError::NoCompiler) if std::env::var_os("UPRIGHT_REQUIRE_IMAGE").is_none() => {
            eprintln!("not exercised: the crate of docs/own-board.md on the target: {error}");
            return;
        }
        compiler => compiler.unwrap(),
    };
    let folder = tempfile::tempdir().unwrap();
    foreign_crate(folder.path());
    let build = ["build", "--quiet", "--bin", "image", "--features", "image"];
    run(cargo.current_dir(&folder).args(build).args(["--profile", PROFILE, "--target", TARGET]));
    let image = std::fs::read(target_directory.join(TARGET).join(PROFILE).join("image")).unwrap();
    // The image contains the control task and the serial link of the library.
    for function in [&b"ControlTask"[..], b"SerialLink"] {
        assert!(image.windows(function.len()).any(|window| window == function));
    }
}

#[test]
fn a_crate_made_from_the_document_balances_on_the_host() {
    let folder = tempfile::tempdir().unwrap();
    foreign_crate(folder.path());
    let host = |folder: &Path| {
        let mut cargo = Command::new(env!("CARGO"));
        // With the same settings as the tests, the dependencies that they share need not be compiled again.
        cargo.current_dir(folder).env("CARGO_TARGET_DIR", target_of_the_tests());
        for (setting, value) in [("DEBUG", "false"), ("CODEGEN_UNITS", "2"), ("LTO", "off")] {
            cargo.env(format!("CARGO_PROFILE_DEV_{setting}"), value);
        }
        cargo.args(["run", "--quiet", "--bin", "host"]);
        cargo
    };
    let said = run(&mut host(folder.path()));
    assert!(said.starts_with("5001 ticks, fault: None\n"), "{said}");
    // Negative control: a table for another rig.
    let rig = folder.path().join("rig.toml");
    let other = std::fs::read_to_string(&rig).unwrap().replace("mass_kg = 0.2", "mass_kg = 0.3");
    std::fs::write(&rig, other).unwrap();
    assert!(!host(folder.path()).output().unwrap().status.success());
}

fn target_of_the_tests() -> &'static Path {
    let temporary = Path::new(env!("CARGO_TARGET_TMPDIR"));
    temporary.parent().unwrap_or(temporary)
}
