//! `upright shake` and `upright identify`.

use std::path::Path;

use upright_design::rig::{PlantDescription, Rig};

use crate::command::{SINGLE, path_of, status, stderr, stdout, upright};

const REALITY: &str = "\n[reality]\ncart_friction_n = 0.1\njoint_friction_n_m = 5e-4\nlink_length_percent = 8\n\
    homing_error_rad = 0.004\n";

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_shaken_machine_gives_a_rig_file() {
    let folder = tempfile::tempdir().unwrap();
    let [machine, log, new, table] =
        ["machine.toml", "run.log", "new.toml", "run.csv"].map(|name| folder.path().join(name));
    let file = path_of(SINGLE);
    let nominal = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&machine, nominal.clone() + REALITY).unwrap();
    let output = upright(&["shake", text(&machine), "--log", text(&log), "--seconds", "10"]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));

    let output = upright(&["identify", &file, text(&log), "--write", text(&new), "--json"]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let found: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(found["wiring"]["as_in_file"], true);
    assert!(found["refused"].is_null());
    let rig = Rig::from_path(&new).unwrap();
    let PlantDescription::Chain(chain) = &rig.plant else { panic!("a chain") };
    let PlantDescription::Chain(old) = Rig::from_path(Path::new(&file)).unwrap().plant else {
        panic!("a chain")
    };
    assert_eq!(rig.name, SINGLE);
    // The pendulum's own length, J/a, is 8 % longer; it does not depend on the scale of the force.
    let length = |link: &upright_design::rig::Link| {
        let (mass, centre) = (link.mass_kg, link.centre_of_mass_m.unwrap_or(link.length_m / 2.0));
        let inertia = link.inertia_kg_m2.unwrap_or(mass * link.length_m * link.length_m / 12.0);
        (inertia + mass * centre * centre) / (mass * centre)
    };
    let ratio = length(&chain.links[0]) / length(&old.links[0]);
    assert!((ratio - 1.08).abs() < 2e-3, "{ratio}");
    assert!(std::fs::read_to_string(&new).unwrap().contains("# Quanser"), "comments stay");

    let output = upright(&["identify", &file, text(&log), "--csv", text(&table)]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let rows = std::fs::read_to_string(&table).unwrap();
    assert_eq!(rows.lines().count(), 5_001);
    assert!(rows.starts_with("tick,time_s,x_counts,joint1_counts,x_m,joint1_rad,duty,supply_v,"));
}

#[test]
fn bad_logs_end_with_status_2_and_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let [log, new] = ["run.log", "new.toml"].map(|name| folder.path().join(name));
    let file = path_of(SINGLE);
    let refused = |rig: &str, wanted: &str| {
        let output = upright(&["identify", rig, text(&log), "--write", text(&new)]);
        assert_eq!(status(&output), 2, "{}", stderr(&output));
        assert!(stderr(&output).contains(wanted), "{}", stderr(&output));
        assert!(!new.exists());
    };
    refused(&file, "cannot be read");
    std::fs::write(&log, b"").unwrap();
    refused(&file, "holds no tick");
    std::fs::write(&log, b"tick,time_s\n0,0\n").unwrap();
    refused(&file, "no log of Upright");
    let output = upright(&["shake", &file, "--log", text(&log), "--seconds", "5"]);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let whole = std::fs::read(&log).unwrap();
    refused(&path_of("double-quanser-dbpen"), "name the rig file of this machine");
    std::fs::write(&log, &whole[..whole.len() - 7]).unwrap();
    refused(&file, "ends in the middle");
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    std::fs::write(&log, &damaged).unwrap();
    refused(&file, "is damaged");
}
