//! Changes single values in the text of a rig file. The rest of the text, comments included, stays as it is.

use toml_edit::{Document, Item, TableLike};

/// The text of a rig file after one value was changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edited {
    /// The new text.
    pub text: String,
    /// Whether the key was missing and has been added.
    pub added: bool,
}

/// Returns `text` with `value`, in TOML syntax, as the value of `key`: `tick.period_s`, `link[2].mass_kg`,
/// `lqr.state_weights[1]`. A missing key is added. `None` if the text is not TOML or has no place for the key.
pub fn with_value(text: &str, key: &str, value: &str) -> Option<Edited> {
    match place(text, key) {
        Place::At(span) => {
            let text = format!("{}{value}{}", &text[..span.start], &text[span.end..]);
            Some(Edited { text, added: false })
        }
        Place::New { at, prefix } => {
            let text = format!("{}{prefix} = {value}\n{}", &text[..at], &text[at..]);
            Some(Edited { text, added: true })
        }
        Place::Nowhere => None,
    }
}

/// Finds the place of the value of `key` in `text`.
fn place(text: &str, key: &str) -> Place {
    let Ok(document) = Document::parse(text) else { return Place::Nowhere };
    let mut steps = key.split('.').peekable();
    let mut table: &dyn TableLike = document.as_table();
    let mut header = String::new();
    let mut number = 0; // which of the tables with that header, from 0
    while let Some(step) = steps.next() {
        let (name, index) = indexed(step);
        let item = table.get(name);
        match (item, steps.peek(), index) {
            (Some(item), None, None) => return item.span().map_or(Place::Nowhere, Place::At),
            (Some(item), None, Some(index)) => {
                let entry = item.as_array().and_then(|array| array.get(index));
                return entry.and_then(|entry| entry.span()).map_or(Place::Nowhere, Place::At);
            }
            (Some(item), Some(_), index) => {
                let inner = match (item, index) {
                    (Item::ArrayOfTables(tables), Some(index)) => {
                        (header, number) = (format!("[[{name}]]"), index);
                        tables.get(index).map(|table| table as &dyn TableLike)
                    }
                    (item, None) => {
                        (header, number) = (format!("[{name}]"), 0);
                        item.as_table_like()
                    }
                    _ => None,
                };
                match inner {
                    Some(inner) => table = inner,
                    None => return Place::Nowhere,
                }
            }
            (None, None, None) => return new_line(text, &header, number, name),
            (None, Some(key), None) => {
                return Place::New { at: text.len(), prefix: format!("\n[{name}]\n{key}") };
            }
            (None, _, Some(_)) => return Place::Nowhere,
        }
    }
    Place::Nowhere
}

enum Place {
    /// The value takes these bytes.
    At(core::ops::Range<usize>),
    /// The key is missing: insert `prefix` and then the value at the byte `at`.
    New { at: usize, prefix: String },
    /// The text has no place for the key.
    Nowhere,
}

/// Splits `name[2]` into the name and the index 1.
fn indexed(step: &str) -> (&str, Option<usize>) {
    let index = step.strip_suffix(']').and_then(|rest| rest.split_once('['));
    match index.and_then(|(name, index)| Some((name, index.parse::<usize>().ok()?.checked_sub(1)?))) {
        Some((name, index)) => (name, Some(index)),
        None => (step, None),
    }
}

/// The place of a new line `name = …`: below the occurrence `number` (from 0) of `header`, or at the top of the file
/// if `header` is empty.
fn new_line(text: &str, header: &str, number: usize, name: &str) -> Place {
    if header.is_empty() {
        return Place::New { at: 0, prefix: name.to_owned() };
    }
    let mut at = 0;
    let mut found = 0;
    for line in text.split_inclusive('\n') {
        at += line.len();
        let bare = line.split('#').next().unwrap_or_default().trim();
        if bare == header {
            if found == number {
                let prefix = if line.ends_with('\n') { name.to_owned() } else { format!("\n{name}") };
                return Place::New { at, prefix };
            }
            found += 1;
        }
    }
    Place::Nowhere
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_changes_and_all_else_stays() {
        let text = "name = \"a\" # mine\n[[link]]\nmass_kg = 1\n[[link]]\nmass_kg = 2 # second\n[tick]\nperiod_s = 0.001\n";
        let edited = |key: &str, value: &str| with_value(text, key, value).unwrap();
        assert_eq!(edited("link[2].mass_kg", "3").text, text.replace("2 # second", "3 # second"));
        assert_eq!(edited("name", "\"b\"").text, text.replace("\"a\"", "\"b\""));
        let added = edited("tick.delay_ticks", "1");
        assert!(added.added && added.text.contains("[tick]\ndelay_ticks = 1\nperiod_s"));
        assert!(edited("verify.tilt_rad", "0.1").text.ends_with("\n[verify]\ntilt_rad = 0.1\n"));
        assert_eq!(with_value(text, "link[3].mass_kg", "1"), None);
    }

    #[test]
    fn values_are_replaced_and_added() {
        const TEXT: &str =
            "name = \"a\"\n[cart]\nmass_kg = 1 # one\n[[link]]\nmass_kg = 2\n[[link]]\nmass_kg = 3\n";
        let changed = |key: &str| with_value(TEXT, key, "7").map(|edited| edited.text);
        assert_eq!(changed("cart.mass_kg").unwrap(), TEXT.replace("= 1 #", "= 7 #"));
        assert_eq!(changed("link[2].mass_kg").unwrap(), TEXT.replace('3', "7"));
        assert_eq!(
            changed("link[1].length_m").unwrap(),
            TEXT.replacen("[[link]]", "[[link]]\nlength_m = 7", 1)
        );
        assert!(changed("reality.rail_tilt_rad").unwrap().ends_with("[reality]\nrail_tilt_rad = 7\n"));
        assert_eq!(changed("link[3].mass_kg"), None);
    }
}
