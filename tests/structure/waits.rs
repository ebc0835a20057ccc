//! No test waits without a limit: what waits is in `tests/support/src/limits.rs`.

use std::path::Path;

/// Calls that wait for a program, a thread or a connection for as long as it takes.
const UNLIMITED: [&str; 6] =
    [".output()", ".wait_with_output()", ".wait()", ".recv()", ".accept()", ".read_line("];

/// The folders of tests and benches that wait for something.
const FOLDERS: [&str; 9] = [
    "host-design/command/tests",
    "host-design/tool/tests",
    "host-design/design/tests",
    "host-design/identify/tests",
    "host-design/paper/tests",
    "host-design/plan/tests",
    "host-design/trust/tests",
    "host-design/board/tests",
    "tests/suite",
];

/// Places of such calls in a text, as `name:line`. Asking a program for its version starts nothing that could wait.
fn unlimited(name: &str, text: &str) -> Vec<String> {
    let waits =
        |line: &str| UNLIMITED.iter().any(|call| line.contains(call)) && !line.contains("\"--version\"");
    (1..)
        .zip(text.lines())
        .filter(|(_, line)| waits(line))
        .map(|(number, _)| format!("{name}:{number}"))
        .collect()
}

fn add_unlimited(folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() {
            add_unlimited(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.extend(unlimited(&path.display().to_string(), &std::fs::read_to_string(&path).unwrap()));
        }
    }
}

#[test]
fn no_test_waits_without_a_limit() {
    let mut found = Vec::new();
    for folder in FOLDERS {
        add_unlimited(&crate::root().join(folder), &mut found);
    }
    assert!(found.is_empty(), "use tests/support/src/limits.rs:\n{}", found.join("\n"));
    // Negative control.
    let waiting =
        "Command::new(\"x\").arg(\"--version\").output()\nchild.wait_with_output()\nreceiver.recv().unwrap()";
    assert_eq!(unlimited("a.rs", waiting), ["a.rs:2", "a.rs:3"]);
}
