//! The table of keys for the documentation.

use super::base::Base;
use super::key::{Key, Section};
use super::sections::{SECTIONS, TOP};

/// All sections and keys as a Markdown table with the columns key, meaning, accepted and default.
pub fn key_table() -> String {
    let mut table = "| key | meaning | accepted | default |\n|---|---|---|---|\n".to_owned();
    table.extend(TOP.keys().map(|key| row(&TOP, key)));
    for section in SECTIONS {
        table.push_str(&format!(
            "| **{}** | {} | | {} |\n",
            titles(section),
            section.meaning,
            section.absent
        ));
        table.extend(section.keys().map(|key| row(section, key)));
    }
    table
}

/// The section as a file with a cart writes it, and as one with an arm does.
fn titles(section: &Section) -> String {
    let (title, arm) = (section.title, Base::Arm.words(section.title));
    if arm == title { format!("`{title}`") } else { format!("`{title}`, or `{arm}`") }
}

/// A key with the name, the unit and the default that it has in a file with an arm, where they differ.
fn row(section: &'static Section, key: &Key) -> String {
    let on_arm = Base::Arm.key(section, key.name);
    let both =
        |cart: String, arm: String| if cart == arm { cart } else { format!("{cart}; of an arm {arm}") };
    let name = match [Base::Cart, Base::Arm].map(|base| base.has(section, key.name)) {
        [true, true] => both(format!("`{}`", key.name), format!("`{}`", on_arm.name)),
        [true, false] => format!("`{}`, of a cart", key.name),
        _ => format!("`{}`, of an arm", key.name),
    };
    let units =
        if on_arm.unit == key.unit { key.unit.to_owned() } else { format!("{}; {}", key.unit, on_arm.unit) };
    let unit = if units.is_empty() { units } else { format!(" ({units})") };
    let has = Base::Arm.has(section, key.name);
    let absent = both(key.absent.to_string(), if has { &on_arm } else { key }.absent.to_string());
    format!("| {name} | {}{unit} | {} | {absent} |\n", key.meaning, key.rule.accepts)
}
