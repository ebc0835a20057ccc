//! Studies split into shards: merged, they print the bytes of one run; a shard that is missing or doubled is refused.

use std::path::PathBuf;
use std::process::Output;

use crate::command::{SINGLE, path_of, status, stderr, stdout, upright};

/// A study and the folder with its shards.
struct Split {
    arguments: Vec<String>,
    folder: tempfile::TempDir,
}

impl Split {
    fn new(arguments: &[&str]) -> Self {
        let arguments = arguments.iter().map(|argument| (*argument).to_owned()).collect();
        Self { arguments, folder: tempfile::tempdir().unwrap() }
    }

    fn with(&self, more: &[&str]) -> Output {
        let mut arguments: Vec<&str> = self.arguments.iter().map(String::as_str).collect();
        arguments.extend(more);
        upright(&arguments)
    }

    /// Runs shard `number` of `of`; returns its file.
    fn shard(&self, number: usize, of: usize) -> PathBuf {
        let output = self.with(&["--shard", &format!("{number}/{of}")]);
        assert_eq!(status(&output), 0, "{}", stderr(&output));
        self.write(&format!("{number}-{of}.jsonl"), stdout(&output))
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let file = self.folder.path().join(name);
        std::fs::write(&file, text).unwrap();
        file
    }

    fn merge(&self, files: &[&PathBuf]) -> Output {
        let files: Vec<&str> = files.iter().map(|file| file.to_str().unwrap()).collect();
        self.with(&[&["--merge"], files.as_slice()].concat())
    }

    /// Asserts that 3 shards merged, in any order, are what one run prints, with its exit status.
    fn is_the_same_in_3_shards(&self) {
        let shards = [1, 2, 3].map(|number| self.shard(number, 3));
        let (whole, merged) = (self.with(&[]), self.merge(&[&shards[2], &shards[0], &shards[1]]));
        assert!(!whole.stdout.is_empty(), "{}", stderr(&whole));
        assert_eq!(stdout(&merged), stdout(&whole), "{}", stderr(&merged));
        assert_eq!(status(&merged), status(&whole));
        assert_eq!(stderr(&merged), stderr(&whole));
    }
}

#[test]
fn merged_shards_of_every_study_are_one_run() {
    let single = &path_of(SINGLE);
    for study in [
        &["faults", single, "--runs", "7", "--kind", "motor-dead"][..],
        &["faults", single, "--runs", "5", "--kind", "encoder-jump", "--json"],
        &["verify", single, "--law", "lqr", "--runs", "5", "--json"],
        &[
            "robust",
            single,
            "--as-it-is",
            "--joint-friction",
            "2e-2",
            "--runs",
            "4",
            "--duration",
            "5",
            "--json",
        ],
        &[
            "robust",
            single,
            "--as-it-is",
            "--joint-friction",
            "1",
            "--mass",
            "5",
            "--runs",
            "2",
            "--duration",
            "2",
        ],
        &["faults", "--healthy", single, "--runs", "4", "--duration", "2"],
        &["swing-up", single, "--table", "--runs", "2"],
    ] {
        Split::new(study).is_the_same_in_3_shards();
    }
}

#[test]
fn a_study_is_an_option_of_the_command_that_has_its_subject() {
    let refused = |arguments: &[&str], why: &str| {
        let output = upright(arguments);
        assert_eq!((status(&output), stdout(&output)), (2, ""), "{arguments:?}");
        assert!(stderr(&output).contains(why), "{arguments:?}: {}", stderr(&output));
    };
    let single = &path_of(SINGLE);
    refused(&["false-alarms", single], "use `upright faults --healthy`");
    refused(&["coverage", single, "--runs", "1"], "use `upright identify --coverage`");
    refused(&["faults", single, "--duration", "1"], "--healthy");
    refused(&["faults", single, "--healthy", "--jog"], "--jog");
    refused(&["identify", single, "--off", "10"], "--coverage");
    refused(&["identify", single, "run.log", "--coverage"], "--coverage");
    refused(&["identify", single, "run.log", "--shard", "1/2"], "only with --coverage");
    refused(&["identify", single], "<FILE>");
}

#[test]
fn what_is_not_every_shard_of_this_study_once_is_refused() {
    let single = &path_of(SINGLE);
    let study =
        Split::new(&["faults", "--healthy", single, "--runs", "5", "--duration", "0.1", "--law", "lqr"]);
    let [one, two, three] = [1, 2, 3].map(|number| study.shard(number, 3));
    let refused = |files: &[&PathBuf], why: &str| {
        let output = study.merge(files);
        assert_eq!(status(&output), 2, "{why}: {}", stdout(&output));
        assert!(stderr(&output).contains(why) && output.stdout.is_empty(), "{why}: {}", stderr(&output));
    };
    refused(&[&one, &three], "shard 2 of 3 is missing");
    refused(&[&one, &two, &three, &two], "shard 2 is there twice");
    refused(&[&one, &two, &study.shard(2, 2)], "2 shards, not 3 shards");
    let other =
        Split::new(&["faults", "--healthy", single, "--runs", "6", "--duration", "0.1", "--law", "lqr"]);
    refused(&[&one, &two, &other.shard(3, 3)], "another study");
    // Files that were cut off, changed, or never written.
    let lines: Vec<String> =
        std::fs::read_to_string(&two).unwrap().lines().map(|line| format!("{line}\n")).collect();
    let changed = |name: &str, lines: &[String]| study.write(name, &lines.concat());
    refused(&[&one, &three, &changed("cut.jsonl", &lines[..2])], "shard 2: run 4 of lqr is missing");
    let doubled = [&lines[..], &lines[2..]].concat();
    refused(&[&one, &three, &changed("doubled.jsonl", &doubled)], "shard 2: run 4 of lqr is there twice");
    let foreign = [&lines[..], &[lines[2].replace("\"run\":4", "\"run\":3")]].concat();
    refused(
        &[&one, &three, &changed("foreign.jsonl", &foreign)],
        "shard 2: run 3 of lqr does not belong to it",
    );
    refused(
        &[&one, &three, &changed("half.jsonl", &[lines[0].clone(), lines[1][..20].to_owned()])],
        "line 2",
    );
    refused(&[&one, &three, &changed("empty.jsonl", &[])], "line 1: not written by --shard");
    refused(&[&one, &three, &study.folder.path().join("none.jsonl")], "none.jsonl: cannot be read");
    // With all of them it works.
    assert_eq!(status(&study.merge(&[&one, &two, &three])), 0);
    for bad in ["0/3", "4/3", "x"] {
        assert_eq!(status(&study.with(&["--shard", bad])), 2);
    }
}
