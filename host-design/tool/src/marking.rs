//! A class's labs, run again on the teacher's machine.

use std::path::{Path, PathBuf};

use serde::Serialize;
use upright_page::{HandIn, Lab};

use crate::site::{SiteError, json_files};

/// What a student has handed in, run again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Marked {
    /// Name of the file.
    pub file: String,
    /// The student's name and seed; empty if the file does not verify.
    pub name: String,
    /// The seed of the student's numbers.
    pub seed: String,
    /// For each step whether the library finds the answer right, and why.
    pub steps: Vec<(bool, String)>,
    /// How often answers were checked, over all steps.
    pub tries: u32,
    /// Hints that were asked for.
    pub hints: u32,
    /// Time from the first look to the last answer (minutes).
    pub minutes: f64,
    /// Why the file does not count; none if it does.
    pub refused: Option<String>,
}

/// Runs everything in `folder` again, in the order of the files' names. `rig` is the text of the lab's rig.
///
/// # Errors
/// [`SiteError::File`] if a file cannot be read.
pub fn marked(folder: &Path, lab: &Lab, rig: &str) -> Result<Vec<Marked>, SiteError> {
    let one = |(path, text): (PathBuf, String)| {
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let again = HandIn::parse(&text).and_then(|work| Ok((work.marked_again(lab, rig)?, work)));
        match again {
            Ok((steps, HandIn { name, seed, minutes, steps: handed, .. })) => Marked {
                file,
                name,
                seed,
                steps,
                tries: handed.iter().map(|step| step.tries).sum(),
                hints: handed.iter().map(|step| step.hints).sum(),
                minutes,
                refused: None,
            },
            Err(error) => Marked {
                file,
                name: String::new(),
                seed: String::new(),
                steps: Vec::new(),
                tries: 0,
                hints: 0,
                minutes: 0.0,
                refused: Some(error.to_string()),
            },
        }
    };
    Ok(json_files(folder)?.into_iter().map(one).collect())
}

/// The results as a table for a person.
pub fn table(marked: &[Marked]) -> String {
    let mut lines = vec!["| file | name | number | solved | steps | tries | hints | minutes |".to_owned()];
    lines.push("|---|---|---|---|---|---|---|---|".to_owned());
    for one in marked {
        let marks: String = one.steps.iter().map(|(is_right, _)| if *is_right { '✓' } else { '✗' }).collect();
        let line = match &one.refused {
            Some(why) => format!("| {} | does not count: {why} | | | | | | |", one.file),
            None => format!(
                "| {} | {} | {} | {} of {} | {marks} | {} | {} | {} |",
                one.file,
                one.name,
                one.seed,
                one.solved(),
                one.steps.len(),
                one.tries,
                one.hints,
                one.minutes
            ),
        };
        lines.push(line);
    }
    lines.join("\n") + "\n"
}

/// The same as CSV.
///
/// # Errors
/// [`csv::Error`] never, because it is written into memory.
pub fn csv_text(marked: &[Marked]) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "file",
        "name",
        "number",
        "solved",
        "steps",
        "tries",
        "hints",
        "minutes",
        "refused",
    ])?;
    for one in marked {
        let numbers = [one.solved(), one.steps.len(), one.tries as usize, one.hints as usize]
            .map(|number| number.to_string());
        let texts = [&one.file, &one.name, &one.seed].map(String::clone);
        let rest = [one.minutes.to_string(), one.refused.clone().unwrap_or_default()];
        writer.write_record(texts.into_iter().chain(numbers).chain(rest))?;
    }
    Ok(writer.into_inner().unwrap_or_default())
}

impl Marked {
    /// Number of steps that are solved.
    pub fn solved(&self) -> usize {
        self.steps.iter().filter(|(is_right, _)| *is_right).count()
    }
}
