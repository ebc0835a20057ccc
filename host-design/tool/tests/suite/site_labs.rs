//! What a student hands in, and how a class is marked.

use std::process::Command;

use serde_json::{Value, json};
use upright_page::Desk;
use upright_test_support::limits::output;
use upright_tool::site::lab;

use crate::site_page::root;

const LAB: &str = "lessons/03-weights.toml";

fn ask(question: &Value) -> Value {
    serde_json::from_str(&Desk::default().answer(&question.to_string())).unwrap()
}

/// The file of a student who has given the intended answer to the first step, and claims it for both.
fn handed_in(name: &str) -> String {
    let rig = std::fs::read_to_string(root().join("rigs/single-quanser-ip02.toml")).unwrap();
    let right = rig.replace("state_weights = [200, 1, 200, 1]", "state_weights = [2000, 1, 200, 1]");
    let step = |toml: &str, tries: u32| json!({ "answer": [], "toml": toml, "is_right": true, "tries": tries, "hints": 1 });
    let lab = lab(&root().join(LAB)).unwrap();
    let work = json!({ "lab": lab.title, "lab_sum": lab.sum(), "name": name, "seed": "4711", "minutes": 12.5,
                       "steps": [step(&right, 2), step(&rig, 1)] });
    ask(&json!({ "ask": "hand-in", "toml": rig, "work": work }))["text"].as_str().unwrap().to_owned()
}

fn mark(folder: &std::path::Path, lab: &str, more: &[&str]) -> (Option<i32>, String, String) {
    let output = output(
        Command::new(env!("CARGO_BIN_EXE_upright"))
            .arg("mark")
            .arg(folder)
            .arg("--lab")
            .arg(root().join(lab))
            .args(more),
    );
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_class_is_run_again_and_what_was_edited_by_hand_does_not_count() {
    let folder = tempfile::tempdir().unwrap();
    let text = handed_in("Anna");
    std::fs::write(folder.path().join("anna.json"), &text).unwrap();
    std::fs::write(folder.path().join("notes.txt"), "no work").unwrap();
    let csv = folder.path().join("class.csv");
    let (status, printed, _) = mark(folder.path(), LAB, &["--csv", csv.to_str().unwrap()]);
    // The page's ✓ for the second step is not believed.
    assert_eq!(status, Some(0), "{printed}");
    assert!(printed.contains("| anna.json | Anna | 4711 | 1 of 2 | ✓✗ | 3 | 2 | 12.5 |"), "{printed}");
    let csv = std::fs::read_to_string(csv).unwrap();
    assert_eq!(csv.lines().nth(1), Some("anna.json,Anna,4711,1,2,3,2,12.5,"), "{csv}");

    // Negative controls: a better second answer, another name, no such file, another lab.
    let better = text.replacen("\"tries\":1", "\"tries\":9", 1);
    assert_ne!(better, text);
    std::fs::write(folder.path().join("berta.json"), better).unwrap();
    std::fs::write(folder.path().join("carl.json"), text.replace("Anna", "Carl")).unwrap();
    std::fs::write(folder.path().join("dora.json"), "{}").unwrap();
    let (status, printed, told) = mark(folder.path(), LAB, &["--json"]);
    assert_eq!(status, Some(1));
    assert!(told.contains("3 of 4 files do not count"), "{told}");
    let marked: Vec<Value> = serde_json::from_str(&printed).unwrap();
    let why = |number: usize| marked[number]["refused"].as_str().unwrap_or_default().to_owned();
    assert!(
        why(0).is_empty() && why(1).contains("changed after") && why(2).contains("changed after"),
        "{printed}"
    );
    assert!(why(3).contains("no file that the page saves"), "{printed}");
    assert!(marked[0]["steps"][0][1].as_str().unwrap().contains("settled after 1.2"), "{printed}");
    let (_, printed, _) = mark(folder.path(), "lessons/08-fault.toml", &[]);
    assert!(printed.contains("of another state of this one"), "{printed}");
}
