//! The program that `cargo upright` starts: its own commands, and how it passes on all others.

use std::process::{Command, Output};

use upright_test_support::limits::output;
use upright_test_support::published::rig_path;

/// Runs the program, with `cargo` in place of the cargo that has started it.
fn upright(arguments: &[&str], cargo: &str) -> Output {
    output(Command::new(env!("CARGO_BIN_EXE_upright-command")).args(arguments).env("CARGO", cargo))
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// No program.
const MISSING: &str = "/nowhere/cargo";

#[test]
fn check_and_design_need_no_other_program() {
    let rig = rig_path("single-quanser-ip02");
    let rig = rig.to_str().unwrap();
    for arguments in [&["check", rig, "--json"][..], &["design", rig, "--no-write", "--json"]] {
        let output = upright(arguments, MISSING);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(object.is_object());
    }
    let refused = upright(&["design", rig, "--no-such-option"], MISSING);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("Usage: upright design"), "{}", text(&refused.stderr));
    let failed = upright(&["check", "no-such-rig.toml"], MISSING);
    assert_eq!(failed.status.code(), Some(2), "{}", text(&failed.stderr));
}

#[cfg(unix)]
#[test]
fn all_else_goes_to_the_whole_tool_as_it_was_typed_and_its_exit_status_comes_back() {
    use std::os::unix::fs::PermissionsExt;

    let folder = tempfile::tempdir().unwrap();
    let cargo = folder.path().join("cargo");
    std::fs::write(&cargo, "#!/bin/sh\nprintf '%s\\n' \"$@\"\nexit 3\n").unwrap();
    std::fs::set_permissions(&cargo, std::fs::Permissions::from_mode(0o755)).unwrap();
    let cargo = cargo.to_str().unwrap();
    let rig = rig_path("single-quanser-ip02");
    let rig = rig.to_str().unwrap();
    let passed_on = [
        &["verify", rig, "--runs", "-1"][..],
        &["--help"],
        &[],
        &["design", rig, "--no-write", "--swing-up"],
    ];
    for arguments in passed_on {
        let output = upright(arguments, cargo);
        assert_eq!(output.status.code(), Some(3), "{arguments:?}");
        let got: Vec<&str> = text(&output.stdout).lines().collect();
        assert_eq!(got[0], "run");
        let begin = got.iter().position(|&argument| argument == "--").unwrap() + 1;
        assert_eq!(got[begin..], *arguments);
    }
}

#[test]
fn without_cargo_it_says_that_the_whole_tool_cannot_be_built() {
    let output = upright(&["verify", "rig.toml"], MISSING);
    assert_eq!(output.status.code(), Some(4));
    assert!(text(&output.stderr).contains("cargo does not start"), "{}", text(&output.stderr));
}
