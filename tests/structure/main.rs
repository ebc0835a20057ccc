//! The shape of the sources: no circles, nothing too long, no name for two types. The length of the guides. And the
//! bugs that CI plants in a copy of the sources still fit.

mod circles;
mod documents;
mod source;
mod waits;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use circles::{Files, circles};
use source::Source;

const MOST_LINES_OF_A_FUNCTION: usize = 60;
const MOST_ARGUMENTS: usize = 6;
const MOST_COLUMNS_OF_A_COMMENT: usize = 120;

/// The tool has written it.
const GENERATED: &str = "src/gains.rs";

/// The folders of the crates, and what lies in such a folder without belonging to the crate.
const CRATES: [(&str, &str); 13] = [
    ("src/", "src/image/"),
    ("host-design/board/src/", ""),
    ("host-design/closed-loop/src/", ""),
    ("host-design/command/src/", "host-design/command/src/main.rs"),
    ("host-design/design/src/", ""),
    ("host-design/identify/src/", ""),
    ("host-design/page/src/", ""),
    ("host-design/paper/src/", ""),
    ("host-design/plan/src/", ""),
    ("host-design/tool/src/", "host-design/tool/src/bin/"),
    ("host-design/tool/src/bin/upright/", ""),
    ("host-design/trust/src/", ""),
    ("src/image/", ""),
];
/// Images of other boards, each of which is a program of its own: a type may have the name of another one's.
const OTHER_IMAGES: [&str; 4] =
    ["boards/c-library/src/", "boards/replay/src/", "boards/rp2040/src/", "boards/stm32g4/src/"];

struct File {
    /// The lines of comments that are too long, from 1.
    long_comments: Vec<usize>,
    source: Source,
}

/// Bugs that the fuzz targets must find.
const PLANTED: &str = "fuzz/planted";

/// The lines of comments that are too long, from 1, without rows of tables and diagrams.
fn long_comments(text: &str) -> Vec<usize> {
    let is_too_long = |line: &str| {
        let is_drawn = line.trim_start_matches(['/', '!', ' ']).starts_with(['|', '│', '├', '└', '┌']);
        line.trim_start().starts_with("//") && !is_drawn && line.chars().count() > MOST_COLUMNS_OF_A_COMMENT
    };
    (1..).zip(text.lines()).filter(|(_, line)| is_too_long(line)).map(|(number, _)| number).collect()
}

/// All Rust files below `folder` of `root`, by their paths from `root`, with `/` as the separator.
fn add_files(root: &Path, folder: &str, files: &mut BTreeMap<String, File>) {
    for entry in std::fs::read_dir(root.join(folder)).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        let path = format!("{folder}{name}");
        if entry.file_type().unwrap().is_dir() {
            if name != "target" && !name.starts_with('.') {
                add_files(root, &format!("{path}/"), files);
            }
        } else if name.ends_with(".rs") && path != GENERATED {
            let text = std::fs::read_to_string(entry.path()).unwrap();
            let source = Source::of(&text).unwrap_or_else(|error| panic!("{path}: {error}"));
            let long_comments = long_comments(&text);
            files.insert(path, File { long_comments, source });
        }
    }
}

/// What is too long or has too many arguments, tests included.
fn too_long(files: &BTreeMap<String, File>) -> Vec<String> {
    let mut found = Vec::new();
    for (path, file) in files {
        for line in &file.long_comments {
            found.push(format!("{path}:{line}: a comment of more than {MOST_COLUMNS_OF_A_COMMENT} columns"));
        }
        for function in &file.source.functions {
            if function.lines > MOST_LINES_OF_A_FUNCTION {
                found.push(format!(
                    "{path}: fn {}: more than {MOST_LINES_OF_A_FUNCTION} lines",
                    function.name
                ));
            }
            if function.arguments > MOST_ARGUMENTS {
                found.push(format!("{path}: fn {}: more than {MOST_ARGUMENTS} arguments", function.name));
            }
        }
    }
    found
}

/// The files of a crate by their paths in it without `.rs`, without those of its tests.
fn sources<'a>(files: &'a BTreeMap<String, File>, folder: &str, without: &str) -> Files<'a> {
    let of_the_crate = files.iter().filter_map(|(path, file)| {
        let name = path.strip_prefix(folder)?.strip_suffix(".rs")?;
        let is_a_test = name.split('/').any(|part| part == "tests");
        let belongs = !is_a_test && (without.is_empty() || !path.starts_with(without));
        belongs.then_some((name, &file.source))
    });
    of_the_crate.collect()
}

/// All that is wrong with the crates below `root`, a line each.
fn findings(root: &Path) -> BTreeSet<String> {
    let mut files = BTreeMap::new();
    add_files(root, "", &mut files);
    let mut found = too_long(&files);
    let mut types: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (folder, without) in CRATES.into_iter().chain(OTHER_IMAGES.map(|folder| (folder, ""))) {
        let files = sources(&files, folder, without);
        found.extend(circles(&files).iter().map(|circle| format!("{folder}: circle of {circle}")));
        if OTHER_IMAGES.contains(&folder) {
            continue;
        }
        for (file, source) in files {
            for name in &source.types {
                types.entry(name).or_default().push(format!("{folder}{file}.rs"));
            }
        }
    }
    let twice = types.iter().filter(|(_, places)| places.len() > 1);
    found.extend(twice.map(|(name, places)| format!("type {name}: {}", places.join(", "))));
    found.into_iter().collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_sources_have_no_circle_and_nothing_too_long_and_no_name_for_two_types() {
    let found: Vec<String> = findings(&root()).into_iter().collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Whether a patch applies to the tree.
fn applies(patch: &Path) -> bool {
    let git = Command::new("git").current_dir(root()).args(["apply", "--check"]).arg(patch).output().unwrap();
    git.status.success()
}

#[test]
fn every_planted_bug_applies_to_the_sources() {
    let mut patches = 0;
    for entry in std::fs::read_dir(root().join(PLANTED)).unwrap().map(Result::unwrap) {
        assert!(applies(&entry.path()), "{} does not apply: write it anew", entry.path().display());
        patches += 1;
    }
    assert!(patches > 0);
    // A patch of a line that is not there does not.
    let folder = tempfile::tempdir().unwrap();
    let control = folder.path().join("control.patch");
    std::fs::write(
        &control,
        "--- a/src/lib.rs\n+++ b/src/lib.rs\n@@ -1,1 +1,1 @@\n-not this line\n+nor this one\n",
    )
    .unwrap();
    assert!(!applies(&control));
}

/// Findings in a tree with these files.
fn planted(files: &[(&str, &str)]) -> Vec<String> {
    let root = tempfile::tempdir().unwrap();
    for (path, text) in files {
        let path = root.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    findings(root.path()).into_iter().collect()
}

#[test]
fn files_that_use_each_other_are_a_circle() {
    let lib = ("src/lib.rs", "pub mod a; pub mod b;");
    let a = ("src/a.rs", "use crate::b::B; pub struct A(B);");
    assert_eq!(planted(&[lib, a, ("src/b.rs", "pub struct B;")]), [""; 0]);
    let circle = ["src/: circle of files: a, b"];
    for b in
        ["use super::a; pub struct B(Box<a::A>);", "pub struct B; fn f() { println!(\"{}\", crate::a::N) }"]
    {
        assert_eq!(planted(&[lib, a, ("src/b.rs", b)]), circle, "{b}");
    }
    // What only tests use, and what is in comments and texts, does not count.
    let b = "pub struct B; // crate::a::A\nconst C: &str = \"crate::a::A\";\n#[cfg(test)] mod tests { use crate::a::A; }";
    assert_eq!(planted(&[lib, a, ("src/b.rs", b)]), [""; 0]);
}

#[test]
fn a_module_that_reexports_from_a_child_that_uses_it_is_a_circle() {
    let parent = ("host-design/tool/src/p/mod.rs", "mod c; mod d; pub use c::C; pub struct P;");
    let child = |text| ("host-design/tool/src/p/c.rs", text);
    let d = ("host-design/tool/src/p/d.rs", "pub struct D;");
    assert_eq!(planted(&[parent, child("use super::d::D; pub struct C(D);"), d]), [""; 0]);
    let circle = ["host-design/tool/src/: circle of files: p/c, p/mod"];
    assert_eq!(planted(&[parent, child("use super::P; pub struct C(P);"), d]), circle);
    // A sibling may be reached through the parent.
    let d = ("host-design/tool/src/p/d.rs", "use super::C; pub struct D(C);");
    assert_eq!(planted(&[parent, child("pub struct C;"), d]), [""; 0]);
}

#[test]
fn folders_that_use_each_other_are_a_circle() {
    let files = [
        ("src/image/main.rs", "mod one; mod two;"),
        ("src/image/one/a.rs", "use crate::two::b::B;"),
        ("src/image/one/b.rs", "pub struct A;"),
        ("src/image/two/a.rs", "use crate::one::b::A;"),
        ("src/image/two/b.rs", "pub struct B;"),
    ];
    assert_eq!(planted(&files), ["src/image/: circle of folders in src/: one, two"]);
    assert_eq!(planted(&files[..4]), [""; 0]);
}

#[test]
fn a_name_for_two_types_and_what_is_too_long_are_found() {
    let [long, short] =
        [60, 58].map(|lines| format!("pub struct Same;\nfn f() {{\n{}}}\n", "g();\n".repeat(lines - 1)));
    let seven = "fn f(a: u8, b: u8, c: u8, d: u8, e: u8, f: u8, g: u8) {}";
    let of_a_trait =
        format!("trait T {{ {}; }} impl T for u8 {{ {seven} }}", seven.trim_end_matches("{}").trim());
    let comment = |columns: usize| format!("// {}", "ä".repeat(columns - 3));
    let found = planted(&[
        ("src/a.rs", &long),
        ("host-design/board/src/b.rs", &short),
        ("host-design/board/src/tests.rs", &short),
        ("tests/c.rs", seven),
        ("tests/e.rs", &of_a_trait),
        ("tests/f.rs", &format!("impl T for u8 {{ {seven} }}")),
        ("fuzz/f.rs", &format!("{}\n{}\n//! {}\n", comment(120), comment(121), "| a cell ".repeat(20))),
    ]);
    let wanted = [
        "fuzz/f.rs:2: a comment of more than 120 columns",
        "src/a.rs: fn f: more than 60 lines",
        "tests/c.rs: fn f: more than 6 arguments",
        "tests/e.rs: fn f: more than 6 arguments",
        "type Same: src/a.rs, host-design/board/src/b.rs",
    ];
    assert_eq!(found, wanted);
}
