//! One number of a rig file over a range.

use std::path::Path;

use toml_edit::{Document, Item, TableLike};

use upright_design::number::rounded;
use upright_design::rig::{Rig, RigError, RigErrorKind};

/// Values for one key of a rig file.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The key as it would stand in an error: `tick.period_s`, `link[2].mass_kg`, `lqr.state_weights[1]`.
    pub key: String,
    /// The values, from the first to the last one named.
    pub values: Vec<f64>,
    /// Whether they are spaced by equal factors.
    pub log: bool,
}

/// An invalid sweep.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SweepError {
    /// The text does not describe a sweep.
    #[error(
        "give KEY=FROM..TO, KEY=FROM..TO:POINTS or KEY=FROM..TO:POINTS:log, such as tick.period_s=0.001..0.01:10"
    )]
    Syntax,
    /// Too few or too many values.
    #[error("{0} points: give 2 to {MOST_POINTS}")]
    Points(usize),
    /// Equal factors between values that are not positive.
    #[error("from {from} to {to} there are no equal factors: leave out `log`, or give two numbers above 0")]
    Log {
        /// First value.
        from: f64,
        /// Last value.
        to: f64,
    },
}

/// Largest number of values.
const MOST_POINTS: usize = 1000;
/// Number of values if none is given.
const POINTS: usize = 7;

impl core::str::FromStr for Sweep {
    type Err = SweepError;

    /// Reads `KEY=FROM..TO[:POINTS][:log]`; 7 points if none are given.
    fn from_str(text: &str) -> Result<Self, SweepError> {
        let (key, range) = text.split_once('=').ok_or(SweepError::Syntax)?;
        let mut parts = range.split(':');
        let (from, to) = parts.next().and_then(|range| range.split_once("..")).ok_or(SweepError::Syntax)?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
        let (from, to) = number(from).zip(number(to)).ok_or(SweepError::Syntax)?;
        let (mut points, mut log) = (None, false);
        for part in parts {
            match part {
                "log" if !log => log = true,
                _ if points.is_none() && !log => {
                    points = Some(part.parse().map_err(|_| SweepError::Syntax)?);
                }
                _ => return Err(SweepError::Syntax),
            }
        }
        let points = points.unwrap_or(POINTS);
        if key.trim().is_empty() || from == to {
            return Err(SweepError::Syntax);
        }
        if !(2..=MOST_POINTS).contains(&points) {
            return Err(SweepError::Points(points));
        }
        if log && !(from > 0.0 && to > 0.0) {
            return Err(SweepError::Log { from, to });
        }
        let value = |index: usize| {
            let share = index as f64 / (points - 1) as f64;
            match index {
                0 => from,
                _ if index + 1 == points => to,
                // Rounded: nobody wants 0.30000000000000004 in a table.
                _ if log => rounded(from * (to / from).powf(share), 6),
                _ => rounded(from + (to - from) * share, 12),
            }
        };
        Ok(Self { key: key.trim().to_owned(), values: (0..points).map(value).collect(), log })
    }
}

impl Sweep {
    /// The rig of `text` with `value` for the key. A key that is not in the text, but could be, is added.
    ///
    /// # Errors
    /// As for any rig file: unknown keys with a suggestion, bad values with the accepted range. An error has no line
    /// where the key had to be added.
    pub fn rig(&self, text: &str, file: &Path, value: f64) -> Result<Rig, RigError> {
        let number = if value.abs() < 1e15 { format!("{value}") } else { format!("{value:e}") };
        match self.place(text) {
            Place::At(span) => {
                Rig::from_toml(&format!("{}{number}{}", &text[..span.start], &text[span.end..]), file)
            }
            Place::New { at, prefix } => {
                let line = format!("{prefix} = {number}\n");
                let changed = format!("{}{line}{}", &text[..at], &text[at..]);
                Rig::from_toml(&changed, file).map_err(|error| RigError { place: None, ..error })
            }
            Place::Nowhere => Err(RigError {
                file: file.to_owned(),
                place: None,
                key: Some(self.key.clone()),
                kind: Box::new(RigErrorKind::MissingKey {
                    remedy: "it to the rig file, on a line of its own: only then can it be swept".to_owned(),
                }),
            }),
        }
    }

    /// Where the value of the key stands in `text`.
    fn place(&self, text: &str) -> Place {
        let Ok(document) = Document::parse(text) else { return Place::Nowhere };
        let mut steps = self.key.split('.').peekable();
        let mut table: &dyn TableLike = document.as_table();
        let mut header = String::new();
        let mut number = 0; // which of several tables of that header
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
}

enum Place {
    /// In these bytes.
    At(core::ops::Range<usize>),
    /// Not there; it would go here, after this.
    New { at: usize, prefix: String },
    /// Not known.
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

/// A new line `name = …` after the line with this header, the one with that number; at the top without header.
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
    fn a_range_is_read_as_it_is_written() {
        let sweep = |text: &str| text.parse::<Sweep>();
        let settling = sweep("pole_placement.settling_time_s=3..9").unwrap();
        assert_eq!(settling.values, [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        assert_eq!(sweep("a=0..0.3:4").unwrap().values, [0.0, 0.1, 0.2, 0.3]);
        let log = sweep("a=0.01..10:4:log").unwrap();
        assert!(log.log && log.values == [0.01, 0.1, 1.0, 10.0]);
        assert_eq!(sweep("a=-1..-3:3").unwrap().values, [-1.0, -2.0, -3.0]);
        assert_eq!(sweep("a=0..1:3:log"), Err(SweepError::Log { from: 0.0, to: 1.0 }));
        assert_eq!(sweep("a=1..2:1"), Err(SweepError::Points(1)));
        for bad in
            ["a", "a=1", "a=1..", "a=1..x", "=1..2", "a=1..2:3:4", "a=1..2:log:3", "a=1..1", "a=1..inf"]
        {
            assert_eq!(sweep(bad), Err(SweepError::Syntax), "{bad}");
        }
    }
}
