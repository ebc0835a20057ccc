//! `upright transitions`: the stored motions one after the other, and what it refuses.

use serde_json::Value;

use crate::command::{path_of, status, stderr, stdout, upright};

const DOUBLE: &str = "double-quanser-dbpen.toml";

#[test]
fn a_run_reports_every_motion() {
    let output = upright(&["transitions", &path_of(DOUBLE), "--stored", "--runs", "1", "--json"]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let report: Value = serde_json::from_str(stdout(&output)).unwrap();
    let all = report["transitions"].as_array().unwrap();
    assert_eq!(all.len(), 12);
    assert!(all.iter().all(|one| one["tried"] == 1 && one["arrived"] == 1), "{all:?}");
}

#[test]
fn a_transition_that_is_none_or_belongs_to_the_swing_up_is_refused() {
    let refusal = |transition: &str| {
        let output = upright(&["transitions", &path_of(DOUBLE), "--only", transition]);
        assert_eq!(status(&output), 2);
        stderr(&output).to_owned()
    };
    assert!(refusal("uu-xx").contains("give a letter for each link, as in uu-dd"));
    assert!(refusal("dd-uu").contains("belongs to `upright swing-up`"));
}

#[test]
fn a_rig_without_motions_is_told_which_command_makes_them() {
    for (arguments, command) in [
        (["transitions", "quadruple-robust.toml", "--stored"], "`upright swing-up`"),
        (["transitions", "quadruple-paper.toml", "--stored"], "`upright transitions`"),
        (["simulate", "quadruple-paper.toml", "--transitions"], "`upright transitions`"),
    ] {
        let output = upright(&[arguments[0], &path_of(arguments[1]), arguments[2]]);
        assert_eq!(status(&output), 2, "{arguments:?}");
        assert!(stderr(&output).contains(&format!("no such file; make it with {command}")), "{arguments:?}");
    }
}
