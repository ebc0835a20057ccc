//! `upright compare` as a user or a script sees it.

use crate::command::{SINGLE, path_of, status, stderr, stdout, upright};
use crate::published::rig_path;
use serde_json::Value;

#[test]
fn rows_and_files_agree() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (csv, svg, png) = (file("a.csv"), file("a.svg"), file("a.png"));
    let output = upright(&[
        "compare",
        &path_of(SINGLE),
        "--sweep",
        "lqr.force_weight=0.05..0.2:2",
        "--duration",
        "3",
        "--law",
        "lqr",
        "--json",
        "--csv",
        &csv,
        "--svg",
        &svg,
        "--png",
        &png,
    ]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let all: Value = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(all["key"], "lqr.force_weight");
    assert_eq!(all["conditions"]["step_m"], 0.1);
    let rows = all["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    assert_eq!((&rows[0]["value"], &rows[1]["value"]), (&Value::from(0.05), &Value::from(0.2)));
    assert_eq!(rows[0]["fate"], "settled");
    let text = std::fs::read_to_string(&csv).unwrap();
    let line = text.lines().nth(1).unwrap();
    let force = rows[0]["figures"]["peak_force_n"].as_f64().unwrap();
    assert!(line.starts_with("single-quanser-ip02,lqr,0.05,settles,") && line.contains(&force.to_string()));
    assert!(std::fs::read_to_string(&svg).unwrap().starts_with("<svg"));
    assert!(std::fs::read(&png).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn what_falls_is_a_row_and_not_a_failure() {
    let paper = path_of("quadruple-paper");
    let sweep = ["--sweep", "tick.period_s=0.002..0.005:2", "--duration", "5"];
    let how = ["--full-state", "--continuous-gains", "--law", "lqr"];
    let output = upright(&[&["compare", paper.as_str()][..], &sweep, &how].concat());
    assert_eq!(status(&output), 0);
    let lines: Vec<&str> = stdout(&output).lines().collect();
    assert_eq!(lines.len(), 4);
    assert!(lines[2].contains("0.002") && !lines[2].contains("fell"), "{}", lines[2]);
    assert!(
        lines[3].contains("0.005") && lines[3].contains("fell") && lines[3].contains("unstable"),
        "{}",
        lines[3]
    );
}

#[test]
fn two_files_of_one_name_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy.toml");
    let text = std::fs::read_to_string(rig_path(SINGLE)).unwrap();
    std::fs::write(&copy, text.replace("force_weight = 0.1", "force_weight = 10")).unwrap();
    let copy = copy.to_str().unwrap();
    let output = upright(&["compare", &path_of(SINGLE), copy, "--law", "lqr", "--duration", "2"]);
    assert_eq!(status(&output), 0);
    let lines: Vec<&str> = stdout(&output).lines().skip(2).collect();
    assert!(lines[0].contains("rigs/single-quanser-ip02.toml") && lines[1].contains(copy), "{lines:?}");
}

#[test]
fn bad_input_ends_with_status_2_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("a.csv");
    for (arguments, parts) in [
        (
            vec![SINGLE, "--sweep", "tick.perod_s=0.001..0.002"],
            vec!["tick.perod_s", "did you mean `period_s`?"],
        ),
        (vec![SINGLE, "--sweep", "tick.period_s=-1..1"], vec!["single-quanser-ip02.toml:", "1e-6 to 10"]),
        (vec![SINGLE, "--sweep", "tick.period_s=1"], vec!["KEY=FROM..TO"]),
        (vec![SINGLE, "--sweep", "cart.mass_kg=1..2:3000"], vec!["give 2 to 1000"]),
        (vec!["quadruple-missing"], vec!["no such file"]),
        (vec![SINGLE, "--duration", "1e9"], vec!["shorten it"]),
    ] {
        let rig = path_of(arguments[0]);
        let csv = ["--csv", csv.to_str().unwrap()];
        let output = upright(&[&["compare", rig.as_str()][..], &arguments[1..], &csv].concat());
        assert_eq!(status(&output), 2, "{arguments:?}: {}", stdout(&output));
        assert!(parts.iter().all(|part| stderr(&output).contains(part)), "{}", stderr(&output));
        assert!(stdout(&output).is_empty() && std::fs::read_dir(folder.path()).unwrap().count() == 0);
    }
}
