//! A table of numbers as text.

use std::io::Read;
use std::path::Path;

use super::error::RecordingError;
use super::reading::Reading;

/// Largest file that is read (bytes).
const MOST_BYTES: u64 = 1 << 30;

/// The rows of a table of numbers. Lines that begin with `#` and empty lines are skipped.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingTable {
    /// Names of the columns.
    pub(super) names: Vec<String>,
    /// All numbers, row by row.
    pub(super) values: Vec<f64>,
    /// Line of each row.
    pub(super) lines: Vec<usize>,
}

impl RecordingTable {
    /// Reads a table from a file; `links` is the number of links of the rig.
    ///
    /// # Errors
    /// [`RecordingError`], with line and column.
    pub fn from_path(file: &Path, reading: &Reading, links: usize) -> Result<Self, RecordingError> {
        let mut bytes = Vec::new();
        std::fs::File::open(file)
            .and_then(|open| open.take(MOST_BYTES).read_to_end(&mut bytes))
            .map_err(|error| RecordingError::Unreadable(error.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|_| RecordingError::NotText)?;
        Self::from_text(&text, reading, links)
    }

    /// Reads a table whose fields are separated by commas, semicolons, tabs or spaces. Where it is not commas, a
    /// decimal comma is read as a point.
    ///
    /// # Errors
    /// [`RecordingError`], with line and column.
    pub fn from_text(text: &str, reading: &Reading, links: usize) -> Result<Self, RecordingError> {
        let text = text.trim_start_matches('\u{feff}');
        let numbered = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
        let mut lines = numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with('#')).peekable();
        let &(line, first) = lines.peek().ok_or(RecordingError::Empty)?;
        let separator = separator(first);
        let split = |line| split(line, separator);
        let has_names = split(first).iter().any(|field| number(field, separator).is_none());
        if has_names {
            lines.next();
        }
        let names = match (reading.columns.is_empty(), has_names) {
            (false, _) => reading.columns.clone(),
            (true, true) => split(first).into_iter().map(str::to_owned).collect(),
            (true, false) => {
                let (fields, example) = (split(first).len(), example(links));
                return Err(RecordingError::NoHeader { line, fields, example });
            }
        };
        let mut table = Self { names, values: Vec::new(), lines: Vec::new() };
        for (line, text) in lines {
            table.add(line, &split(text), separator)?;
        }
        if table.lines.is_empty() { Err(RecordingError::Empty) } else { Ok(table) }
    }

    fn add(&mut self, line: usize, fields: &[&str], separator: Option<char>) -> Result<(), RecordingError> {
        let (found, wanted) = (fields.len(), self.names.len());
        if found != wanted {
            let is_decimal = separator == Some(',') && found == 2 * wanted;
            return Err(RecordingError::Fields { line, found, wanted, is_decimal });
        }
        for (name, field) in self.names.iter().zip(fields) {
            // A column that is not used may hold anything.
            let number = if name == "-" { Some(0.0) } else { number(field, separator) };
            self.values.push(number.ok_or_else(|| RecordingError::Number {
                line,
                column: name.clone(),
                text: (*field).to_owned(),
            })?);
        }
        self.lines.push(line);
        Ok(())
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.lines.len()
    }

    /// The first rows.
    pub(crate) fn beginning(&self, rows: usize) -> Self {
        let rows = rows.min(self.lines.len());
        Self {
            names: self.names.clone(),
            values: self.values[..rows * self.names.len()].to_vec(),
            lines: self.lines[..rows].to_vec(),
        }
    }

    /// The numbers of a row.
    pub(super) fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.names.len()..][..self.names.len()]
    }
}

/// What separates the fields of a line as `first`: semicolons or tabs before commas, which may be those of numbers.
fn separator(first: &str) -> Option<char> {
    [';', '\t', ','].into_iter().find(|&separator| first.contains(separator))
}

fn split(line: &str, separator: Option<char>) -> Vec<&str> {
    match separator {
        Some(separator) => line.split(separator).map(bare).collect(),
        None => line.split_whitespace().map(bare).collect(),
    }
}

/// The number of a field; where commas do not separate fields, one may stand for the decimal point.
fn number(field: &str, separator: Option<char>) -> Option<f64> {
    let is_decimal = separator != Some(',') && !field.contains('.');
    let number = if is_decimal { field.replacen(',', ".", 1).parse() } else { field.parse() };
    number.ok().filter(|number: &f64| number.is_finite())
}

/// A field without the spaces and quotes around it.
fn bare(field: &str) -> &str {
    field.trim().trim_matches('"')
}

/// Names of the columns of a table for so many links.
fn example(links: usize) -> String {
    let angles = (1..=links).map(|link| format!(",angle_{link}_rad"));
    format!("time_s{}", angles.collect::<String>())
}
