//! Changes single values in the text of a rig file. The rest of the text, comments included, stays as it is.

use std::fmt;
use std::path::{Path, PathBuf};

use toml_edit::{DocumentMut, Item, Table, Value};

use super::base::Base;
use super::error::{RigError, RigErrorKind};
use super::node::RigSource;

/// The text of a rig file, in which values can be changed. Displayed, it is the new text.
///
/// ```
/// use upright_design::rig::RigText;
///
/// let mut text = RigText::parse("[tick] # fast\nperiod_s = 0.001\n", "rig.toml".as_ref())?;
/// text.set("tick.period_s", "0.002")?;
/// text.set("tick.delay_ticks", "1")?;
/// assert_eq!(text.to_string(), "[tick] # fast\nperiod_s = 0.002\ndelay_ticks = 1\n");
/// # Ok::<(), upright_design::rig::RigError>(())
/// ```
#[derive(Debug, Clone)]
pub struct RigText {
    document: DocumentMut,
    /// What carries the links: keys are given as in a file with a cart, and written as in one with this base.
    base: Base,
    file: PathBuf,
    /// Whether lines end with a carriage return and a line feed.
    has_crlf: bool,
}

impl RigText {
    /// The text of a rig file; `file` is the name that errors show.
    ///
    /// # Errors
    /// [`RigError`] if the text is not TOML.
    pub fn parse(text: &str, file: &Path) -> Result<Self, RigError> {
        let document = RigSource { file, text, base: Base::Cart }.document()?.into_mut();
        let base = Base::of(&document);
        Ok(Self { document, base, file: file.to_owned(), has_crlf: text.contains("\r\n") })
    }

    /// Whether the text gives `key`: `tick.period_s`, `link[2].mass_kg`, `lqr.state_weights[1]`.
    pub fn has(&self, key: &str) -> bool {
        found(self.document.as_item(), &self.base.path(key)).is_some()
    }

    /// Every key of the text with its value as it is written, in the order of the text: `link[2].mass_kg`, `0.23`.
    pub fn values(&self) -> Vec<(String, String)> {
        let mut values = Vec::new();
        collect(self.document.as_item(), "", &mut values);
        values
    }

    /// The number that the text gives `key`; none if it gives none.
    pub fn number(&self, key: &str) -> Option<f64> {
        let item = found(self.document.as_item(), &self.base.path(key))?;
        item.as_float().or_else(|| item.as_integer().map(|number| number as f64))
    }

    /// Gives `key` this value, in TOML syntax. A key that is missing is added, with its section.
    ///
    /// # Errors
    /// [`RigError`] if there is no such entry of a list, or if `value` is not TOML.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), RigError> {
        let key = &*self.base.path(key);
        let file = self.file.clone();
        let refused = |kind| RigError { key: Some(key.to_owned()), ..RigError::of_file(&file, kind) };
        let mut value: Value = value.parse().map_err(|error: toml_edit::TomlError| {
            refused(RigErrorKind::NotToml { message: error.message().to_owned() })
        })?;
        if let Some((section, _)) = key.split_once('.')
            && !section.contains('[')
            && !self.document.contains_key(section)
        {
            self.add(section);
        }
        let remedy = "it to the rig file: then it can be changed".to_owned();
        let item = place(self.document.as_item_mut(), key)
            .ok_or_else(|| refused(RigErrorKind::MissingKey { remedy }))?;
        if let Some(old) = item.as_value() {
            *value.decor_mut() = old.decor().clone();
        }
        *item = Item::Value(value);
        Ok(())
    }

    /// Takes `key` out, with the comment on its line. A key that is not there stays absent.
    pub fn remove(&mut self, key: &str) {
        let key = &*self.base.path(key);
        let (parent, name) = key.rsplit_once('.').unwrap_or(("", key));
        let table = match parent {
            "" => Some(self.document.as_item_mut()),
            _ => place(self.document.as_item_mut(), parent),
        };
        if let Some(table) = table.and_then(Item::as_table_like_mut) {
            table.remove(name);
        }
    }

    /// Gives the list `key` this many entries, be it an array or sections such as `[[link]]`: each new one is a copy of
    /// the one `period` entries before it. A list that is not in the text, or has fewer than `period`, stays as it is.
    pub fn resize(&mut self, key: &str, length: usize, period: usize) {
        if !self.has(key) {
            return;
        }
        match place(self.document.as_item_mut(), key) {
            Some(Item::ArrayOfTables(tables)) => {
                while tables.len() > length.max(1) {
                    tables.remove(tables.len() - 1);
                }
                while tables.len() < length {
                    let before = tables.len().checked_sub(period).and_then(|number| tables.get(number));
                    let Some(mut copy) = before.cloned() else { return };
                    copy.decor_mut().set_prefix("\n");
                    tables.push(copy);
                }
            }
            Some(Item::Value(Value::Array(array))) => {
                while array.len() > length {
                    array.remove(array.len() - 1);
                }
                while array.len() < length {
                    let before = array.len().checked_sub(period).and_then(|number| array.get(number));
                    let Some(copy) = before.cloned() else { return };
                    array.push_formatted(copy.decorated(" ", ""));
                }
            }
            _ => {}
        }
    }

    /// Adds an empty section below all of the text.
    fn add(&mut self, section: &str) {
        let comments = self.document.trailing().as_str().unwrap_or_default().to_owned();
        let mut table = Table::new();
        table.decor_mut().set_prefix(format!("{comments}\n"));
        self.document.set_trailing("");
        self.document.insert(section, Item::Table(table));
    }
}

impl fmt::Display for RigText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.document.to_string();
        match self.has_crlf {
            true => f.write_str(&text.replace("\r\n", "\n").replace('\n', "\r\n")),
            false => f.write_str(&text),
        }
    }
}

/// The place of the value of `key`; it holds none if the key is new. None if a list has no such entry.
fn place<'a>(document: &'a mut Item, key: &str) -> Option<&'a mut Item> {
    key.split('.').try_fold(document, |item, step| {
        let table = item.as_table_like_mut()?;
        match indexed(step) {
            (name, Some(index)) => table.get_mut(name)?.get_mut(index),
            (name, None) => Some(table.entry(name).or_insert(Item::None)),
        }
    })
}

/// The offset at which `text` gives `key`; none if it does not, or is not TOML.
pub(super) fn place_in(text: &str, key: &str) -> Option<usize> {
    let document = RigSource { file: Path::new(""), text, base: Base::Cart }.document().ok()?;
    found(document.as_item(), &Base::of(&document).path(key))?.span().map(|span| span.start)
}

/// Adds what stands below `key` in `item`.
fn collect(item: &Item, key: &str, values: &mut Vec<(String, String)>) {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    let number = |index: usize| format!("{key}[{}]", index + 1);
    if let Some(table) = item.as_table_like() {
        table.iter().for_each(|(name, inner)| collect(inner, &below(name), values));
    } else if let Some(tables) = item.as_array_of_tables() {
        for (index, table) in tables.iter().enumerate() {
            collect(&Item::Table(table.clone()), &number(index), values);
        }
    } else if let Some(tables) = item.as_array().filter(|array| array.iter().any(Value::is_inline_table)) {
        for (index, table) in tables.iter().enumerate() {
            collect(&Item::Value(table.clone()), &number(index), values);
        }
    } else if let Some(value) = item.as_value() {
        values.push((key.to_owned(), value.clone().decorated("", "").to_string()));
    }
}

/// What stands at `key`; none if nothing does.
fn found<'a>(document: &'a Item, key: &str) -> Option<&'a Item> {
    key.split('.').try_fold(document, |item, step| {
        let (name, index) = indexed(step);
        let item = item.get(name)?;
        index.map_or(Some(item), |index| item.get(index))
    })
}

/// Splits `name[2]` into the name and the index 1.
fn indexed(step: &str) -> (&str, Option<usize>) {
    let index = step.strip_suffix(']').and_then(|rest| rest.split_once('['));
    match index.and_then(|(name, index)| Some((name, index.parse::<usize>().ok()?.checked_sub(1)?))) {
        Some((name, index)) => (name, Some(index)),
        None => (step, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# head\nname = \"a\" # mine\n\n[[link]]\nmass_kg = 1\n[[link]]\nmass_kg = 2 # second\n\
        \n# about time\n[tick]\nperiod_s = 0.001\n# last\n";

    /// `text` with `value` for `key`.
    fn changed(text: &str, key: &str, value: &str) -> Result<String, RigError> {
        let mut text = RigText::parse(text, "rig.toml".as_ref()).unwrap();
        text.set(key, value)?;
        assert!(text.has(key));
        Ok(text.to_string())
    }

    #[test]
    fn a_value_changes_and_all_else_stays() {
        let edited = |key: &str, value: &str| changed(TEXT, key, value).unwrap();
        assert_eq!(RigText::parse(TEXT, "rig.toml".as_ref()).unwrap().to_string(), TEXT);
        assert_eq!(edited("link[2].mass_kg", "3e-7"), TEXT.replace("2 # second", "3e-7 # second"));
        assert_eq!(edited("name", "\"b\""), TEXT.replace("\"a\"", "\"b\""));
        let lists = "[lqr]\nstate_weights = [ 1, 2, # two\n  3 ]\n";
        assert_eq!(changed(lists, "lqr.state_weights[2]", "7").unwrap(), lists.replace("2,", "7,"));
        let windows = TEXT.replace('\n', "\r\n");
        assert_eq!(changed(&windows, "tick.period_s", "2").unwrap(), windows.replace("0.001", "2"));
    }

    #[test]
    fn a_key_that_is_removed_takes_its_line_along() {
        let mut text = RigText::parse(TEXT, "rig.toml".as_ref()).unwrap();
        text.remove("link[2].mass_kg");
        text.remove("link[2].tip_mass_kg");
        text.remove("link[3].mass_kg");
        text.remove("motor.mass_kg");
        assert_eq!(text.to_string(), TEXT.replace("mass_kg = 2 # second\n", ""));
    }

    #[test]
    fn all_values_are_listed_with_their_keys_however_they_are_written() {
        let listed = |text: &str| RigText::parse(text, "rig.toml".as_ref()).unwrap().values();
        let all = |pairs: &[(&str, &str)]| -> Vec<(String, String)> {
            pairs.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect()
        };
        let values = [
            ("name", "\"a\""),
            ("link[1].mass_kg", "1"),
            ("link[2].mass_kg", "2"),
            ("tick.period_s", "0.001"),
        ];
        assert_eq!(listed(TEXT), all(&values));
        let inline =
            "link = [ { mass_kg = 1 } ] # one\ntick.period_s = 2\nlqr = { state_weights = [1, 2] }\n";
        let values = [("link[1].mass_kg", "1"), ("tick.period_s", "2"), ("lqr.state_weights", "[1, 2]")];
        assert_eq!(listed(inline), all(&values));
    }

    #[test]
    fn a_list_grows_by_copies_and_shrinks_from_its_end() {
        let resized = |text: &str, key: &str, length: usize, period: usize| {
            let mut text = RigText::parse(text, "rig.toml".as_ref()).unwrap();
            text.resize(key, length, period);
            text.to_string()
        };
        let third = "mass_kg = 2 # second\n\n[[link]]\nmass_kg = 2 # second\n";
        assert_eq!(resized(TEXT, "link", 3, 1), TEXT.replace("mass_kg = 2 # second\n", third));
        assert_eq!(resized(TEXT, "link", 1, 1), TEXT.replace("[[link]]\nmass_kg = 2 # second\n", ""));
        let array = "[lqr]\nstate_weights = [1, 2, 3, 4] # all\n";
        assert_eq!(resized(array, "lqr.state_weights", 6, 2), array.replace("4]", "4, 3, 4]"));
        assert_eq!(resized(array, "lqr.state_weights", 2, 2), array.replace(", 3, 4]", "]"));
        for (key, period) in [("lqr.far_poles", 1), ("lqr.state_weights", 5), ("lqr", 1)] {
            assert_eq!(resized(array, key, 6, period), array, "{key}");
        }
    }

    #[test]
    fn a_missing_key_comes_last_in_its_section_and_a_missing_section_last_in_the_file() {
        let edited = |key: &str| changed(TEXT, key, "7").unwrap();
        assert_eq!(edited("link[1].length_m"), TEXT.replace("mass_kg = 1\n", "mass_kg = 1\nlength_m = 7\n"));
        assert_eq!(edited("tick.delay_ticks"), TEXT.replace("0.001\n", "0.001\ndelay_ticks = 7\n"));
        assert_eq!(edited("verify.tilt_rad"), format!("{TEXT}\n[verify]\ntilt_rad = 7\n"));
        assert_eq!(edited("gravity"), TEXT.replace("# mine\n", "# mine\ngravity = 7\n"));
    }

    #[test]
    fn keys_with_dots_and_tables_on_one_line_change_where_they_stand() {
        let dotted = "tick.period_s = 1\n[cart]\nmass_kg = 2\n";
        assert_eq!(changed(dotted, "tick.period_s", "7").unwrap(), dotted.replace('1', "7"));
        assert_eq!(
            changed(dotted, "tick.delay_ticks", "7").unwrap(),
            dotted.replace("1\n", "1\ntick.delay_ticks = 7\n")
        );
        let inline = "link = [ { mass_kg = 1 }, { mass_kg = 2 } ] # two\ntick = { period_s = 3 }\n";
        assert_eq!(changed(inline, "link[2].mass_kg", "7").unwrap(), inline.replace('2', "7"));
        assert_eq!(
            changed(inline, "tick.delay_ticks", "7").unwrap(),
            inline.replace("{ period_s = 3 }", "{ period_s = 3 , delay_ticks = 7 }")
        );
    }

    #[test]
    fn an_entry_that_a_list_does_not_have_is_refused() {
        for key in ["link[3].mass_kg", "link[0].mass_kg", "joint[1].mass_kg", "name.first"] {
            let error = changed(TEXT, key, "1").unwrap_err().to_string();
            assert!(error.starts_with(&format!("rig.toml: {key}: missing; add it")), "{error}");
        }
        assert!(changed(TEXT, "name", "[1").is_err());
        assert!(!RigText::parse(TEXT, "rig.toml".as_ref()).unwrap().has("tick.delay_ticks"));
    }
}
