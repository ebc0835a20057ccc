//! What the tool says before long work, instead of it, and of values that it only doubts.

use std::process::Command;

use upright_test_support::limits::output;

use crate::command::{path_of, status, stderr, stdout, upright};
use crate::published::rig_path;

/// The text of a rig file of `rigs/` with one change.
fn changed(name: &str, from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(rig_path(name)).unwrap();
    assert!(text.contains(from), "{name}: {from}");
    text.replacen(from, to, 1)
}

/// A folder with a rig file, and the path of that file.
fn written(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    std::fs::write(&path, text).unwrap();
    (folder, path.to_str().unwrap().to_owned())
}

#[test]
fn check_and_design_doubt_a_value_with_its_line() {
    let text = changed("single-quanser-ip02", "[tick]\n", "[tick]\n# slow\n");
    let text = text.replace("force_limit_n = ", "force_limit_n = 10000 # ");
    let line = 1 + text.lines().position(|line| line.starts_with("force_limit_n")).unwrap();
    let (_folder, path) = written(&text);
    for arguments in [&["check", &path][..], &["design", &path, "--no-write"]] {
        let output = upright(arguments);
        let doubt = format!("warning: {path}:{line}: actuator.force_limit_n = 10000 N");
        assert!(status(&output) == 0 && stderr(&output).contains(&doubt), "{}", stderr(&output));
    }
    // Negative control.
    let usual = upright(&["check", &path_of("single-quanser-ip02")]);
    assert_eq!(stderr(&usual), "");
}

#[test]
fn design_where_there_is_no_place_for_the_table_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let design = |more: &[&str]| {
        let rig = path_of("single-quanser-ip02");
        let arguments = [&["design", &rig][..], more].concat();
        output(Command::new(env!("CARGO_BIN_EXE_upright")).args(arguments).current_dir(&folder))
    };
    let refused = design(&[]);
    assert!(stderr(&refused).contains("--out FILE"), "{}", stderr(&refused));
    assert_eq!((status(&refused), stdout(&refused)), (2, ""));
    // Negative control: with a place, the design is made.
    assert!(stdout(&design(&["--out", "gains.rs"])).contains("LQR"));
}

#[test]
fn what_a_board_cannot_do_is_refused_before_the_design() {
    // With this tick there is no design: its refusal would come first, with another exit status.
    let (_folder, path) = written(&changed("quadruple-paper", "period_s = 0.001", "period_s = 0.3"));
    for (board, words) in [("feather-f405", "counts 2 encoders"), ("pico", "ticks of 0.5 to 100 ms")] {
        let output = upright(&["firmware", "build", &path, "--board", board]);
        assert!(status(&output) == 2 && stderr(&output).contains(words), "{}", stderr(&output));
    }
    // Negative control.
    assert_eq!(status(&upright(&["design", &path, "--no-write"])), 3);
}

#[test]
fn a_number_below_zero_is_refused_by_what_is_accepted() {
    for arguments in
        [&["verify", "--runs", "-3"][..], &["faults", "--runs", "-3"], &["swing-up", "--runs", "-1"]]
    {
        let output = upright(&[arguments, &[&path_of("single-quanser-ip02")]].concat());
        let said = stderr(&output);
        assert!(status(&output) == 2 && !said.contains("'-- -"), "{said}");
        assert!(said.contains("invalid value '-") && said.contains("invalid"), "{said}");
    }
}

#[test]
fn check_shows_no_key_that_the_rig_cannot_have() {
    let stepper = upright(&["check", &path_of("single-stepper")]);
    assert!(!stdout(&stepper).contains("required unless"), "{}", stdout(&stepper));
    // Negative control: a key that may be left out is there with its default.
    assert!(stdout(&stepper).contains("friction") && stdout(&stepper).contains("(default)"));
}

#[test]
fn a_potentiometer_without_its_zero_asks_for_its_reading() {
    let zero = "sensor_zero_counts = 9021\n";
    let text = changed("single-absolute", zero, "sensor_travel_rad = 5\n")
        .replace("sensor_bits = 14", "sensor_bits = 12");
    let (_folder, path) = written(&text);
    let said = stderr(&upright(&["check", &path])).to_owned();
    assert!(said.contains("sensor_zero_counts: missing; add the reading of the potentiometer"), "{said}");
    assert!(!said.contains("leave it out") && !said.contains("the what"), "{said}");
}

#[test]
fn a_stepper_without_an_observer_shows_its_gains_and_asks_for_kalman() {
    let text = std::fs::read_to_string(rig_path("single-stepper")).unwrap();
    let (before, rest) = text.split_once("[kalman]").unwrap();
    let after = rest.split_once("\n[").map_or("", |(_, after)| after);
    let (folder, path) = written(&format!("{before}[{after}"));
    let gains = upright(&["design", &path, "--no-write"]);
    assert!(status(&gains) == 0 && stdout(&gains).contains("needs an observer, [kalman]"), "{gains:?}");
    let out = folder.path().join("gains.rs");
    let refused = upright(&["design", &path, "--out", out.to_str().unwrap()]);
    assert!(status(&refused) == 2 && !out.exists(), "{refused:?}");
    for output in [refused, upright(&["simulate", &path])] {
        let said = stderr(&output);
        assert!(
            status(&output) == 2 && said.contains("add [kalman]") && !said.contains("--full-state"),
            "{said}"
        );
    }
}

#[test]
fn a_cart_whose_rail_is_shorter_than_a_turn_of_its_pulley_may_be_an_arm() {
    let said = |path: &str| stderr(&upright(&["swing-up", path, "--stored"])).to_owned();
    // An arm of 85 mm that turns by 80° to both sides, described as a cart.
    let cart = std::fs::read_to_string(rig_path("single-quanser-ip02")).unwrap();
    let arm = cart.replace("[-0.4, 0.4]", "[-0.12, 0.12]").replace("0.00635", "0.085");
    let (_folder, path) = written(&arm);
    assert!(said(&path).contains("describe it by [arm]"), "{}", said(&path));
    // Negative control: a rack with a pinion of 6 mm.
    let (_folder, path) = written(&std::fs::read_to_string(rig_path("single-quanser-ip02")).unwrap());
    assert!(!said(&path).contains("[arm]"), "{}", said(&path));
}
