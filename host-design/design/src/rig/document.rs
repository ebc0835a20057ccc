//! The table of keys for the documentation.

use super::key::Key;
use super::sections::{SECTIONS, TOP};

/// All sections and keys as a Markdown table with the columns key, meaning, accepted and default.
pub fn key_table() -> String {
    let mut table = "| key | meaning | accepted | default |\n|---|---|---|---|\n".to_owned();
    table.extend(TOP.keys().map(row));
    for section in SECTIONS {
        table
            .push_str(&format!("| **`{}`** | {} | | {} |\n", section.title, section.meaning, section.absent));
        table.extend(section.keys().map(row));
    }
    table
}

fn row(key: &Key) -> String {
    let unit = if key.unit.is_empty() { String::new() } else { format!(" ({})", key.unit) };
    format!("| `{}` | {}{unit} | {} | {} |\n", key.name, key.meaning, key.rule.accepts, key.absent)
}
