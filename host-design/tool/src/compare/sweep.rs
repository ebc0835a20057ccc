//! One number of a rig file over a range.

use std::path::Path;

use upright_design::number::rounded;
use upright_design::rig::{Rig, RigError, RigText};

/// Values for one key of a rig file.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The key as error messages write it: `tick.period_s`, `link[2].mass_kg`, `lqr.state_weights[1]`.
    pub key: String,
    /// The values, from the first to the last one named.
    pub values: Vec<f64>,
    /// Whether the values are spaced logarithmically, by equal factors.
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
    /// Logarithmic spacing of values that are not positive.
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
    /// The rig of `text` with `value` for the key. A valid key that the text leaves out is added.
    ///
    /// # Errors
    /// As for any rig file: unknown keys with a suggestion, bad values with the accepted range. If the key had to be
    /// added, the error names no line.
    pub fn rig(&self, text: &str, file: &Path, value: f64) -> Result<Rig, RigError> {
        let number = if value.abs() < 1e15 { format!("{value}") } else { format!("{value:e}") };
        let mut text = RigText::parse(text, file)?;
        let is_added = !text.has(&self.key);
        text.set(&self.key, &number)?;
        Rig::from_toml(&text.to_string(), file).map_err(|error| match is_added {
            true => RigError { place: None, ..error },
            false => error,
        })
    }
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
