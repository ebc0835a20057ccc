//! The documentation's table of faults is the one in the source.

use upright::supervision::fault::Fault;

const BEGIN: &str = "<!-- faults: begin -->";
const END: &str = "<!-- faults: end -->";

/// The table as Markdown.
fn rendered() -> String {
    let mut table = String::from(
        "| code | fault | condition | ticks to motor off | what to do |\n|---|---|---|---|---|\n",
    );
    for entry in Fault::ALL {
        table += &format!(
            "| {} | {} | {} | {} | {} |\n",
            entry.fault.code(),
            entry.name,
            entry.condition,
            entry.reaction,
            entry.remedy
        );
    }
    table
}

/// What stands between the markers.
fn between<'a>(page: &'a str, begin: &str, end: &str) -> Option<&'a str> {
    Some(page.split_once(begin)?.1.split_once(end)?.0.trim())
}

#[test]
fn the_page_about_faults_holds_the_table_of_the_source() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/faults.md")).unwrap();
    let found = between(&page, BEGIN, END).unwrap_or_else(|| panic!("docs/faults.md has no {BEGIN} … {END}"));
    let wanted = rendered();
    assert_eq!(found, wanted.trim(), "put this between the markers in docs/faults.md:\n{wanted}");
}

#[test]
fn a_changed_word_of_the_table_would_be_noticed() {
    let page = format!("{BEGIN}\n{}\n{END}", rendered().replacen("leans", "leant", 1));
    assert_ne!(between(&page, BEGIN, END), Some(rendered().trim()));
    let page = format!("{BEGIN}\n{}\n{END}", rendered());
    assert_eq!(between(&page, BEGIN, END), Some(rendered().trim()));
    assert_eq!(between("no table", BEGIN, END), None);
}
