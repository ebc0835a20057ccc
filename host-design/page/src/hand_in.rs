//! What a student hands in, and how a teacher's machine runs it again.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::lab::{Lab, sum_of, varied};

/// A student's lab, as the page saves it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandIn {
    /// The version of the page.
    pub version: String,
    /// Title of the lab.
    pub lab: String,
    /// The sum of what it asks for.
    pub lab_sum: String,
    /// The student's name.
    pub name: String,
    /// The seed of the student's numbers.
    pub seed: String,
    /// Time from the first look to the last answer (minutes).
    pub minutes: f64,
    /// The steps.
    pub steps: Vec<HandedStep>,
    /// A sum over all of this.
    pub sum: String,
}

/// A step as it was answered last.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HandedStep {
    /// The numbers of the answer.
    pub answer: Vec<f64>,
    /// The student's rig file, if the answer is that.
    pub toml: Option<String>,
    /// How the page marked it.
    pub is_right: bool,
    /// How often it was marked.
    pub tries: u32,
    /// Hints that were asked for.
    pub hints: u32,
}

/// Why a file does not count as what a student has handed in.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HandInError {
    /// It is no such file.
    #[error("this is no file that the page saves for handing in: {0}")]
    Format(String),
    /// Its sum is another one.
    #[error("it was changed after the page had saved it: ask for the file as the page wrote it")]
    Changed,
    /// It belongs to another lab.
    #[error("it is of the lab “{0}”, or of another state of this one: name the file of that lab")]
    Lab(String),
}

impl HandIn {
    /// Reads what a student has handed in, if nobody has changed it since.
    ///
    /// # Errors
    /// [`HandInError::Format`] and [`HandInError::Changed`].
    pub fn parse(text: &str) -> Result<Self, HandInError> {
        let format = |error: serde_json::Error| HandInError::Format(error.to_string());
        let work: Value = serde_json::from_str(text).map_err(format)?;
        let own: Self = serde_json::from_value(work.clone()).map_err(format)?;
        if own.sum == sum_without(work) { Ok(own) } else { Err(HandInError::Changed) }
    }

    /// Runs every answer again for the rig `toml` of `lab`: for each step of the lab whether it is solved, and why.
    ///
    /// # Errors
    /// [`HandInError::Lab`] if it was answered for another lab.
    pub fn marked_again(&self, lab: &Lab, toml: &str) -> Result<Vec<(bool, String)>, HandInError> {
        let other = || HandInError::Lab(self.lab.clone());
        if self.lab_sum != lab.sum() {
            return Err(other());
        }
        let rig = varied(toml, &lab.vary, &self.seed).map_err(|_| other())?;
        let mark = |(number, step): (usize, &crate::lab::LabStep)| {
            let Some(handed) = self.steps.get(number).filter(|handed| handed.tries > 0) else {
                return (false, "not answered".to_owned());
            };
            let changed = handed.toml.as_deref().unwrap_or(&rig);
            match step.task.marked(&rig, changed, &handed.answer) {
                Ok(marked) => (
                    marked["right"] == Value::Bool(true),
                    marked["why"].as_str().unwrap_or_default().to_owned(),
                ),
                Err(refusal) => (false, refusal.to_string()),
            }
        };
        Ok(lab.steps.iter().enumerate().map(mark).collect())
    }
}

/// The work as a text for a file, with the version of this page and a sum, which [`HandIn::parse`] checks.
pub(crate) fn sealed(mut work: Value) -> String {
    work["version"] = json!(env!("CARGO_PKG_VERSION"));
    work["sum"] = json!(sum_without(work.clone()));
    work.to_string()
}

/// A sum over all but the sum.
fn sum_without(mut work: Value) -> String {
    work.as_object_mut().map(|work| work.remove("sum"));
    sum_of(&work)
}
