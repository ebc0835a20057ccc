//! The documents: links work, folders exist, commands run in every shell.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Maximum number of lines in README.md.
const README_LINES: usize = 180;

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

pub(crate) fn read(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// Path and text of each document; paths start at the root of the repository.
fn documents() -> Vec<(String, String)> {
    let mut names = vec!["README.md".to_owned(), "ARCHITECTURE.md".to_owned(), "CONTRIBUTING.md".to_owned()];
    names.extend(["design", "page", "tool"].map(|name| format!("host-design/{name}/README.md")));
    for folder in ["docs", "docs/results"] {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            if name.ends_with(".md") {
                names.push(format!("{folder}/{name}"));
            }
        }
    }
    names.into_iter().map(|name| (name.clone(), read(&name))).collect()
}

/// Lines of the blocks that open with ``` and `mark`.
fn block_lines<'a>(text: &'a str, mark: &str) -> Vec<&'a str> {
    let (mut lines, mut inside) = (Vec::new(), false);
    for line in text.lines() {
        match line.strip_prefix("```") {
            Some(info) => inside = !inside && info == mark,
            None if inside && !line.is_empty() => lines.push(line),
            None => (),
        }
    }
    lines
}

/// The anchor that GitHub generates for a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.to_lowercase().replace(' ', "-");
    kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, '-' | '_')).collect()
}

fn has_anchor(text: &str, wanted: &str) -> bool {
    text.lines().any(|line| line.starts_with('#') && anchor(line.trim_start_matches('#').trim()) == wanted)
}

/// The broken links in `text`, which is in the folder `folder`.
fn broken_links(folder: &Path, text: &str) -> Vec<String> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target);
    let broken = |target: &&str| {
        let (file, heading) = target.split_once('#').unwrap_or((target, ""));
        if file.starts_with("http") {
            return false;
        }
        let found = if file.is_empty() {
            Some(text.to_owned())
        } else {
            std::fs::read(folder.join(file)).ok().map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
        };
        !found.is_some_and(|found| heading.is_empty() || has_anchor(&found, heading))
    };
    targets.filter(broken).map(str::to_owned).collect()
}

/// Reason why a command line does not work in both a POSIX shell and PowerShell, if there is one.
fn not_portable(line: &str) -> Option<&'static str> {
    let command = line.split(" # ").next().unwrap_or(line);
    let first = command.split_whitespace().next().unwrap_or_default();
    let bare: String = command.split(['"', '\'']).step_by(2).collect();
    if command.ends_with('\\') {
        Some("is continued with a backslash")
    } else if bare.contains("&&") || bare.contains("||") || bare.contains(';') {
        Some("holds two commands")
    } else if first.contains('=') || bare.contains('$') {
        Some("has a variable of the shell")
    } else if bare.contains(',') {
        Some("has a comma without quotes, which makes a list in PowerShell")
    } else if ["cp", "mv", "rm", "mkdir", "cat", "sed", "export"].contains(&first) {
        Some("calls a Unix program")
    } else {
        None
    }
}

#[test]
fn the_readme_is_a_front_page() {
    let lines = |text: &str| text.lines().count();
    assert!(lines(&read("README.md")) <= README_LINES, "{} lines", lines(&read("README.md")));
    assert!(lines(&"\n".repeat(README_LINES + 1)) > README_LINES);
}

#[test]
fn every_link_leads_somewhere() {
    for (name, text) in documents() {
        let file = root().join(&name);
        let broken = broken_links(file.parent().unwrap(), &text);
        assert!(broken.is_empty(), "{name}: {broken:?}");
    }
    let text = "# One heading\n[a](README.md) [b](nowhere.md) [c](README.md#licence) [d](README.md#nowhere) \
                [e](#one-heading) [f](#none) ![g](docs/step.svg) [h](https://example.org/x)";
    assert_eq!(broken_links(&root(), text), ["nowhere.md", "README.md#nowhere", "#none"]);
}

#[test]
fn every_command_works_in_powershell_too() {
    for (name, text) in documents() {
        for mark in ["sh", "sh (not run by CI)"] {
            for line in block_lines(&text, mark) {
                // CI's own programs need Linux, and their page says so.
                let found = not_portable(line).filter(|_| !line.starts_with(".ci/"));
                assert_eq!(found, None, "{name}: {line}");
            }
        }
    }
    for line in ["a \\", "a && b", "X=1 a", "a $X", "a --tilt 0.1,0.2", "cp a b"] {
        assert!(not_portable(line).is_some(), "{line}");
    }
    for line in ["a --tilt '0.1,0.2'", "a b=c:d # exit status 1"] {
        assert_eq!(not_portable(line), None, "{line}");
    }
}

#[test]
fn every_command_appears_in_one_document() {
    let repeated = |documents: &[(String, String)]| {
        let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (name, text) in documents {
            for line in block_lines(text, "sh") {
                places.entry(line.to_owned()).or_default().push(name.clone());
            }
        }
        places.into_iter().find(|(_, names)| names.len() > 1)
    };
    assert_eq!(repeated(&documents()), None);
    let page = |name: &str| (name.to_owned(), "```sh\na b\n```\n".to_owned());
    assert_eq!(repeated(&[page("x"), page("y")]), Some(("a b".into(), vec!["x".into(), "y".into()])));
}

/// Folders and files that ARCHITECTURE.md or CONTRIBUTING.md names.
fn named_paths(text: &str) -> Vec<&str> {
    let roots = ["src/", "host-design/", "tests/", "rigs/", "docs/", "fuzz/", ".ci/", "memory.x"];
    let code = text.split('`').skip(1).step_by(2);
    code.filter(|word| roots.iter().any(|root| word.starts_with(root)) && !word.contains(['*', ' ']))
        .collect()
}

fn folders(of: &str) -> Vec<String> {
    let entries = std::fs::read_dir(root().join(of)).unwrap().map(Result::unwrap);
    let folders = entries.filter(|entry| entry.path().is_dir());
    folders.map(|entry| format!("{of}/{}/", entry.file_name().into_string().unwrap())).collect()
}

#[test]
fn the_map_of_the_architecture_is_that_of_the_repository() {
    let [map, how_to_add] = ["ARCHITECTURE.md", "CONTRIBUTING.md"].map(read);
    let named = named_paths(&map);
    let is_made_later = |path: &str| path.contains("NAME") || path == "fuzz/artifacts/";
    for path in named.iter().chain(&named_paths(&how_to_add)).filter(|path| !is_made_later(path)) {
        assert!(root().join(path).exists(), "{path} does not exist");
    }
    let crates = ["closed-loop", "design", "identify", "plan", "tool", "trust"];
    let sources = crates.map(|name| format!("host-design/{name}/src"));
    for folder in folders("src").into_iter().chain(sources.iter().flat_map(|source| folders(source))) {
        assert!(named.contains(&folder.as_str()), "ARCHITECTURE.md: {folder} is not on the map");
    }
    let invented = "`src/control/` `src/*.rs` `Board` `src/nowhere/`";
    assert_eq!(named_paths(invented), ["src/control/", "src/nowhere/"]);
    assert!(!root().join("src/nowhere/").exists());
}
