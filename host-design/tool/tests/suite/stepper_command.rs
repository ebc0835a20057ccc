//! Commands for a rig whose drive imposes the cart's acceleration.

use crate::command::{status, stderr, stdout, upright};
use crate::published::rig_path;

fn stepper() -> String {
    rig_path("single-stepper").display().to_string()
}

#[test]
fn check_design_simulate_and_export_serve_a_stepper() {
    let rig = stepper();
    let check = upright(&["check", &rig]);
    assert_eq!(status(&check), 0);
    for word in ["acceleration limit", "mass of the links", "acceleration weight", "m²/s³"] {
        assert!(stdout(&check).contains(word), "{word}: {}", stdout(&check));
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("gains.rs");
    let design = upright(&["design", &rig, "--out", out.to_str().unwrap()]);
    assert_eq!(status(&design), 0, "{}", stderr(&design));
    assert!(std::fs::read_to_string(&out).unwrap().contains("steps: Some(StepMap {"));
    let simulated = upright(&["simulate", &rig, "--step", "0.05"]);
    assert_eq!(status(&simulated), 0, "{}", stderr(&simulated));
    assert!(stdout(&simulated).contains("m/s²"), "{}", stdout(&simulated));
    let late = upright(&["simulate", &rig, "--delay", "1"]);
    assert_eq!(status(&late), 2);
    assert!(stderr(&late).contains("--delay 1"), "{}", stderr(&late));
    let header = folder.path().join("controller.h");
    assert_eq!(status(&upright(&["export", &rig, "--c", header.to_str().unwrap()])), 0);
    assert!(std::fs::read_to_string(&header).unwrap().contains("int32_t pulses"));
}

#[test]
fn commands_that_do_not_serve_a_stepper_refuse_it_by_name() {
    let rig = stepper();
    let refused = |arguments: &[&str]| {
        let output = upright(arguments);
        assert_eq!(status(&output), 2, "{arguments:?}: {}", stderr(&output));
        let words =
            format!("single-stepper: `upright {}` serves only drives that give a force", arguments[0]);
        assert!(stderr(&output).contains(&words), "{arguments:?}: {}", stderr(&output));
    };
    for command in
        ["verify", "faults", "false-alarms", "report", "compare", "robust", "swing-up", "transitions"]
    {
        refused(&[command, &rig]);
    }
    refused(&["twin", &rig]);
    refused(&["commission", &rig, "--target", "host"]);
    refused(&["identify", &rig, "nothing.log"]);
}
