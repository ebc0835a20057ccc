//! The length of the guides. Results, in `docs/results/`, may be longer, but say when and how they were made.

use std::path::Path;

/// README.md, ARCHITECTURE.md and the pages in `docs/`, each.
const MOST_WORDS_OF_A_PAGE: usize = 2000;
/// All of them together.
const MOST_WORDS: usize = 22_000;

/// The words of a page: a path, a link or a command has several, a name in `snake_case` is one. Tables and listings
/// that a test compares with the code, between `<!-- name -->` and `<!-- /name -->`, are not counted.
fn words(page: &str) -> usize {
    let (before, rest) = page.split_once("<!-- ").unwrap_or((page, ""));
    let (name, rest) = rest.split_once(" -->").unwrap_or((rest, ""));
    let after = rest.split_once(&format!("<!-- /{name} -->")).map_or(rest, |(_, after)| after);
    let is_between = |c: char| !c.is_alphanumeric() && c != '_';
    let here = before.split(is_between).filter(|word| !word.is_empty()).count();
    if after.is_empty() { here } else { here + words(after) }
}

/// Names and texts of the pages in a folder.
fn pages(folder: &Path) -> Vec<(String, String)> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let pages = paths.filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    pages.map(|path| (path.display().to_string(), std::fs::read_to_string(&path).unwrap())).collect()
}

/// The pages of results, without their index.
fn results() -> Vec<(String, String)> {
    let mut results = pages(&super::root().join("docs/results"));
    results.retain(|(name, _)| !name.ends_with("README.md"));
    assert!(results.len() > 10);
    results
}

/// What is too long, a line each.
fn too_long(guides: &[(String, String)]) -> Vec<String> {
    let counts: Vec<(&str, usize)> = guides.iter().map(|(name, text)| (name.as_str(), words(text))).collect();
    let long = counts.iter().filter(|(_, count)| *count >= MOST_WORDS_OF_A_PAGE);
    let mut found: Vec<String> = long.map(|(name, count)| format!("{name}: {count} words")).collect();
    let all: usize = counts.iter().map(|(_, count)| count).sum();
    if all > MOST_WORDS {
        found.push(format!("all guides: {all} words"));
    }
    found
}

/// Whether the first paragraph names a day and a command.
fn is_dated(result: &str) -> bool {
    let first = result.split("\n\n").nth(1).unwrap_or_default();
    let is_day = |word: &str| {
        let parts: Vec<&str> = word.trim_matches([',', '.', ':']).split('-').collect();
        parts.iter().map(|part| part.len()).eq([4, 2, 2])
            && parts.iter().all(|part| part.bytes().all(|byte| byte.is_ascii_digit()))
    };
    let names_a_command =
        ["`cargo ", "`upright ", "docs/results/make "].iter().any(|words| first.contains(words));
    first.split_whitespace().any(is_day) && names_a_command
}

/// The lines that no command writes: tables outside of what a test compares, and blocks of text that are empty or have
/// no commands before them, whose output `docs/results/make` puts there.
fn written_by_hand(result: &str) -> Vec<&str> {
    let (mut last_block, mut is_inside, mut is_compared, mut found) = ("", false, false, Vec::new());
    for (before, line) in std::iter::once("").chain(result.lines()).zip(result.lines()) {
        if let Some(mark) = line.strip_prefix("<!-- ") {
            is_compared = !mark.starts_with('/');
        }
        if line.starts_with("```") {
            is_inside = !is_inside;
            let is_made = last_block == "```sh (makes the text below)";
            if is_inside && line == "```text" && !is_made || !is_inside && before == "```text" {
                found.push(line);
            }
            last_block = if is_inside { line } else { last_block };
        } else if line.starts_with('|') && !is_inside && !is_compared {
            found.push(line);
        }
    }
    found
}

#[test]
fn no_guide_is_too_long_nor_all_together() {
    let mut guides = pages(&super::root().join("docs"));
    guides.extend(
        pages(&super::root())
            .into_iter()
            .filter(|(name, _)| name.ends_with("README.md") || name.ends_with("ARCHITECTURE.md")),
    );
    assert!(guides.len() > 20);
    let found = too_long(&guides);
    assert!(
        found.is_empty(),
        "shorten these, or move what was measured to docs/results/:\n{}",
        found.join("\n")
    );
    // A page that is too long, and many that are short.
    let page = |count| (format!("{count}.md"), "word ".repeat(count));
    assert_eq!(too_long(&[page(1999)]), [""; 0]);
    assert_eq!(too_long(&[page(2000)]), ["2000.md: 2000 words"]);
    assert_eq!(too_long(&vec![page(1000); 23]), ["all guides: 23000 words"]);
}

#[test]
fn tables_that_a_test_compares_are_not_counted() {
    assert_eq!(words("one two"), 2);
    assert_eq!(words("| one | 2 | - |"), 2);
    assert_eq!(words("[the limit](rig-file.md#all-keys) `force_limit_n`"), 8);
    assert_eq!(
        words("one\n<!-- keys -->\n| a | b |\n<!-- /keys -->\ntwo <!-- pins -->\n| c |\n<!-- /pins -->"),
        2
    );
    assert_eq!(words("one <!-- open -->\nall of this is counted"), 6);
}

#[test]
fn every_result_says_when_and_how_it_was_made() {
    for (name, text) in results() {
        assert!(is_dated(&text), "{name}: the first paragraph has no day, or no command");
    }
    assert!(is_dated("# Results\n\nMade on 2026-11-26 by `cargo upright identify --coverage`.\n"));
    assert!(!is_dated("# Results\n\nMade in November 2026 by `cargo upright identify --coverage`.\n"));
    assert!(!is_dated("# Results\n\nMade on 2026-11-26.\n"));
}

#[test]
fn every_number_in_a_table_of_results_is_written_by_a_command() {
    for (name, text) in results() {
        assert_eq!(written_by_hand(&text), [""; 0], "{name}: see docs/results/make");
    }
    let made = "```sh (makes the text below)\ncargo upright verify RIG\n```\n\n```text\n1 | 2\n```\n";
    assert_eq!(written_by_hand(made), [""; 0]);
    assert_eq!(written_by_hand(&made.replace(" (makes the text below)", "")), ["```text"]);
    assert_eq!(written_by_hand(&format!("{made}\n```text\n3\n```\n")), ["```text"]);
    assert_eq!(written_by_hand(&made.replace("1 | 2\n", "")), ["```"]);
    assert_eq!(written_by_hand("<!-- chips -->\n| 1 |\n<!-- /chips -->\n| 2 |\n"), ["| 2 |"]);
}
