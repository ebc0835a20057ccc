//! Commands for a rig whose drive imposes the cart's acceleration.

use std::path::Path;

use upright::boards::DEFAULT_BOARD;

use crate::command::{status, stderr, stdout, upright};
use crate::equipment::built_for;
use crate::published::{rig_and_table, rig_path};

fn stepper() -> String {
    rig_path("single-stepper").display().to_string()
}

/// Writes the stepper with a motor behind its pulses into `folder`; returns the file.
pub(crate) fn with_motor(folder: &Path) -> String {
    let rig = std::fs::read_to_string(stepper()).unwrap().replacen("[cart]", "[cart]\nmass_kg = 0.3", 1);
    let motor = "[reality]\nholding_force_n = 60\nfull_step_m = 2e-4\n";
    let file = folder.join("motor.toml");
    std::fs::write(&file, format!("{rig}\n{motor}")).unwrap();
    file.display().to_string()
}

/// Writes the double stepper with a servo of 5 Hz into `folder`; returns the file.
pub(crate) fn with_slow_servo(folder: &Path) -> String {
    let rig = std::fs::read_to_string(rig_path("double-stepper")).unwrap();
    let file = folder.join("servo.toml");
    std::fs::write(
        &file,
        rig.replace("kind = \"acceleration\"", "kind = \"acceleration\"\nbandwidth_hz = 5"),
    )
    .unwrap();
    file.display().to_string()
}

#[test]
fn a_servo_of_another_bandwidth_than_the_design_can_bear_is_warned_about() {
    let folder = tempfile::tempdir().unwrap();
    let warned = |real: &str| {
        let file = with_slow_servo(folder.path());
        let rig = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, format!("{rig}\n[reality]\nbandwidth_hz = {real}\n")).unwrap();
        stderr(&upright(&["design", &file, "--no-write"]))
            .contains("give the servo's real bandwidth in [actuator]")
    };
    assert!(warned("3") && warned("20"));
    assert!(!warned("6"));
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
    assert!(std::fs::read_to_string(&out).unwrap().contains("drive: DriveMap::Pulses(StepMap {"));
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
fn commands_with_an_image_serve_a_stepper() {
    let (rig, table) = rig_and_table("single-stepper");
    if built_for(DEFAULT_BOARD, rig, table).is_none() {
        return;
    }
    let board = ["--target", "board"];
    for arguments in [
        &["firmware", "run", "--duration", "1", "--step", "0.02"][..],
        &["twin", "--duration", "0.5"],
        &["faults", "--kind", "motor-dead", "--runs", "2"],
        &["firmware", "build"],
    ] {
        let with = if arguments == ["firmware", "build"] { &[][..] } else { &board };
        let output = upright(&[arguments, &[&stepper()], with].concat());
        assert_eq!(status(&output), 0, "{arguments:?}: {}", stderr(&output));
    }
    // More pulses than the timer gives in a tick of 30 ms.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("slow.toml");
    let slow = std::fs::read_to_string(stepper()).unwrap().replace("period_s = 0.01", "period_s = 0.03");
    std::fs::write(&file, slow).unwrap();
    let refused = upright(&["firmware", "build", file.to_str().unwrap()]);
    assert!(
        status(&refused) != 0 && stderr(&refused).contains("256 of them in a tick"),
        "{}",
        stderr(&refused)
    );
}

#[test]
fn defects_while_a_stepper_shakes_its_links_are_not_missed() {
    let output = upright(&["faults", &stepper(), "--shake", "--runs", "56"]);
    assert_eq!(status(&output), 0, "{}{}", stdout(&output), stderr(&output));
    assert!(stdout(&output).contains("24 of 24 runs miss the defect, as they must"), "{}", stdout(&output));
}

#[test]
fn compared_steppers_have_a_largest_acceleration_and_mixed_drives_are_told_apart() {
    let (single, motor) = (stepper(), rig_path("single-quanser-ip02").display().to_string());
    let compared = |rigs: &[&str]| {
        let output = upright(&[&["compare"], rigs, &["--law", "lqr", "--duration", "2"]].concat());
        assert_eq!(status(&output), 0, "{}", stderr(&output));
        stdout(&output).lines().next().unwrap().to_owned()
    };
    assert!(compared(&[&single]).contains("| peak acceleration (m/s²) |"));
    assert!(compared(&[&single, &motor]).contains("| peak force (N) or acceleration (m/s²) |"));
    assert!(compared(&[&motor]).contains("| peak force (N) |"));
}

#[test]
fn verify_tells_how_slow_a_stepper_may_be_and_which_force_it_needs() {
    let text = |rig: &str| {
        let verified = upright(&["verify", rig, "--runs", "40"]);
        println!("{}{}", stdout(&verified), stderr(&verified));
        assert!(status(&verified) < 2, "{}", stderr(&verified));
        stdout(&verified).to_owned()
    };
    let ideal = text(&stepper());
    for words in ["least resonance", "least bandwidth", "acceleration 0.0", "push, end of link 1"] {
        assert!(ideal.contains(words), "{words}");
    }
    // Negative controls: a cart without a mass, and forces on it.
    for words in ["force needed", "NOT STABLE", "push, cart", "RMS, force", "RMS, encoder 1"] {
        assert!(!ideal.contains(words), "{words}");
    }
    let folder = tempfile::tempdir().unwrap();
    let with_motor = text(&with_motor(folder.path()));
    for words in ["force needed", "% of the motor's", "push, cart"] {
        assert!(with_motor.contains(words), "{words}");
    }
}

#[test]
fn verify_tells_which_imperfection_makes_a_stepper_fall_and_why_others_are_left_out() {
    let found = upright(&["verify", &stepper(), "--imperfections"]);
    assert_eq!(status(&found), 0, "{}", stderr(&found));
    let row = |key: &str| {
        stdout(&found).lines().find(|line| line.trim_start().starts_with(key)).unwrap().to_owned()
    };
    assert!(row("homing_error_rad").contains("fault "), "{}", stdout(&found));
    assert!(stdout(&found).contains("no cure found; tried: robust.homing_error_rad"));
    assert!(row("cart_friction_n").contains("changes nothing before the motor slips"));
    assert!(row("latency_s").contains("`delay margin`"));
}

#[test]
fn the_report_of_a_stepper_shows_its_acceleration() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report.html");
    let options = ["--out", out.to_str().unwrap(), "--runs", "20", "--imperfections"];
    let made = upright(&[&["report", &stepper()][..], &options].concat());
    assert_eq!(status(&made), 0, "{}", stderr(&made));
    let page = std::fs::read_to_string(&out).unwrap();
    assert!(page.contains("acceleration u (m/s²)") && page.contains("largest acceleration"));
    assert!(page.contains("<code>force_percent</code> a stepper has no force constant"));
    let has_digit = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit());
    assert!(!page.contains("force u (N)") && !page.split("largest force ").skip(1).any(has_digit));
}

#[test]
fn a_healthy_stepper_is_not_turned_off() {
    let healthy = |rig: &str| upright(&["faults", "--healthy", rig, "--runs", "4", "--duration", "60"]);
    let quiet = healthy(&stepper());
    assert_eq!(status(&quiet), 0, "{}{}", stdout(&quiet), stderr(&quiet));
    // Negative control: disturbed thirty times as much as the design expects.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("shaken.toml");
    let rig = std::fs::read_to_string(stepper()).unwrap();
    std::fs::write(&file, format!("{rig}\n[verify]\ntorque_rms_n_m = 3e-2\n")).unwrap();
    let shaken = healthy(file.to_str().unwrap());
    assert_eq!(status(&shaken), 1, "{}{}", stdout(&shaken), stderr(&shaken));
}

#[test]
fn a_stepper_moves_on_a_page() {
    let twin = upright(&["twin", &stepper(), "--duration", "0.5"]);
    assert_eq!(status(&twin), 0, "{}", stderr(&twin));
    assert!(stdout(&twin).contains("http://"), "{}", stdout(&twin));
}

#[test]
fn robust_serves_a_stepper_and_refuses_tolerances_that_it_does_not_have() {
    let robust = |options: &[&str]| {
        upright(&[&["robust", &stepper(), "--mass", "5", "--duration", "5", "--runs", "1"], options].concat())
    };
    let chosen = robust(&["--joint-friction", "1e-3"]);
    assert_eq!(status(&chosen), 0, "{}", stderr(&chosen));
    for words in ["acceleration_weight", "m/s² rms", " m/s² (as in the file: "] {
        assert!(stdout(&chosen).contains(words), "{words}: {}", stdout(&chosen));
    }
    for option in ["--latency", "--cart-friction"] {
        let refused = robust(&[option, "1e-3"]);
        assert_eq!(status(&refused), 2, "{}", stdout(&refused));
        assert!(stderr(&refused).contains(option), "{}", stderr(&refused));
    }
}

#[test]
fn a_defect_of_a_stepper_is_found_and_one_that_it_cannot_have_is_refused() {
    let jammed = upright(&["faults", &stepper(), "--kind", "cart-jammed", "--runs", "3"]);
    assert_eq!(status(&jammed), 0, "{}{}", stdout(&jammed), stderr(&jammed));
    assert!(stdout(&jammed).contains("without detection"), "{}", stdout(&jammed));
    let jogged = upright(&["faults", &stepper(), "--jog", "--runs", "16"]);
    assert_eq!(status(&jogged), 0, "{}{}", stdout(&jogged), stderr(&jogged));
    let stuck = upright(&["faults", &stepper(), "--kind", "motor-stuck", "--runs", "3"]);
    assert_eq!(status(&stuck), 2, "{}", stdout(&stuck));
}
