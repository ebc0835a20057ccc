//! `upright verify` as a user sees it: its verdict, the line that it names, and that it repeats exactly.

use std::path::Path;
use std::process::{Command, Output};

use upright_test_support::limits::output;

use crate::published::rig_path;
use serde_json::Value;

const SINGLE: &str = "single-quanser-ip02";

fn verify(rig: &Path, more: &[&str], threads: Option<&str>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_upright"));
    command.arg("verify").arg(rig).args(more);
    if let Some(threads) = threads {
        command.env("RAYON_NUM_THREADS", threads);
    }
    output(&mut command)
}

fn status(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

fn object(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"))
}

/// The requirements that the report marks as failed.
fn failed(report: &Value) -> Vec<String> {
    let checks = report["checks"].as_array().unwrap();
    let failed = checks.iter().filter(|check| check["holds"] == false);
    failed.map(|check| check["requirement"].as_str().unwrap().to_owned()).collect()
}

/// A copy of the rig file in its own folder, with parts of the text replaced.
fn changed(name: &str, changes: &[(&str, &str)]) -> (tempfile::TempDir, std::path::PathBuf) {
    let mut text = std::fs::read_to_string(rig_path(name)).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

#[test]
fn a_good_rig_passes_with_both_laws_and_every_part_of_the_report() {
    let output = verify(&rig_path(SINGLE), &["--json", "--runs", "100"], None);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let report = object(&output);
    let laws = report["laws"].as_array().unwrap();
    assert_eq!(laws.len(), 2);
    for law in laws {
        for part in ["attraction", "noise_run", "coarsest_encoder", "corners", "monte_carlo"] {
            assert!(law[part].is_object(), "{part}");
        }
        assert_eq!(law["monte_carlo"]["runs"], 100);
    }
    let checks = report["checks"].as_array().unwrap();
    assert!(checks.len() >= 20 && failed(&report).is_empty(), "{checks:?}");
    for law in ["lqr", "pole_placement"] {
        assert!(checks.iter().any(|check| check["law"] == law));
    }
}

#[test]
fn the_report_for_reading_has_a_line_for_every_requirement() {
    let output = verify(&rig_path(SINGLE), &["--runs", "100", "--law", "lqr"], None);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    for line in ["spectral radius", "phase margin", "mass errors", "random plants", "requirements"] {
        assert!(text.contains(line), "{line}: {text}");
    }
    assert!(!text.contains("FAILS") && !text.contains("pole_placement"), "{text}");
}

#[test]
fn the_papers_gains_held_for_three_milliseconds_are_not_stable() {
    let output = verify(
        &rig_path("quadruple-paper"),
        &["--gains", "continuous", "--tick", "0.003", "--runs", "1"],
        None,
    );
    assert_eq!(status(&output), 1, "{}", stderr(&output));
    assert!(stderr(&output).contains("lqr: spectral radius"), "{}", stderr(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("NOT STABLE"));
}

#[test]
fn too_coarse_an_encoder_fails_where_it_is_about_encoders_or_runs() {
    let (_folder, path) =
        changed("quadruple-paper", &[("encoder_counts_per_rev = 4096", "encoder_counts_per_rev = 256")]);
    let output = verify(&path, &["--json", "--runs", "20", "--law", "lqr"], None);
    assert_eq!(status(&output), 1, "{}", stderr(&output));
    let failed = failed(&object(&output));
    assert!(
        failed.iter().any(|line| line.contains("encoder_factor") || line.contains("runs that survive")),
        "{failed:?}"
    );
    assert!(failed.iter().all(|line| stderr(&output).contains(line)), "{failed:?}: {}", stderr(&output));
    // The linear loop has no fault.
    assert!(failed.iter().all(|line| !line.contains("spectral radius")), "{failed:?}");
}

#[test]
fn too_small_a_force_fails_where_it_is_about_tilt_or_runs() {
    let output = verify(
        &rig_path("quadruple-paper"),
        &["--json", "--runs", "20", "--law", "lqr", "--force-limit", "0.05"],
        None,
    );
    assert_eq!(status(&output), 1, "{}", stderr(&output));
    let failed = failed(&object(&output));
    for line in ["tilt_rad", "nominal runs that survive"] {
        assert!(failed.iter().any(|failed| failed.contains(line)), "{line}: {failed:?}");
    }
    assert!(failed.iter().all(|line| !line.contains("spectral radius")), "{failed:?}");
}

#[test]
fn a_cart_that_uses_most_of_its_rail_at_rest_is_refused_and_integral_action_brings_it_back() {
    // Friction, and zeros off by 3 mrad: the cart rests far from its set-point. With pole placement, three of eight
    // such machines reach the end of the rail within hours.
    let reality = "name = \"double-quanser-dbpen\"\nreality.joint_friction_n_m = 5e-4\n\
                   reality.cart_friction_n = 0.5\nreality.homing_error_rad = 3e-3\n";
    let refused = |more: &str, law: &str| {
        let (name, machine) = ("name = \"double-quanser-dbpen\"", format!("{reality}{more}"));
        let (_folder, path) = changed("double-quanser-dbpen", &[(name, &machine)]);
        let output = verify(&path, &["--json", "--runs", "1", "--law", law], None);
        failed(&object(&output)).iter().any(|line| line.contains("limit_percent"))
    };
    assert!(refused("", "lqr") && refused("", "pole-placement"));
    assert!(!refused("integral.position_weight = 20\n", "lqr"));
}

#[test]
fn a_requirement_without_any_value_that_meets_it_is_not_called_unlimited() {
    let weak = ["--runs", "1", "--law", "lqr", "--force-limit", "0.05"];
    let output = verify(&rig_path("quadruple-paper"), &weak, None);
    let text = String::from_utf8(output.stdout).unwrap();
    let encoder = text.lines().find(|line| line.contains("encoder_factor")).unwrap();
    assert!(encoder.contains("FAILS") && encoder.contains("none"), "{encoder}");
    assert!(!text.lines().any(|line| line.contains("FAILS") && line.contains("no limit")), "{text}");
}

#[test]
fn a_threshold_of_the_rig_file_decides() {
    let text = "[limits]\nangle_rad = 0.35";
    let strict = format!("[verify]\nphase_margin_deg = 80\n{text}");
    let (_folder, path) = changed(SINGLE, &[(text, &strict)]);
    let output = verify(&path, &["--json", "--runs", "100", "--law", "lqr"], None);
    assert_eq!(status(&output), 1, "{}", stderr(&output));
    let failed = failed(&object(&output));
    assert!(failed.len() == 1 && failed[0].contains("phase_margin_deg"), "{failed:?}");
}

#[test]
fn a_replay_is_the_same_run_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let replay = |seed: &str, name: &str| {
        let csv = folder.path().join(name);
        let output = verify(
            &rig_path("quadruple-paper"),
            &["--replay", seed, "--law", "pole-placement", "--csv", csv.to_str().unwrap()],
            None,
        );
        assert_eq!(status(&output), 0, "{}", stderr(&output));
        (std::fs::read(&csv).unwrap(), output.stdout)
    };
    let first = replay("17", "a.csv");
    assert!(first.0.len() > 100_000);
    assert!(first == replay("17", "b.csv"));
    assert!(first.0 != replay("18", "c.csv").0);
}

#[test]
fn the_report_depends_on_the_seed_and_not_on_the_number_of_threads() {
    let report = |seed: &str, threads: &str| {
        let output = verify(
            &rig_path(SINGLE),
            &["--json", "--runs", "12", "--law", "lqr", "--seed", seed],
            Some(threads),
        );
        assert!(!output.stdout.is_empty(), "{}", stderr(&output));
        output.stdout
    };
    let first = report("5", "1");
    assert!(first == report("5", "4"));
    assert!(first != report("6", "4"));
}

#[test]
fn a_rig_that_is_not_there_or_an_argument_without_sense_is_not_a_failed_requirement() {
    assert_eq!(status(&verify(Path::new("no-such-rig.toml"), &[], None)), 2);
    assert_eq!(status(&verify(&rig_path(SINGLE), &["--runs", "0"], None)), 2);
    assert_eq!(status(&verify(&rig_path(SINGLE), &["--replay", "1"], None)), 2);
}

#[test]
fn the_documentation_lists_every_row_with_its_meaning() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/trust.md");
    let page = std::fs::read_to_string(file).unwrap();
    let has = |name: &str, meaning: &str| page.contains(&format!("| `{name}` | {meaning} |"));
    for quantity in upright_trust::verify::QUANTITIES {
        let several = quantity.name.strip_suffix(' ').map(|name| format!("{name} …"));
        let name = several.as_deref().unwrap_or(quantity.name);
        assert!(has(name, quantity.meaning), "docs/trust.md: | `{name}` | {} |", quantity.meaning);
        assert!(!has(name, "something else"));
    }
}

#[test]
fn an_imperfection_that_the_file_requires_to_be_stood_is_a_requirement() {
    let required = |lag: &str| {
        let section = format!("[verify]\ndriver_lag_s = {lag}\n\n[limits]\n");
        let (_folder, path) = changed(SINGLE, &[("[limits]\n", &section)]);
        let output = verify(&path, &["--law", "lqr", "--runs", "1", "--json"], None);
        let report = object(&output);
        let mut checks = report["checks"].as_array().unwrap().iter();
        let check = checks.find(|check| check["requirement"] == "runs with the motor on (driver_lag_s)");
        (check.unwrap()["holds"].as_bool().unwrap(), check.unwrap()["required"].as_f64().unwrap())
    };
    assert_eq!(required("1e-3"), (true, 8.0));
    assert_eq!(required("1.0"), (false, 8.0), "a driver that makes it fall");
}

#[test]
fn too_few_runs_are_no_verdict_and_a_limit_that_is_not_there_has_no_share() {
    let (_folder, path) = changed(SINGLE, &[("\nspeed_m_per_s", "\n#speed_m_per_s")]);
    let arguments = |runs: &'static str| ["--runs", runs, "--law", "lqr"];
    let output = verify(&path, &arguments("20"), None);
    assert_eq!(status(&output), 1, "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let open: Vec<&str> = text.lines().filter(|line| line.trim_start().starts_with("open")).collect();
    assert!(open.len() == 1 && open[0].contains("too few runs: at least 73 are needed"), "{text}");
    assert!(!text.contains("FAILS") && stderr(&output).contains("at least 73"), "{text}");
    let shares = text.lines().find(|line| line.contains("of the limits")).unwrap();
    assert!(shares.contains("rail") && shares.contains("angle") && !shares.contains("speed"), "{shares}");
    // Negative control: so many decide.
    let output = verify(&path, &[&arguments("73")[..], &["--json"]].concat(), None);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let report = object(&output);
    assert!(
        report["checks"].as_array().unwrap().iter().all(|check| check["fewest_runs"].is_null()),
        "{report}"
    );
    assert!(report["laws"][0]["noise_run"]["limit_share"]["speed"].is_null(), "{report}");
}

#[test]
fn a_share_that_the_runs_cannot_show_ends_a_swing_up_before_it_begins() {
    let (_folder, path) = changed(SINGLE, &[("[swing_up]", "[swing_up]\nsuccess_percent = 99")]);
    let command = ["swing-up", path.to_str().unwrap(), "--no-write"];
    let output = output(Command::new(env!("CARGO_BIN_EXE_upright")).args(command));
    assert_eq!(status(&output), 2, "{}", stderr(&output));
    for words in ["200 random runs", "at least 381 are needed", "at most 98.1"] {
        assert!(stderr(&output).contains(words), "{words}: {}", stderr(&output));
    }
}
