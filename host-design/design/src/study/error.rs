//! Why shards are not merged.

use std::path::PathBuf;

/// Why shards are not merged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// A file cannot be read.
    #[error("{}: cannot be read ({reason})", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// A line is not what --shard writes.
    #[error("{}: line {line}: not written by --shard ({reason}); make the shard again", file.display())]
    NotAShard {
        /// The file.
        file: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Why.
        reason: String,
    },
    /// A shard of other runs.
    #[error(
        "{}: a shard of another study: {theirs}, not {ours}; give the same rig file and options to --shard and --merge",
        file.display()
    )]
    OtherStudy {
        /// The file.
        file: PathBuf,
        /// What it is about.
        theirs: String,
        /// What the merge is about.
        ours: String,
    },
    /// A shard is not there.
    #[error("shard {shard} of {of} is missing: make it with --shard {shard}/{of}")]
    Missing {
        /// Its number.
        shard: u64,
        /// How many there are.
        of: u64,
    },
    /// A shard is there twice.
    #[error("shard {shard} is there twice: {} and {}; leave one out", first.display(), second.display())]
    Twice {
        /// Its number.
        shard: u64,
        /// One file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// A shard does not have its runs.
    #[error("{}: shard {shard}: run {run} of {part} {what}; make the shard again", file.display())]
    Runs {
        /// The file.
        file: PathBuf,
        /// Number of the shard.
        shard: u64,
        /// Part of the study.
        part: String,
        /// Number of the run.
        run: u64,
        /// What is wrong.
        what: &'static str,
    },
    /// The files have no such runs.
    #[error("the shards do not have the {runs} runs of {part}; give the same options to --shard and --merge")]
    NoPart {
        /// Part of the study.
        part: String,
        /// Its runs.
        runs: u64,
    },
    /// The outcome of a run cannot be written or read.
    #[error("run {run} of {part}: {reason}; make the shard again")]
    Outcome {
        /// Part of the study.
        part: String,
        /// Number of the run.
        run: u64,
        /// Why.
        reason: String,
    },
}

impl StudyError {
    pub(super) fn outcome(part: &str, run: u64, error: &serde_json::Error) -> Self {
        Self::Outcome { part: part.to_owned(), run, reason: error.to_string() }
    }
}
