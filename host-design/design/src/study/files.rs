//! The files of shards: a line that describes the study, then one line for each run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::StudyError;
use super::shard::Shard;

/// The first line of a file: the study, and the shard of it that follows.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct StudyHeader {
    pub(super) study: Value,
    pub(super) shard: Shard,
    /// Number of runs of each part, including those of the other shards.
    pub(super) parts: BTreeMap<String, u64>,
}

/// A line with the outcome of one run of a part.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Line {
    pub(super) part: String,
    pub(super) run: u64,
    pub(super) outcome: Value,
}

/// For each part, the outcome of each run.
pub(super) type Outcomes = BTreeMap<String, BTreeMap<u64, Value>>;

struct File {
    path: PathBuf,
    header: StudyHeader,
    lines: Vec<Line>,
}

/// The outcomes in these files, if they are all shards of the study `about`.
pub(super) fn merged(files: &[PathBuf], about: &Value) -> Result<Outcomes, StudyError> {
    let files: Vec<File> = files.iter().map(|path| read(path)).collect::<Result<_, _>>()?;
    let Some(first) = files.first() else { return Err(StudyError::Missing { shard: 1, of: 1 }) };
    let of = first.header.shard.shards();
    for File { path, header, .. } in &files {
        let other =
            |theirs: String, ours: String| Err(StudyError::OtherStudy { file: path.clone(), theirs, ours });
        if header.study != *about {
            return other(header.study.to_string(), about.to_string());
        }
        if header.shard.shards() != of {
            return other(format!("{} shards", header.shard.shards()), format!("{of} shards"));
        }
        if header.parts != first.header.parts {
            return other(format!("{:?}", header.parts), format!("{:?}", first.header.parts));
        }
    }
    every_shard_once(&files, of)?;
    let mut all: Outcomes = first.header.parts.keys().map(|part| (part.clone(), BTreeMap::new())).collect();
    for file in files {
        place(file, &mut all)?;
    }
    Ok(all)
}

fn every_shard_once(files: &[File], of: u64) -> Result<(), StudyError> {
    let mut seen: BTreeMap<u64, &Path> = BTreeMap::new();
    for File { path, header, .. } in files {
        let shard = header.shard.number();
        if let Some(first) = seen.insert(shard, path) {
            return Err(StudyError::Twice { shard, first: first.to_owned(), second: path.clone() });
        }
    }
    match (1..=of).find(|shard| !seen.contains_key(shard)) {
        Some(shard) => Err(StudyError::Missing { shard, of }),
        None => Ok(()),
    }
}

/// Adds the outcomes of a file to those of the other shards.
fn place(file: File, all: &mut Outcomes) -> Result<(), StudyError> {
    let File { path, header: StudyHeader { shard, parts, .. }, lines } = file;
    let wrong = |part: &str, run: u64, what: &'static str| {
        Err(StudyError::Runs { file: path.clone(), shard: shard.number(), part: part.to_owned(), run, what })
    };
    for Line { part, run, outcome } in lines {
        let has_run =
            run % shard.shards() + 1 == shard.number() && parts.get(&part).is_some_and(|&runs| run < runs);
        match all.get_mut(&part).filter(|_| has_run) {
            None => return wrong(&part, run, "does not belong to it"),
            Some(outcomes) => {
                if outcomes.insert(run, outcome).is_some() {
                    return wrong(&part, run, "is there twice");
                }
            }
        }
    }
    for (part, &runs) in &parts {
        let is_missing = |run: &u64| all.get(part).is_none_or(|outcomes| !outcomes.contains_key(run));
        if let Some(run) = shard.numbers(runs).find(is_missing) {
            return wrong(part, run, "is missing");
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<File, StudyError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| StudyError::Unreadable { file: path.to_owned(), reason: error.to_string() })?;
    let mut lines = text.lines().enumerate();
    let header: StudyHeader = parsed(path, lines.next().unwrap_or((0, "")))?;
    if !header.shard.is_valid() {
        let reason = "no such shard".to_owned();
        return Err(StudyError::NotAShard { file: path.to_owned(), line: 1, reason });
    }
    let lines = lines.map(|line| parsed(path, line)).collect::<Result<_, _>>()?;
    Ok(File { path: path.to_owned(), header, lines })
}

fn parsed<T: DeserializeOwned>(path: &Path, (index, line): (usize, &str)) -> Result<T, StudyError> {
    serde_json::from_str(line).map_err(|error| StudyError::NotAShard {
        file: path.to_owned(),
        line: index + 1,
        reason: error.to_string(),
    })
}
