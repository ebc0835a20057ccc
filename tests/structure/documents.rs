//! The length of the guides. Results, in `docs/results/`, may be longer, but say when and how they were made.

use std::path::Path;

/// README.md, ARCHITECTURE.md and the pages in `docs/`, each.
const MOST_WORDS_OF_A_PAGE: usize = 2000;
/// All of them together.
const MOST_WORDS: usize = 22_000;

/// The words of a page, of which each has a letter or a digit. Tables and listings that a test compares with the code,
/// between `<!-- name -->` and `<!-- /name -->`, are not counted.
fn words(page: &str) -> usize {
    let (before, rest) = page.split_once("<!-- ").unwrap_or((page, ""));
    let (name, rest) = rest.split_once(" -->").unwrap_or((rest, ""));
    let after = rest.split_once(&format!("<!-- /{name} -->")).map_or(rest, |(_, after)| after);
    let is_word = |word: &&str| word.chars().any(char::is_alphanumeric);
    let here = before.split_whitespace().filter(is_word).count();
    if after.is_empty() { here } else { here + words(after) }
}

/// Names and texts of the pages in a folder.
fn pages(folder: &Path) -> Vec<(String, String)> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let pages = paths.filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    pages.map(|path| (path.display().to_string(), std::fs::read_to_string(&path).unwrap())).collect()
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
    let names_a_command = ["`cargo ", "`upright ", "the command"].iter().any(|words| first.contains(words));
    first.split_whitespace().any(is_day) && names_a_command
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
    assert_eq!(
        words("one\n<!-- keys -->\n| a | b |\n<!-- /keys -->\ntwo <!-- pins -->\n| c |\n<!-- /pins -->"),
        2
    );
    assert_eq!(words("one <!-- open -->\nall of this is counted"), 6);
}

#[test]
fn every_result_says_when_and_how_it_was_made() {
    let results = pages(&super::root().join("docs/results"));
    assert!(results.len() > 3);
    for (name, text) in results {
        assert!(is_dated(&text), "{name}: the first paragraph has no day, or no command");
    }
    assert!(is_dated("# Results\n\nMade on 2026-11-26 by `cargo upright coverage`.\n"));
    assert!(!is_dated("# Results\n\nMade in November 2026 by `cargo upright coverage`.\n"));
    assert!(!is_dated("# Results\n\nMade on 2026-11-26.\n"));
}
