//! The labs of the page, as their authors write them.

use std::path::{Path, PathBuf};

use upright_page::Lab;

use super::error::SiteError;
use super::files::toml_files;

/// The labs in `folder`, in the order of their files' names.
///
/// # Errors
/// [`SiteError::File`] if a file cannot be read, [`SiteError::Lab`] if it is no lab.
pub fn labs(folder: &Path) -> Result<Vec<Lab>, SiteError> {
    toml_files(folder)?.into_iter().map(parsed).collect()
}

/// The lab in the file `path`.
///
/// # Errors
/// As for [`labs`].
pub fn lab(path: &Path) -> Result<Lab, SiteError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| SiteError::File { path: path.to_owned(), source })?;
    parsed((path.to_owned(), text))
}

fn parsed((path, text): (PathBuf, String)) -> Result<Lab, SiteError> {
    Lab::parse(&text).map_err(|why| SiteError::Lab { path, why })
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};
    use upright_page::{Desk, LabAnswer, LabStep, LabTask};

    use super::*;

    const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

    fn ask(question: &Value) -> Value {
        serde_json::from_str(&Desk::default().answer(&question.to_string())).unwrap()
    }

    /// How an answer is marked for the rig as it is in its file.
    fn marked(rig: &str, task: &LabTask, answer: &LabAnswer) -> Value {
        let (toml, numbers) = match answer {
            LabAnswer::Numbers(numbers) => (json!(rig), json!(numbers)),
            LabAnswer::Changes(changes) => {
                let changed = ask(&json!({ "ask": "set", "toml": rig, "values": changes }));
                (changed["toml"].clone(), json!([]))
            }
        };
        ask(&json!({ "ask": "mark", "toml": toml, "rig": rig, "task": task, "answer": numbers }))
    }

    #[test]
    fn the_library_accepts_the_intended_solution_of_each_step_and_no_other() {
        let labs = labs(&Path::new(ROOT).join("lessons")).unwrap();
        assert!(labs.len() >= 10);
        for Lab { title, rig, vary, steps, .. } in labs {
            let toml = std::fs::read_to_string(format!("{ROOT}/rigs/{rig}.toml")).unwrap();
            for seed in ["1", "anna"] {
                let varied = ask(&json!({ "ask": "vary", "toml": toml, "vary": vary, "seed": seed }));
                assert_eq!(varied["toml"] == json!(toml), vary.is_empty(), "{title}: {varied}");
            }
            for (number, LabStep { task, tested, .. }) in steps.iter().enumerate() {
                let right = marked(&toml, task, &tested.right);
                assert_eq!(right["right"], json!(true), "{title}, step {number}: {right}");
                assert!(tested.wrong.len() >= 4, "{title}, step {number}: doing nothing, and three more");
                for answer in &tested.wrong {
                    let wrong = marked(&toml, task, answer);
                    assert_ne!(wrong["right"], json!(true), "{title}, step {number}: {answer:?}: {wrong}");
                }
                if let LabTask::Property { .. } = task {
                    // Too small and too large are told alike.
                    let told = |answer: f64| {
                        marked(&toml, task, &LabAnswer::Numbers(vec![answer]))["why"].to_string()
                    };
                    assert_eq!(told(0.5).replace("0.5", "90.5"), told(90.5), "{title}");
                }
            }
        }
    }

    #[test]
    fn a_file_that_is_no_lab_is_refused_with_what_is_wrong() {
        let path = Path::new(ROOT).join("lessons/08-fault.toml");
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(lab(&path).is_ok());
        for (from, to, why) in [
            ("text =", "txt =", "unknown field `txt`"),
            ("kind = \"fault\"", "kind = \"guess\"", "unknown variant `guess`"),
            ("title = ", "title ", "expected"),
            ("[[step]]", "[step]", "invalid type"),
        ] {
            let error = parsed((path.clone(), text.replacen(from, to, 1))).unwrap_err().to_string();
            assert!(error.contains(why) && error.contains("08-fault.toml"), "{error}");
        }
    }
}
