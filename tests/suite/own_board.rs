//! A firmware crate made only from docs/own-board.md, outside the workspace: it builds for the target, and on the host
//! it balances with its own table.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::equipment::if_possible;
use crate::published::table;
use upright_design::rig::Rig;
use upright_design::table::gains_source;
use upright_test_support::limits::output;
use upright_test_support::repository;
use upright_tool::image::{Compiler, PROFILE, TARGET, compiler};

const DOCUMENT: &str = include_str!("../../docs/own-board.md");

/// File for the profiles of this repository.
const PROFILES: &str = "profiles.toml";
/// Upright's crates that the host program needs: they are compiled again, because they belong to another workspace
/// here.
const COMPILED_AGAIN: [&str; 2] = ["upright-design", "upright-closed-loop"];

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

/// Names of the files that differ between document and example.
fn differing(document: &str) -> Vec<String> {
    let example = |name: &str| std::fs::read_to_string(repository().join("examples/own-board").join(name));
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

/// The document's crate with the table of its rig, in a folder outside the repository that is named after its content:
/// it stays, so that cargo compiles the crate again only when a file of it has changed.
fn foreign_crate() -> PathBuf {
    let root = repository().to_str().unwrap().replace('\\', "/");
    // Published crates would be found by version. These are not published yet, so their paths become absolute.
    let absolute = |text: String| {
        let text = text.replace("\"../../host-design", &format!("\"{root}/host-design"));
        text.replace("\"../..\"", &format!("\"{root}\""))
    };
    let mut files: BTreeMap<_, _> =
        files(DOCUMENT).into_iter().map(|(name, text)| (name, absolute(text))).collect();
    let rig = Rig::from_toml(&files["rig.toml"], Path::new("rig.toml")).unwrap();
    files.insert("src/gains.rs", gains_source(&rig, &table(&rig)));
    // The same versions as in this repository, for packages that both need.
    files.insert("Cargo.lock", std::fs::read_to_string(Path::new(&root).join("Cargo.lock")).unwrap());
    let manifest = std::fs::read_to_string(Path::new(&root).join("Cargo.toml")).unwrap();
    files.insert(PROFILES, manifest[manifest.find("[profile").unwrap()..].to_owned());

    let mut hash = DefaultHasher::new();
    files.hash(&mut hash);
    let folder = std::env::temp_dir().join(format!("upright-own-board-{:016x}", hash.finish()));
    if !folder.exists() {
        let unfinished = tempfile::tempdir().unwrap();
        for (name, text) in &files {
            let path = unfinished.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        // Fails if another test was faster.
        let _ = std::fs::rename(unfinished.path(), &folder);
    }
    folder
}

fn run(command: &mut Command) -> String {
    let output = output(command);
    let (said, complained) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?}\n{said}{complained}");
    said.into_owned()
}

#[test]
fn a_crate_made_from_the_document_builds_for_the_target() {
    let what = "the crate of docs/own-board.md on the target";
    let Some(Compiler { mut cargo, target_directory, .. }) = if_possible(compiler(), what) else { return };
    let build = ["build", "--quiet", "--bin", "image", "--features", "image"];
    run(cargo.current_dir(foreign_crate()).args(build).args(["--profile", PROFILE, "--target", TARGET]));
    let image = std::fs::read(target_directory.join(TARGET).join(PROFILE).join("image")).unwrap();
    // The image contains the control task and the serial link of the library.
    for function in [&b"ControlTask"[..], b"SerialLink"] {
        assert!(image.windows(function.len()).any(|window| window == function));
    }
}

#[test]
fn a_crate_made_from_the_document_balances_on_the_host() {
    let folder = foreign_crate();
    let host = |with_the_rig_of: &Path| {
        let mut cargo = Command::new(env!("CARGO"));
        // With the same profiles as the tests, the dependencies that they share need not be compiled again.
        cargo.current_dir(with_the_rig_of).env("CARGO_TARGET_DIR", target_of_the_tests());
        cargo.args(["run", "--quiet", "--bin", "host", "--manifest-path"]).arg(folder.join("Cargo.toml"));
        cargo.arg("--config").arg(folder.join(PROFILES)).args(["--config", "profile.dev.opt-level=0"]);
        for name in COMPILED_AGAIN {
            cargo.arg("--config").arg(format!("profile.dev.package.{name}.opt-level=0"));
        }
        cargo
    };
    let said = run(&mut host(&folder));
    assert!(said.starts_with("5001 ticks, fault: None\n"), "{said}");
    // Negative control: a table for another rig.
    let other = tempfile::tempdir().unwrap();
    let rig = std::fs::read_to_string(folder.join("rig.toml")).unwrap();
    std::fs::write(other.path().join("rig.toml"), rig.replace("mass_kg = 0.2", "mass_kg = 0.3")).unwrap();
    assert!(!output(&mut host(other.path())).status.success());
}

fn target_of_the_tests() -> &'static Path {
    let temporary = Path::new(env!("CARGO_TARGET_TMPDIR"));
    temporary.parent().unwrap_or(temporary)
}
