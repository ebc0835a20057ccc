//! `upright report`: its files and its exit status.

use std::path::Path;
use std::process::{Command, Output};
use upright_test_support::limits::output;

const RIG: &str = "single-quanser-ip02";

fn report(arguments: &[&str], folder: &Path) -> Output {
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs").join(RIG).with_extension("toml");
    let rig = rig.canonicalize().unwrap();
    output(
        Command::new(env!("CARGO_BIN_EXE_upright"))
            .args(["report", rig.to_str().unwrap(), "--runs", "2"])
            .args(arguments)
            .current_dir(folder),
    )
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn page_and_figures_are_written_where_they_are_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--svg", "svg", "--png", "png/deep", "--csv", "csv", "--json"];
    let output = report(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(names(folder.path()), ["csv", "png", "single-quanser-ip02.html", "svg"]);
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let files = told["files"].as_array().unwrap();
    assert!(files.iter().all(|file| folder.path().join(file.as_str().unwrap()).is_file()));
    let [svg, png, csv] = ["svg", "png/deep", "csv"].map(|name| names(&folder.path().join(name)));
    assert_eq!(files.len(), 1 + svg.len() + png.len() + csv.len());
    assert_eq!((svg.len(), png.len(), csv.len()), (18, 18, 17), "the drawing of the rig is no curve");
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let step = text("csv/step-lqr.csv");
    assert!(step.starts_with("panel,x_axis,curve,x,y,value\n"));
    for curve in [
        "position (m),time (s),x,",
        "angles (°),time (s),θ1,",
        "rates (°/s),time (s),θ1',",
        "force (N),time (s),u,",
    ] {
        // 10 s of 2 ms, both ends included.
        assert_eq!(step.lines().filter(|line| line.starts_with(curve)).count(), 5001, "{curve}");
    }
    let page = text("single-quanser-ip02.html");
    assert!(page.contains(told["hash"].as_str().unwrap()));
    let checks = told["trust"]["checks"].as_array().unwrap();
    let failed = checks.iter().filter(|check| check["holds"] == false).count();
    assert!(failed > 0, "two random plants show nothing");
    assert!(page.contains(&format!("{failed} of {} requirements", checks.len())));
}

#[test]
fn what_cannot_be_written_is_bad_input_and_leaves_no_page() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("file"), "in the way").unwrap();
    for arguments in [["--out", "missing/report.html"], ["--csv", "file"], ["--png", "file/figures"]] {
        let output = report(&arguments, folder.path());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(arguments[1].trim_end_matches("/report.html")), "{told}");
        assert!(output.stdout.is_empty());
        assert_eq!(names(folder.path()), ["file"]);
    }
}

#[test]
fn a_loop_that_falls_is_reported_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let output = report(&["--gains", "continuous", "--tick", "0.2", "--out", "fall.html"], folder.path());
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{told}");
    assert!(told.contains("requirements are not met"), "{told}");
    let page = std::fs::read_to_string(folder.path().join("fall.html")).unwrap();
    assert!(page.contains("are not met") && page.contains("falls: "));
    assert!(page.contains("--gains continuous --tick 0.2 --runs 2"), "the command that makes it again");
}
