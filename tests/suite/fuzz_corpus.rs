//! Inputs that fuzzing found worth keeping, run without the fuzzer: see `.ci/fuzz`.

use upright_fuzz_checks::{commands, frame, log, rig};
use upright_identify::Log;

/// Runs the committed inputs for a target of the fuzzer.
fn replay(target: &str, mut check: impl FnMut(&[u8])) {
    let folder = upright_test_support::repository().join("fuzz/corpus").join(target);
    let files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(!files.is_empty());
    for file in files {
        println!("{}", file.display());
        check(&std::fs::read(file).unwrap());
    }
}

#[test]
fn messages_of_the_corpus_come_back_from_their_frames() {
    replay("frame", frame::check);
}

#[test]
fn no_input_of_the_corpus_breaks_an_invariant() {
    replay("commands", commands::check);
}

#[test]
fn rig_files_of_the_corpus_are_read_or_refused_in_one_line() {
    replay("rig", rig::check);
}

#[test]
fn logs_of_the_corpus_come_back_and_the_others_are_errors_of_one_line() {
    let (mut read, mut refused) = (0, 0);
    replay("log", |bytes| {
        log::check(bytes);
        *if Log::from_bytes(bytes).is_ok() { &mut read } else { &mut refused } += 1;
    });
    assert!(read >= 2 && refused >= 3, "{read} read, {refused} refused");
}
