//! Studies: many numbered runs, made in this process or split over several.
//!
//! A run depends on nothing but its number, so it does not matter where it is made. A shard makes every N-th run and
//! writes the outcomes, one JSON object per line. A merged study reads them from these files instead of making runs.
//! Everything after that is the same code as for a study that makes every run, so it prints the same bytes.
//!
//! ```
//! use upright_design::study::{Study, StudyError};
//!
//! let squares = Study::whole().outcomes("squares", 4, |number| Ok::<_, StudyError>(number * number))?;
//! assert_eq!(squares, [0, 1, 4, 9]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod files;
mod shard;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

pub use error::StudyError;
pub use shard::Shard;

use crate::parallel;
use crate::rig::Rig;
use files::{Line, Outcomes, StudyHeader};

/// Source of the outcomes of numbered runs: they are made here, in part or all, or read from files.
#[derive(Debug)]
pub struct Study(OutcomeSource);

#[derive(Debug)]
enum OutcomeSource {
    /// All runs are made.
    All,
    /// The runs of the shard are made, and their outcomes kept.
    Shard(Shard, RefCell<Made>),
    /// No run is made: the outcomes of all shards are read.
    Files(Outcomes),
}

/// What a shard has made.
#[derive(Debug, Default)]
struct Made {
    /// Number of runs of each part, including those of the other shards.
    parts: BTreeMap<String, u64>,
    lines: Vec<Line>,
}

impl Study {
    /// A study that makes every run.
    pub fn whole() -> Self {
        Self(OutcomeSource::All)
    }

    /// A study that makes the runs of one shard.
    pub fn shard(shard: Shard) -> Self {
        Self(OutcomeSource::Shard(shard, RefCell::default()))
    }

    /// A study that takes the outcomes of all shards from files. `about` is the result of [`about`] for this study.
    ///
    /// # Errors
    /// [`StudyError`] if a file is not of this study, or a shard or a run is missing or comes twice.
    pub fn merged(files: &[PathBuf], about: &Value) -> Result<Self, StudyError> {
        Ok(Self(OutcomeSource::Files(files::merged(files, about)?)))
    }

    /// Outcomes of the runs 0 to `runs` - 1 of this part of the study, in order; for a shard, only those it makes.
    /// Runs are made on all threads.
    ///
    /// # Errors
    /// The error of a run, or [`StudyError`] if the files do not have this part.
    pub fn outcomes<T, E>(
        &self,
        part: &str,
        runs: u64,
        one: impl Fn(u64) -> Result<T, E> + Sync,
    ) -> Result<Vec<T>, E>
    where
        T: Serialize + DeserializeOwned + Send + Sync,
        E: From<StudyError> + Send + Sync,
    {
        self.outcomes_in_batches(part, runs, 1, |numbers| numbers.iter().map(|&number| one(number)).collect())
    }

    /// As [`outcomes`](Self::outcomes), with up to `size` runs made by one call, in the order of the numbers that it
    /// is given.
    ///
    /// # Errors
    /// As for [`outcomes`](Self::outcomes).
    pub fn outcomes_in_batches<T, E>(
        &self,
        part: &str,
        runs: u64,
        size: usize,
        batch: impl Fn(&[u64]) -> Result<Vec<T>, E> + Sync,
    ) -> Result<Vec<T>, E>
    where
        T: Serialize + DeserializeOwned + Send + Sync,
        E: From<StudyError> + Send + Sync,
    {
        let made = |numbers: &[u64]| parallel::try_map_in_batches(numbers, size, &batch);
        match &self.0 {
            OutcomeSource::All => made(&(0..runs).collect::<Vec<u64>>()),
            OutcomeSource::Shard(shard, kept) => {
                let numbers: Vec<u64> = shard.numbers(runs).collect();
                let outcomes = made(&numbers)?;
                let mut kept = kept.borrow_mut();
                kept.parts.insert(part.to_owned(), runs);
                for (&run, outcome) in numbers.iter().zip(&outcomes) {
                    let outcome = serde_json::to_value(outcome)
                        .map_err(|error| StudyError::outcome(part, run, &error))?;
                    kept.lines.push(Line { part: part.to_owned(), run, outcome });
                }
                Ok(outcomes)
            }
            OutcomeSource::Files(parts) => {
                let outcomes = parts
                    .get(part)
                    .filter(|outcomes| outcomes.len() as u64 == runs)
                    .ok_or_else(|| StudyError::NoPart { part: part.to_owned(), runs })?;
                let read = |(&run, outcome): (&u64, &Value)| {
                    T::deserialize(outcome).map_err(|error| StudyError::outcome(part, run, &error).into())
                };
                outcomes.iter().map(read).collect()
            }
        }
    }

    /// Whether this study makes the runs of one shard only.
    pub fn is_shard(&self) -> bool {
        matches!(self.0, OutcomeSource::Shard(..))
    }

    /// Writes what a shard has made: a line that describes the study, then one for each run. Writes nothing if this is
    /// not a shard.
    ///
    /// # Errors
    /// That of the writer.
    pub fn write(&self, about: &Value, mut out: impl Write) -> std::io::Result<()> {
        let OutcomeSource::Shard(shard, made) = &self.0 else { return Ok(()) };
        let made = made.borrow();
        let header = StudyHeader { study: about.clone(), shard: *shard, parts: made.parts.clone() };
        writeln!(out, "{}", serde_json::to_string(&header)?)?;
        for line in &made.lines {
            writeln!(out, "{}", serde_json::to_string(line)?)?;
        }
        Ok(())
    }
}

/// Identifies a study: shards belong together if this is equal. `options` are those on which the outcomes depend.
pub fn about(command: &str, rig: &Rig, options: &Value) -> Value {
    // All values of the file, including those that change no gain.
    let values = Sha256::digest(format!("{rig:?}"));
    let values: String = values.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    let version = env!("CARGO_PKG_VERSION");
    json!({ "command": command, "version": version, "rig": rig.name, "values": values, "options": options })
}

/// Reads a number that may be infinite: JSON has no infinite numbers, so they are written as null.
pub fn infinite_if_null<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}
