//! The exercises of the page, as their authors write them.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use toml_edit::{DocumentMut, Item, TomlError, Value as TomlValue};
use upright_page::Lesson;

use super::error::SiteError;
use super::files::toml_files;

/// The exercises in `folder`, in the order of their files' names.
///
/// # Errors
/// [`SiteError::File`] if a file cannot be read, [`SiteError::Lesson`] if it is no exercise.
pub fn lessons(folder: &Path) -> Result<Vec<Lesson>, SiteError> {
    let read = |(path, text): (PathBuf, String)| lesson(&text).map_err(|why| SiteError::Lesson { path, why });
    toml_files(folder)?.into_iter().map(read).collect()
}

fn lesson(text: &str) -> Result<Lesson, String> {
    let document: DocumentMut = text.parse().map_err(|error: TomlError| error.to_string())?;
    serde_json::from_value(item(document.as_item())).map_err(|error| error.to_string())
}

fn item(from: &Item) -> Value {
    match from {
        Item::Value(from) => value(from),
        Item::Table(table) => table.iter().map(|(key, inner)| (key.to_owned(), item(inner))).collect(),
        Item::ArrayOfTables(_) | Item::None => Value::Null,
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
    use upright_page::{Desk, Exercise};

    const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

    #[test]
    fn the_library_accepts_the_right_answer_of_each_exercise_and_refuses_the_wrong_one() {
        let lessons = lessons(&Path::new(ROOT).join("lessons")).unwrap();
        assert_eq!(lessons.len(), 5);
        for Lesson { title, rig, exercise, tested, .. } in lessons {
            let toml = std::fs::read_to_string(format!("{ROOT}/rigs/{rig}.toml")).unwrap();
            let mark = |answer: &[f64]| -> Value {
                let asked = json!({ "ask": "mark", "toml": toml, "exercise": exercise, "answer": answer });
                serde_json::from_str(&Desk::default().answer(&asked.to_string())).unwrap()
            };
            let (right, wrong) = (mark(&tested.right), mark(&tested.wrong));
            assert_eq!(
                (&right["right"], &wrong["right"]),
                (&json!(true), &json!(false)),
                "{title}: {right} {wrong}"
            );
            assert!(mark(&[])["failed"]["why"].as_str().unwrap().starts_with("give "), "{title}");
            if let Exercise::Property { .. } = exercise {
                // Too small and too large are told alike.
                let (small, large) = (mark(&[0.5]), mark(&[90.5]));
                let told = |marked: &Value| marked["why"].as_str().unwrap().to_owned();
                assert_eq!(told(&small).replace("0.5", "90.5"), told(&large), "{title}");
            }
        }
    }

    #[test]
    fn a_file_that_is_no_exercise_is_refused_with_what_is_wrong() {
        let text = std::fs::read_to_string(format!("{ROOT}/lessons/5-fault.toml")).unwrap();
        assert!(lesson(&text).is_ok());
        for (from, to, why) in [
            ("text =", "txt =", "unknown field `txt`"),
            ("kind = \"fault\"", "kind = \"guess\"", "unknown variant `guess`"),
            ("title = ", "title ", "expected"),
        ] {
            let error = lesson(&text.replacen(from, to, 1)).unwrap_err();
            assert!(error.contains(why), "{error}");
        }
    }
}
