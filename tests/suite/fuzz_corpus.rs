//! Inputs that fuzzing found worth keeping, run without the fuzzer: see `.ci/fuzz`.

#[path = "../../fuzz/checks/commands.rs"]
mod commands;
#[path = "../../fuzz/checks/frame.rs"]
mod frame;

fn replay(target: &str, check: fn(&[u8])) {
    let directory = format!("{}/fuzz/corpus/{target}", env!("CARGO_MANIFEST_DIR"));
    let files: Vec<_> = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
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
