//! Labs: what a class works on, step by step, as a teacher writes it.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use toml_edit::{DocumentMut, Item, TomlError, Value as TomlValue};
use upright_design::rig::RigText;

use crate::refusal::{FILE, PageRefusal};
use crate::task::LabTask;

/// A lab as its author writes it in TOML; texts are for the student, in paragraphs.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lab {
    /// Its name.
    pub title: String,
    /// Time that it takes (minutes).
    pub minutes: u32,
    /// What one can do afterwards.
    pub goals: String,
    /// The rig, by the name of an example.
    pub rig: String,
    /// Numbers of the rig that differ from student to student: keys, and by how many percent at most.
    #[serde(default)]
    pub vary: Vec<(String, f64)>,
    /// The steps, in their order.
    #[serde(rename = "step")]
    pub steps: Vec<LabStep>,
    /// The lab as the page has it.
    #[serde(skip)]
    shown: Value,
}

/// A step of a lab.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabStep {
    /// What to do.
    pub text: String,
    /// Hints, which a student asks for one by one.
    #[serde(default)]
    pub hints: Vec<String>,
    /// What to see, shown once the step is solved.
    pub see: String,
    /// What is asked for.
    pub task: LabTask,
    /// Answers for the test of the step.
    #[serde(default)]
    pub tested: TestedAnswers,
}

/// Answers of which it is known how they are marked, for the rig as it is in its file.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestedAnswers {
    /// The intended one.
    pub right: LabAnswer,
    /// Wrong ones.
    pub wrong: Vec<LabAnswer>,
}

/// What a student answers: numbers, or other values of keys of the rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum LabAnswer {
    /// Numbers.
    Numbers(Vec<f64>),
    /// Keys of the rig with their values in TOML; without a value, the key is left out.
    Changes(Vec<(String, Option<String>)>),
}

impl Default for LabAnswer {
    fn default() -> Self {
        Self::Numbers(Vec::new())
    }
}

impl Lab {
    /// Reads a lab.
    ///
    /// # Errors
    /// What is wrong with it, in words, if it is none.
    pub fn parse(text: &str) -> Result<Self, String> {
        let lab = serde_json::from_value(parsed(text)?).map_err(|error| error.to_string())?;
        Ok(Self { shown: shown(text)?, ..lab })
    }

    /// The lab as the page has it: without the tested answers, with its [sum](Self::sum).
    pub fn shown(&self) -> &Value {
        &self.shown
    }

    /// A sum over what the lab asks for: the same in the file of its author and in the page.
    pub fn sum(&self) -> &str {
        self.shown["sum"].as_str().unwrap_or_default()
    }
}

/// The lab in `text` as the page has it. What a step asks for is read when it is marked.
pub(crate) fn shown(text: &str) -> Result<Value, String> {
    let mut shown = parsed(text)?;
    for (key, kind) in
        [("title", "a text"), ("goals", "a text"), ("rig", "the name of a rig"), ("step", "steps")]
    {
        if shown[key].is_null() {
            return Err(format!("a lab has {kind} in `{key}`"));
        }
    }
    let mut tasks = Vec::new();
    for step in shown["step"].as_array_mut().ok_or("each step begins with [[step]]")? {
        for key in ["text", "see", "task"] {
            if step[key].is_null() {
                return Err(format!("a step has `{key}`"));
            }
        }
        step.as_object_mut().map(|step| step.remove("tested"));
        or_none(step, "hints");
        tasks.push(step["task"].clone());
    }
    shown["sum"] = json!(sum_of(&json!([shown["title"], shown["rig"], shown["vary"], tasks])));
    or_none(&mut shown, "vary");
    Ok(shown)
}

/// Puts an empty list where a lab leaves one out.
fn or_none(value: &mut Value, key: &str) {
    if value[key].is_null() {
        value[key] = json!([]);
    }
}

fn parsed(text: &str) -> Result<Value, String> {
    let document: DocumentMut = text.parse().map_err(|error: TomlError| error.to_string())?;
    Ok(item(document.as_item()))
}

/// A sum over a value, as hexadecimal digits.
pub(crate) fn sum_of(value: &Value) -> String {
    Sha256::digest(value.to_string()).iter().take(8).map(|byte| format!("{byte:02x}")).collect()
}

/// The rig of a student: `toml` with the numbers of `vary` changed as `seed` says, to three digits; nothing changes
/// without a seed.
pub(crate) fn varied(toml: &str, vary: &[(String, f64)], seed: &str) -> Result<String, PageRefusal> {
    let mut text = RigText::parse(toml, FILE.as_ref())?;
    for (key, percent) in vary.iter().filter(|_| !seed.is_empty()) {
        let Some(value) = text.number(key) else {
            return Err(PageRefusal::Lab(format!("`{key}` is no number of the lab's rig")));
        };
        let digest = Sha256::digest(format!("{seed}\n{key}"));
        let share =
            digest.iter().take(4).fold(0.0, |sum, &byte| 256.0 * sum + f64::from(byte)) / 4_294_967_296.0;
        let changed = value * (1.0 + 0.01 * percent * (2.0 * share - 1.0));
        text.set(key, &format!("{:e}", ThreeDigits(changed)))?;
    }
    Ok(text.to_string())
}

/// A number with three digits.
struct ThreeDigits(f64);

impl std::fmt::LowerExp for ThreeDigits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let rounded: f64 = format!("{:.2e}", self.0).parse().unwrap_or(self.0);
        write!(f, "{rounded}")
    }
}

fn item(from: &Item) -> Value {
    match from {
        Item::Value(from) => value(from),
        Item::Table(table) => table.iter().map(|(key, inner)| (key.to_owned(), item(inner))).collect(),
        Item::ArrayOfTables(tables) => tables.iter().map(|table| item(&Item::Table(table.clone()))).collect(),
        Item::None => Value::Null,
    }
}

fn value(from: &TomlValue) -> Value {
    match from {
        TomlValue::String(text) => json!(text.value()),
        TomlValue::Integer(number) => json!(number.value()),
        TomlValue::Float(number) => json!(number.value()),
        TomlValue::Boolean(is) => json!(is.value()),
        TomlValue::Array(array) => array.iter().map(value).collect(),
        TomlValue::InlineTable(table) => {
            table.iter().map(|(key, inner)| (key.to_owned(), value(inner))).collect()
        }
        TomlValue::Datetime(time) => json!(time.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_changes_the_numbers_of_a_rig_within_its_bounds_and_always_alike() {
        let toml = "[[link]]\nmass_kg = 0.2\nlength_m = 0.5\n";
        let vary = [("link[1].mass_kg".to_owned(), 20.0)];
        let of = |seed: &str| varied(toml, &vary, seed).unwrap();
        assert_eq!(of(""), toml);
        assert_eq!(of("4711"), of("4711"));
        let mass =
            |text: String| RigText::parse(&text, FILE.as_ref()).unwrap().number("link[1].mass_kg").unwrap();
        let masses: Vec<f64> = (0..50).map(|seed| mass(of(&seed.to_string()))).collect();
        assert!(masses.iter().all(|mass| (0.16..=0.24).contains(mass)), "{masses:?}");
        let spread = masses.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            - masses.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(spread > 0.06, "{masses:?}");
        assert!(varied(toml, &[("link[2].mass_kg".to_owned(), 20.0)], "1").is_err());
    }
}
