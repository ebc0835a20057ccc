//! `upright identify` with extracts of published recordings of real machines; licences and sources are beside them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::command::{path_of, status, stderr, stdout, upright};

/// Paths of the recordings `name`-`number`.
fn recordings(name: &str, numbers: &[&str]) -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recordings");
    numbers.iter().map(|number| format!("{}/{name}-{number}.csv", folder.display())).collect()
}

/// A rig file of the machine that knows next to nothing of it, as in docs/results/identified.md.
fn ignorant(name: &str, folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(path_of(name)).unwrap();
    let mut ignorant = String::new();
    for line in text.split("[reality]").next().unwrap().lines() {
        let line = match line.split(' ').next() {
            Some("length_m") => "length_m = 0.3",
            Some("inertia_kg_m2") => "inertia_kg_m2 = 0.002",
            Some("friction_n_m_s_per_rad") => "friction_n_m_s_per_rad = 0",
            _ => line,
        };
        writeln!(ignorant, "{line}").unwrap();
    }
    let file = folder.join("ignorant.toml");
    std::fs::write(&file, ignorant).unwrap();
    file
}

/// What identification says of the machine of `file`, and its exit status.
fn identified(file: &Path, used: &[String], unused: &[String], options: &[&str]) -> (Value, i32) {
    let mut arguments = vec!["identify", file.to_str().unwrap()];
    arguments.extend(used.iter().map(String::as_str));
    arguments.extend(["--json", "--clamped"].iter().chain(options));
    arguments.push("--predict");
    arguments.extend(unused.iter().map(String::as_str));
    let output = upright(&arguments);
    let all =
        serde_json::from_str(stdout(&output)).unwrap_or_else(|error| panic!("{error}: {}", stderr(&output)));
    (all, status(&output))
}

const ABSOLUTE: [&str; 6] = ["--angles", "absolute", "--zero", "upright", "--period", "0.004"];

/// The number found of a parameter.
fn found(all: &Value, name: &str) -> f64 {
    let of = all["estimates"].as_array().unwrap().iter().find(|one| one["name"] == name);
    of.unwrap_or_else(|| panic!("{name} in {all}"))["found"].as_f64().unwrap()
}

/// Errors of the unused recordings over windows of this length, in percent of the range of each joint.
fn percents(all: &Value, window_s: f64) -> Vec<f64> {
    let windows = all["predicted"].as_array().unwrap().iter().find(|one| one["window_s"] == window_s);
    let channels = windows.unwrap()["channels"].as_array().unwrap();
    channels.iter().map(|channel| channel["percent_found"].as_f64().unwrap()).collect()
}

fn below(errors: &[f64], most: &[f64]) {
    assert_eq!(errors.len(), most.len());
    assert!(errors.iter().zip(most).all(|(error, most)| error < most), "{errors:?} {most:?}");
}

fn doubts(all: &Value) -> String {
    all["doubts"].to_string()
}

#[test]
fn a_real_single_pendulum_is_identified_and_its_unused_swing_predicted() {
    let folder = tempfile::tempdir().unwrap();
    let file = ignorant("single-multiarm", folder.path());
    let (used, unused) = (recordings("single", &["1", "2", "3"]), recordings("single", &["4"]));
    let (all, code) = identified(&file, &used, &unused, &ABSOLUTE);
    assert_eq!(code, 0, "{all}");
    let dry = found(&all, "dry friction, joint 1");
    assert!((4.9e-4..6.6e-4).contains(&dry), "{dry}");
    assert!(found(&all, "viscous friction, joint 1") >= 0.0 && found(&all, "air drag, link 1") > 1e-5);
    below(&percents(&all, 0.5), &[0.04]);
    below(&percents(&all, 2.0), &[0.14]);
    assert!(!doubts(&all).contains("left out") && !doubts(&all).contains("residuals"), "{all}");
    // Without air drag, dry friction looks like viscous friction: that is said.
    let without: Vec<&str> = ABSOLUTE.into_iter().chain(["--without-drag"]).collect();
    let (all, _) = identified(&file, &used, &unused, &without);
    assert_eq!(found(&all, "dry friction, joint 1"), 0.0);
    assert!(doubts(&all).contains("left out: air drag, link 1"), "{all}");
}

#[test]
fn a_real_triple_pendulum_is_identified_and_its_unused_swings_predicted() {
    let folder = tempfile::tempdir().unwrap();
    let file = ignorant("triple-multiarm", folder.path());
    let used = recordings("triple", &["01", "03", "05", "07", "09", "11", "13", "15", "17"]);
    let unused = recordings("triple", &["19", "20", "21", "22"]);
    let (all, code) = identified(&file, &used, &unused, &ABSOLUTE);
    assert_eq!(code, 0, "{all}");
    let within = |name: &str, least: f64, most: f64| {
        let value = found(&all, name);
        assert!((least..most).contains(&value), "{name}: {value}");
    };
    within("dry friction, joint 2", 5.2e-4, 5.8e-4);
    within("dry friction, joint 3", 0.0, 4e-5);
    within("air drag, link 3", 2.1e-5, 2.6e-5);
    below(&percents(&all, 0.5), &[0.05, 0.12, 0.045]);
    below(&percents(&all, 2.0), &[0.24, 0.30, 0.16]);
    // Without dry friction, parts of the recordings are predicted far worse from the others: nothing would be written.
    let without: Vec<&str> = ABSOLUTE.into_iter().chain(["--without-dry"]).collect();
    let (all, code) = identified(&file, &used, &unused, &without);
    assert_eq!(code, 3, "{all}");
    assert!(doubts(&all).contains("left out: dry friction, joint 2"), "{all}");
}

/// Every other row of the unused swing, at the same period: a pendulum that swings twice as fast.
#[test]
fn unused_recordings_of_another_pendulum_are_doubted_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = path_of("single-multiarm");
    let (used, unused) = (recordings("single", &["1", "2"]), recordings("single", &["4"]));
    let text = std::fs::read_to_string(&unused[0]).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names = lines.next().unwrap();
    let rows: Vec<&str> = lines.step_by(2).collect();
    let other = folder.path().join("other.csv");
    std::fs::write(&other, format!("{names}\n{}\n", rows.join("\n"))).unwrap();
    let new = folder.path().join("new.toml");
    let write = ["--write", new.to_str().unwrap()];
    let options: Vec<&str> = ABSOLUTE.into_iter().chain(write).collect();
    let (all, code) = identified(Path::new(&file), &used, &[other.to_str().unwrap().to_owned()], &options);
    assert!(
        code == 3 && doubts(&all).contains("not used are not predicted: joint 1 is off by"),
        "{code} {all}"
    );
    assert!(!new.exists());
    let trusted: Vec<&str> = options.iter().copied().chain(["--trust-numbers"]).collect();
    let (_, code) = identified(Path::new(&file), &used, &[other.to_str().unwrap().to_owned()], &trusted);
    assert!(code == 0 && new.exists());
    // The negative control.
    let (all, code) = identified(Path::new(&file), &used, &unused, &ABSOLUTE);
    assert_eq!(code, 0, "{all}");
}

/// A double pendulum with a motor and a gear at each joint, whose rotors and gear friction are not in our model.
#[test]
fn a_machine_that_the_model_lacks_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(ignorant("double-multiarm", folder.path())).unwrap();
    let file = folder.path().join("driven.toml");
    std::fs::write(&file, text.replace("= 40000", "= 16471")).unwrap();
    let (used, unused) = (recordings("driven-double", &["1", "2", "4"]), recordings("driven-double", &["3"]));
    let (all, code) = identified(&file, &used, &unused, &["--angles", "relative", "--zero", "hanging"]);
    assert_eq!(code, 3, "{all}");
    assert!(all["refused"].as_str().unwrap().contains("does not fit"), "{all}");
    assert!(doubts(&all).contains("The residuals of joint 2 are"), "{all}");
}

/// 9 s of the single pendulum at 60 rows a second, in a table with a column that is not used.
fn slow_table(folder: &Path, change: impl Fn(f64) -> f64) -> String {
    let text = std::fs::read_to_string(&recordings("single", &["1"])[0]).unwrap();
    let values = text.lines().filter_map(|line| line.parse::<f64>().ok());
    let mut table = String::new();
    for (row, angle) in values.step_by(4).enumerate() {
        writeln!(table, "{row};{}", change(angle).to_string().replace('.', ",")).unwrap();
    }
    let file = folder.join("swing.csv");
    std::fs::write(&file, table).unwrap();
    file.to_str().unwrap().to_owned()
}

const SLOW: [&str; 7] = ["--columns", "-,angle_1_rad", "--period", "0.016", "--zero", "upright", "--clamped"];

#[test]
fn the_six_lines_of_the_guide_identify_a_bare_pendulum() {
    let folder = tempfile::tempdir().unwrap();
    let guide = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/identify.md"))
        .unwrap();
    let lines = guide.split("```toml (not for a design)\n").nth(1).unwrap().split("```").next().unwrap();
    assert_eq!(lines.lines().count(), 6);
    let [file, new] = ["pendulum.toml", "found.toml"].map(|name| folder.path().join(name));
    std::fs::write(&file, lines).unwrap();
    let table = slow_table(folder.path(), |angle| angle);
    let arguments = ["identify", file.to_str().unwrap(), &table, "--write", new.to_str().unwrap()];
    let output = upright(&[&arguments[..], &SLOW].concat());
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).contains("Rows every 16 ms"), "{}", stdout(&output));
    // The length of the equivalent simple pendulum, from all recordings: docs/results/identified.md.
    let rig = upright_design::rig::Rig::from_path(&new).unwrap();
    let link = &rig.chain().unwrap().links[0];
    let (mass, centre) = (link.mass_kg, link.centre_of_mass_m.unwrap());
    let length = centre + link.inertia_kg_m2.unwrap() / (mass * centre);
    assert!((length - 0.15315).abs() < 1e-4, "{length}");
}

/// What is refused has no number that no machine has.
#[test]
fn a_refusal_prints_no_impossible_number() {
    let folder = tempfile::tempdir().unwrap();
    let file = path_of("single-multiarm");
    // A sense that changes: no machine swings like this.
    let table = slow_table(folder.path(), |angle| if angle > 3.3 { 2.0 * angle - 3.3 } else { angle });
    for trust in [&["--trust-wiring"][..], &[]] {
        let output = upright(&[&["identify", &file, &table][..], &SLOW, trust].concat());
        assert_eq!(status(&output), 3, "{}", stdout(&output));
        let said = stdout(&output).to_owned() + stderr(&output);
        assert!(!said.contains("NaN") && !said.contains("inf "), "{said}");
        let output = upright(&[&["identify", &file, &table, "--json"][..], &SLOW, trust].concat());
        let all: Value = serde_json::from_str(stdout(&output)).unwrap();
        for estimate in all["estimates"].as_array().unwrap() {
            let name = estimate["name"].as_str().unwrap();
            let may_be_negative =
                !["mass", "moment", "length", "friction"].iter().any(|word| name.contains(word));
            assert!(
                may_be_negative || estimate["found"].as_f64().is_none_or(|found| found >= 0.0),
                "{estimate}"
            );
        }
    }
}
