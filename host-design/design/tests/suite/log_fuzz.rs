//! The corpus of the log fuzzer, checked without the fuzzer: see `.ci/fuzz`.

/// The same check that the fuzzer runs.
#[path = "../../../../fuzz/checks/log.rs"]
mod log;

use upright_design::identify::Log;

#[test]
fn logs_of_the_corpus_come_back_and_the_others_are_errors_of_one_line() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/log");
    let (mut read, mut refused) = (0, 0);
    for entry in std::fs::read_dir(folder).unwrap() {
        let bytes = std::fs::read(entry.unwrap().path()).unwrap();
        log::check(&bytes);
        *if Log::from_bytes(&bytes).is_ok() { &mut read } else { &mut refused } += 1;
    }
    assert!(read >= 2 && refused >= 3, "{read} read, {refused} refused");
}
