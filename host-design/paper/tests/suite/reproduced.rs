//! One run of `upright-paper`, with which several tests compare: it takes many seconds.

use std::collections::BTreeMap;
use std::process::{Command, Output};
use std::sync::LazyLock;

use serde_json::Value;

use upright_test_support::limits::output;
use upright_test_support::repository;

/// What the command printed and wrote.
pub(crate) struct Reproduced {
    pub(crate) output: Output,
    /// Names and contents of the files.
    pub(crate) files: BTreeMap<String, Vec<u8>>,
    /// `numbers.json`.
    pub(crate) numbers: Value,
}

/// The command, started in a folder that is not the checkout.
pub(crate) static REPRODUCED: LazyLock<Reproduced> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let output = output(
        Command::new(env!("CARGO_BIN_EXE_upright-paper"))
            .args(["--out", "new/folder"])
            .current_dir(folder.path()),
    );
    let entries = std::fs::read_dir(folder.path().join("new/folder")).unwrap();
    let read = |entry: std::fs::DirEntry| {
        (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())
    };
    let files: BTreeMap<_, _> = entries.map(|entry| read(entry.unwrap())).collect();
    let numbers = serde_json::from_slice(&files["numbers.json"]).unwrap();
    Reproduced { output, files, numbers }
});

impl Reproduced {
    /// A file as text.
    pub(crate) fn text(&self, name: &str) -> &str {
        std::str::from_utf8(&self.files[name]).unwrap()
    }
}

fn read(file: &str) -> String {
    std::fs::read_to_string(repository().join(file)).unwrap()
}

/// The numbers in a text, in their order.
fn numbers(text: &str) -> Vec<f64> {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)));
    words
        .filter_map(|word| word.trim_end_matches('.').parse().ok())
        .filter(|number: &f64| number.is_finite())
        .collect()
}

/// The first number of one text that differs from that of the other one by more than `least`, or 0.01 % if this is
/// more.
fn differing(committed: &str, found: &str, least: f64) -> Option<String> {
    let (committed, found) = (numbers(committed), numbers(found));
    let same = |a: f64, b: f64| (a - b).abs() <= least.max(1e-4 * a.abs());
    let pair = committed.iter().zip(&found).position(|(a, b)| !same(*a, *b));
    match pair {
        Some(at) => Some(format!("number {at}: {} is {} now", committed[at], found[at])),
        None if committed.len() != found.len() => {
            Some(format!("{} numbers are {} now", committed.len(), found.len()))
        }
        None => None,
    }
}

/// Every number that the command prints.
#[test]
fn the_numbers_of_the_committed_summary_come_out() {
    let page = read("docs/results/reproduction.md");
    let (_, rest) = page.split_once("<!-- summary -->").unwrap();
    let (committed, _) = rest.split_once("<!-- /summary -->").unwrap();
    assert!(numbers(committed).len() > 500);
    let found = REPRODUCED.text("summary.md");
    let differing = |found: &str| differing(committed, found, 1e-9);
    assert_eq!(differing(found), None, "docs/results/reproduction.md: run `cargo paper` again?");
    // Another layout is the same; one other digit, or a number more, is not.
    assert_eq!(differing(&found.replace(" |", "\t|").replace("--", "-")), None);
    assert!(differing(&found.replacen("11.0075", "11.0175", 1)).is_some());
    assert!(differing(&format!("{found} 1")).is_some());
}

/// To half a pixel, which are two units of the drawing.
#[test]
fn the_committed_figures_come_out() {
    for name in ["table-2.svg", "spectra.svg"] {
        let committed = read(&format!("docs/results/{name}"));
        assert!(numbers(&committed).len() > 500);
        let found = REPRODUCED.text(name);
        assert_eq!(differing(&committed, found, 2.0), None, "docs/results/{name}: copy it again?");
        // A point that is elsewhere, or one more, is not the same.
        let (before, after) = found.split_once("points=\"").unwrap();
        assert!(differing(&committed, &format!("{before}points=\"7777,7777 {after}"), 2.0).is_some());
        assert!(differing(&committed, &found.replacen("points=\"", "points=\"9", 1), 2.0).is_some());
    }
}

fn command(arguments: &[&str]) -> Output {
    output(Command::new(env!("CARGO_BIN_EXE_upright-paper")).args(arguments))
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

#[test]
fn the_paper_is_reproduced_from_any_folder() {
    let Reproduced { output, files, .. } = &*REPRODUCED;
    assert!(output.status.success(), "{}", stderr(output));
    assert_eq!(files.len(), 22);
    assert!(files["summary.md"] == output.stdout, "the summary is what is printed");
}

#[test]
fn a_folder_without_the_papers_rig_files_is_an_error_of_the_user() {
    let folder = tempfile::tempdir().unwrap();
    let output = command(&["--no-write", "--rigs", folder.path().to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("quadruple-paper.toml"), "{}", stderr(&output));
}

#[test]
fn a_folder_that_cannot_be_made_is_said_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "precious").unwrap();
    let output = command(&["--out", file.join("below").to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("--out") && stderr(&output).contains("cannot be created"),
        "{}",
        stderr(&output)
    );
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "precious");
}
