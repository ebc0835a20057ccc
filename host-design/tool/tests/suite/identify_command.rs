//! `upright shake` and `upright identify`.

use std::path::Path;
use std::sync::OnceLock;

use upright_design::rig::{PlantDescription, Rig};
use upright_identify::{Log, shake};

use crate::command::{SINGLE, path_of, status, stderr, stdout, upright};

const REALITY: &str = "\n[reality]\ncart_friction_n = 0.1\njoint_friction_n_m = 5e-4\nlink_length_percent = 8\n\
    homing_error_rad = 0.004\n";

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_shaken_machine_gives_a_rig_file() {
    let folder = tempfile::tempdir().unwrap();
    let [machine, log, new, table, page] =
        ["machine.toml", "run.log", "new.toml", "run.csv", "run.html"].map(|name| folder.path().join(name));
    let file = path_of(SINGLE);
    let nominal = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&machine, nominal.clone() + REALITY).unwrap();
    let output = upright(&["shake", text(&machine), "--log", text(&log), "--seconds", "24"]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));

    let output =
        upright(&["identify", &file, text(&log), "--write", text(&new), "--report", text(&page), "--json"]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let found: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(found["wiring"]["as_in_file"], true);
    assert!(found["refused"].is_null());
    let rig = Rig::from_path(&new).unwrap();
    let chain = rig.chain().unwrap();
    let PlantDescription::Chain(old) = Rig::from_path(Path::new(&file)).unwrap().plant else {
        panic!("a chain")
    };
    assert_eq!(rig.name, SINGLE);
    // The length of the equivalent simple pendulum, J/a, is 8 % longer; it does not depend on the scale of the force.
    let length = |link: &upright_design::rig::Link| {
        let (mass, centre) = (link.mass_kg, link.centre_of_mass_m.unwrap_or(link.length_m / 2.0));
        let inertia = link.inertia_kg_m2.unwrap_or(mass * link.length_m * link.length_m / 12.0);
        (inertia + mass * centre * centre) / (mass * centre)
    };
    let ratio = length(&chain.links[0]) / length(&old.links[0]);
    assert!((ratio - 1.08).abs() < 2e-3, "{ratio}");
    assert!(std::fs::read_to_string(&new).unwrap().contains("# Quanser"), "comments stay");
    let page = std::fs::read_to_string(&page).unwrap();
    assert_eq!(page.matches("<svg").count(), 3, "fits, residuals, spectra");
    assert!(page.contains("✓ The numbers fit.") && page.contains("second moment, link 1"));

    let output = upright(&["identify", &file, text(&log), "--csv", text(&table)]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let rows = std::fs::read_to_string(&table).unwrap();
    assert_eq!(rows.lines().count(), 12_001);
    assert!(rows.starts_with("tick,time_s,x_counts,joint1_counts,x_m,joint1_rad,duty,supply_v,"));
    let output = upright(&["identify", &file, text(&log), "--mcap", text(&table)]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let bytes = std::fs::read(&table).unwrap();
    assert!(bytes.starts_with(b"\x89MCAP0\r\n") && bytes.ends_with(b"\x89MCAP0\r\n"));
}

/// Asserts that, for a log of these bytes, the exit status is `wanted`, stderr says `words`, and no rig file is
/// written.
fn refused(rig: &str, log: &[u8], wanted: i32, words: &str) {
    let folder = tempfile::tempdir().unwrap();
    let [file, new] = ["run.log", "new.toml"].map(|name| folder.path().join(name));
    std::fs::write(&file, log).unwrap();
    let output = upright(&["identify", rig, text(&file), "--write", text(&new), "--trust-wiring"]);
    assert_eq!(status(&output), wanted, "{}", stderr(&output));
    assert!(stderr(&output).contains(words), "{}", stderr(&output));
    assert!(stderr(&output).contains("run.log") || wanted == 3, "{}", stderr(&output));
    assert!(!new.exists());
}

/// 6 s of the simulated rig, recorded once.
fn shaken() -> &'static Log {
    static LOG: OnceLock<Log> = OnceLock::new();
    LOG.get_or_init(|| shake(&Rig::from_path(Path::new(&path_of(SINGLE))).unwrap(), 6.0, 1).unwrap())
}

/// The log with each row of counters changed.
fn changed(change: impl Fn(&mut [u16])) -> Vec<u8> {
    let mut log = Log::new(shaken().header.clone());
    for (index, tick) in shaken().ticks().iter().enumerate() {
        let mut counts = shaken().counts(index).to_vec();
        change(&mut counts);
        log.push(*tick, &counts);
    }
    log.to_bytes()
}

#[test]
fn a_log_that_is_not_there_ends_with_status_2() {
    let output = upright(&["identify", &path_of(SINGLE), "nowhere.log"]);
    assert_eq!(status(&output), 2);
    assert!(stderr(&output).contains("nowhere.log: cannot be read"), "{}", stderr(&output));
}

#[test]
fn an_empty_log_ends_with_status_2() {
    refused(&path_of(SINGLE), b"", 2, "holds no row of numbers");
}

#[test]
fn a_foreign_file_ends_with_status_2() {
    refused(&path_of(SINGLE), b"tick,time_s\n0,0\n", 2, "column 1 (\"tick\"): has no known meaning");
}

#[test]
fn a_damaged_log_ends_with_status_2() {
    let mut damaged = shaken().to_bytes();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    refused(&path_of(SINGLE), &damaged, 2, "is damaged");
}

#[test]
fn a_truncated_log_ends_with_status_2() {
    let whole = shaken().to_bytes();
    refused(&path_of(SINGLE), &whole[..whole.len() - 7], 2, "ends within the header or frame");
}

#[test]
fn a_log_of_another_rig_ends_with_status_2() {
    let words = "name the rig file of this machine";
    refused(&path_of("double-quanser-dbpen"), &shaken().to_bytes(), 2, words);
}

#[test]
fn a_log_with_another_tick_ends_with_status_2() {
    let mut log = shaken().clone();
    log.header.period_ns = 1_000_000;
    refused(&path_of(SINGLE), &log.to_bytes(), 2, "correct period_s in [tick]");
}

#[test]
fn a_log_in_which_nothing_moves_ends_with_status_3() {
    let hanging = shaken().header.hanging.clone();
    refused(&path_of(SINGLE), &changed(|row| row.copy_from_slice(&hanging)), 3, "nothing moves in the log");
}

#[test]
fn a_link_that_is_blocked_ends_with_status_3() {
    let hanging = shaken().header.hanging[1];
    refused(&path_of(SINGLE), &changed(|row| row[1] = hanging), 3, "joint 1 does not move in the log");
}

#[test]
fn a_sound_log_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let [log, new] = ["run.log", "new.toml"].map(|name| folder.path().join(name));
    std::fs::write(&log, changed(|_| ())).unwrap();
    let output =
        upright(&["identify", &path_of(SINGLE), text(&log), "--write", text(&new), "--trust-wiring"]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    assert!(new.exists());
}
