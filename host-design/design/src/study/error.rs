//! Why a study cannot be merged from its shards.

use std::path::PathBuf;

/// Why a study cannot be merged from its shards.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// A file cannot be read.
    #[error("{}: cannot be read ({reason})", file.display())]
    Unreadable {
        /// Path of the file.
        file: PathBuf,
        /// Message of the operating system.
        reason: String,
    },
    /// A line was not written by --shard.
    #[error("{}: line {line}: not written by --shard ({reason}); make the shard again", file.display())]
    NotAShard {
        /// Path of the file.
        file: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Why it cannot be read.
        reason: String,
    },
    /// The shard belongs to another study.
    #[error(
        "{}: a shard of another study: {theirs}, not {ours}; give the same rig file and options to --shard and --merge",
        file.display()
    )]
    OtherStudy {
        /// Path of the file.
        file: PathBuf,
        /// The study that the shard belongs to.
        theirs: String,
        /// The study that is merged.
        ours: String,
    },
    /// No file holds a shard.
    #[error("shard {shard} of {of} is missing: make it with --shard {shard}/{of}")]
    Missing {
        /// Number of the shard, from 1.
        shard: u64,
        /// Number of shards in the study.
        of: u64,
    },
    /// Two files hold the same shard.
    #[error("shard {shard} is there twice: {} and {}; leave one out", first.display(), second.display())]
    Twice {
        /// Number of the shard, from 1.
        shard: u64,
        /// Path of one file.
        first: PathBuf,
        /// Path of the other file.
        second: PathBuf,
    },
    /// A shard lacks a run, or has one that does not belong to it.
    #[error("{}: shard {shard}: run {run} of {part} {what}; make the shard again", file.display())]
    Runs {
        /// Path of the file.
        file: PathBuf,
        /// Number of the shard, from 1.
        shard: u64,
        /// Part of the study.
        part: String,
        /// Number of the run, from 0.
        run: u64,
        /// What is wrong with it.
        what: &'static str,
    },
    /// The files do not have the part that is read, or not as many runs of it.
    #[error("the shards do not have the {runs} runs of {part}; give the same options to --shard and --merge")]
    NoPart {
        /// Part of the study.
        part: String,
        /// Number of runs that it should have.
        runs: u64,
    },
    /// The outcome of a run cannot be written or read.
    #[error("run {run} of {part}: {reason}; make the shard again")]
    Outcome {
        /// Part of the study.
        part: String,
        /// Number of the run, from 0.
        run: u64,
        /// Why it cannot be written or read.
        reason: String,
    },
}

impl StudyError {
    pub(super) fn outcome(part: &str, run: u64, error: &serde_json::Error) -> Self {
        Self::Outcome { part: part.to_owned(), run, reason: error.to_string() }
    }
}
