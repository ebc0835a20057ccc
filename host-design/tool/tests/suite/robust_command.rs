//! `upright robust` as a user sees it: exit status, reason, and the file that it writes.

use std::path::Path;
use std::process::{Command, Output};

use upright_test_support::limits::output;

use crate::published::rig_path;

fn robust(rig: &Path, more: &[&str]) -> Output {
    output(Command::new(env!("CARGO_BIN_EXE_upright")).arg("robust").arg(rig).args(more))
}

fn status_and_reason(output: &Output) -> (i32, String) {
    (output.status.code().unwrap(), String::from_utf8(output.stderr.clone()).unwrap())
}

const SHORT: [&str; 4] = ["--runs", "1", "--duration", "10"];

#[test]
fn the_numbers_of_a_file_are_judged_as_they_are() {
    let judged = |rig: &str| {
        robust(&rig_path(rig), &[&SHORT[..], &["--as-it-is", "--joint-friction", "1.2e-4"]].concat())
    };
    assert_eq!(status_and_reason(&judged("quadruple-robust")).0, 0);
    let (status, reason) = status_and_reason(&judged("quadruple-paper"));
    assert!(status == 1 && reason.contains("lqr, pole_placement"), "{status} {reason}");
}

#[test]
fn what_was_written_is_found_again_and_a_change_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("chosen.toml");
    let front = folder.path().join("front.svg");
    let choose = |more: &[&str]| {
        let fixed = ["--joint-friction", "0.02", "--out", out.to_str().unwrap()];
        robust(&rig_path("single-quanser-ip02"), &[&SHORT[..], &fixed[..], more].concat())
    };
    let output = choose(&["--front", "--svg", front.to_str().unwrap()]);
    assert_eq!(status_and_reason(&output).0, 0, "{output:?}");
    assert!(
        String::from_utf8(output.stdout).unwrap().contains("least ripple at multiples of the tolerances")
    );
    assert!(std::fs::read_to_string(front).unwrap().contains("multiple of the tolerances"));
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("name = \"chosen\"") && text.contains("joint_friction_n_m = 0.02"), "{text}");
    assert_eq!(status_and_reason(&choose(&["--check"])).0, 0);
    std::fs::write(&out, format!("{text}# changed\n")).unwrap();
    assert_eq!(status_and_reason(&choose(&["--check"])).0, 1);
}

#[test]
fn where_there_is_nothing_to_choose_the_exit_status_says_why() {
    let single = rig_path("single-quanser-ip02");
    let (status, reason) = status_and_reason(&robust(&single, &SHORT));
    assert!(status == 2 && reason.contains("no tolerance is stated"), "{status} {reason}");
    let (status, reason) =
        status_and_reason(&robust(&single, &[&SHORT[..], &["--joint-friction", "10"]].concat()));
    assert!(status == 3 && reason.contains("nothing helps"), "{status} {reason}");
}
