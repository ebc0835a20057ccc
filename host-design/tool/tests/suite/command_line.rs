//! The tool as a user or a script sees it: exit statuses, stdout, and which files are written.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use upright_test_support::limits::output;

use crate::command::{SINGLE, path_of, status, stderr, stdout, upright};
use crate::published::rig_path;
use serde_json::Value;

/// Exactly one JSON object on stdout, and nothing else.
fn object(output: &Output) -> Value {
    let text = stdout(output);
    assert_eq!(text.lines().count(), 1, "{text}");
    let value: Value = serde_json::from_str(text).unwrap();
    assert!(value.is_object());
    value
}

/// A folder with a table that must not change, and a rig file.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new(rig: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("rig.toml"), rig).unwrap();
        std::fs::write(folder.path().join("gains.rs"), "precious").unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn design(&self, more: &[&str]) -> Output {
        let (rig, out) = (self.path("rig.toml"), self.path("gains.rs"));
        upright(&[&["design", rig.to_str().unwrap(), "--out", out.to_str().unwrap()], more].concat())
    }

    /// Whether no file in the folder is new or changed.
    fn is_untouched(&self) -> bool {
        std::fs::read_to_string(self.path("gains.rs")).unwrap() == "precious"
            && std::fs::read_dir(self.0.path()).unwrap().count() == 2
    }
}

fn model(a: &str, b: &str, law: &str) -> String {
    format!("name = \"model\"\n[model]\na = {a}\nb = {b}\n{law}\n")
}

const LQR: &str = "[lqr]\nstate_weights = [1, 1]\nforce_weight = 1";
const PLACEMENT: &str = "[pole_placement]\npoles = [[-3, 0], [-4, 0]]";

#[test]
fn a_problem_without_solution_ends_with_status_3_says_why_and_writes_nothing() {
    let paper = std::fs::read_to_string(rig_path("quadruple-paper")).unwrap();
    let cases = [
        (model("[[-1, 0], [0, -2]]", "[1, 0]", PLACEMENT), "does not reach the mode at -2.0000"),
        (model("[[-1, 0], [0, 2]]", "[1, 0]", LQR), "does not reach the mode at 2.0000"),
        (
            model("[[0, 1], [0, 0]]", "[0, 1]", "[lqr]\nstate_weights = [0, 1]\nforce_weight = 1"),
            "state_weights",
        ),
        (
            model("[[0, 1], [0, 0]]", "[0, 1]", "[pole_placement]\npoles = [[-1, 0]]"),
            "the number of poles is 1",
        ),
        (model("[[0, 1], [0, 0]]", "[0, 1]", "[pole_placement]\npoles = [[-1, 2], [-1, 2]]"), "add [-1, -2]"),
        (paper.replace("period_s = 0.001", "period_s = 0.3"), "tick.period_s = 0.3 s is too long"),
        (model("[[0, 1], [0, 0]]", "[0, 1]", ""), "add [lqr] or [pole_placement]"),
    ];
    for (rig, reason) in &cases {
        for more in [&[][..], &["--json"]] {
            let bench = Bench::new(rig);
            let output = bench.design(more);
            assert_eq!(status(&output), 3, "{rig}\n{}", stderr(&output));
            assert!(
                stderr(&output).contains(reason) && stderr(&output).contains("rig.toml"),
                "{}",
                stderr(&output)
            );
            assert!(bench.is_untouched(), "{rig}");
        }
    }
    // Negative control: with a solution, the table is written.
    let bench = Bench::new(&model("[[0, 1], [0, 0]]", "[0, 1]", LQR));
    assert_eq!((status(&bench.design(&[])), bench.is_untouched()), (0, false));
}

#[test]
fn bad_input_ends_with_status_2_and_writes_nothing() {
    let bench = Bench::new("name = \"x\"\n[cart]\nmass_kg = -1\n");
    let output = bench.design(&[]);
    assert_eq!(status(&output), 2);
    assert!(stderr(&output).contains("rig.toml:3:") && stderr(&output).contains("cart.mass_kg"));
    assert!(stdout(&output).is_empty() && bench.is_untouched());

    let single = path_of(SINGLE);
    for arguments in [
        &["design", "/no/such/rig.toml"][..],
        &["design", &single, "--no-write", "--check"],
        &["simulate", &single, "--tilt", "0.1,0.1"],
        &["simulate", &single, "--start", "1,2"],
        &["simulate", &single, "--duration", "0"],
        &["simulate", &single, "--duration", "1e9"],
        &["simulate", &single, "--tick", "100"],
        &["frobnicate"],
    ] {
        let output = upright(arguments);
        assert_eq!(status(&output), 2, "{arguments:?}: {}", stderr(&output));
        assert!(stdout(&output).is_empty() && !stderr(&output).is_empty());
    }
}

#[test]
fn a_table_that_cannot_be_written_ends_with_status_2_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    for out in [folder.path().join("missing/gains.rs"), folder.path().to_owned()] {
        let output = upright(&["design", &path_of(SINGLE), "--out", out.to_str().unwrap()]);
        assert_eq!(status(&output), 2);
        assert!(stderr(&output).contains(out.to_str().unwrap()), "{}", stderr(&output));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn the_same_rig_gives_the_same_table_to_the_byte_and_check_tells_any_other() {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str| {
        let out = folder.path().join(name);
        let output = upright(&["design", &path_of(SINGLE), "--out", out.to_str().unwrap()]);
        assert_eq!(status(&output), 0, "{}", stderr(&output));
        (out.clone(), std::fs::read(&out).unwrap())
    };
    let ((first, bytes), (_, again)) = (written("first.rs"), written("again.rs"));
    assert_eq!(bytes, again);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "no temporary file is left");

    let check = |path: &Path| {
        let before = std::fs::read(path).ok();
        let output = upright(&["design", &path_of(SINGLE), "--check", "--out", path.to_str().unwrap()]);
        assert_eq!(std::fs::read(path).ok(), before, "--check writes nothing");
        (status(&output), stderr(&output).to_owned())
    };
    assert_eq!(check(&first).0, 0);
    for at in [4, bytes.len() / 2, bytes.len() - 3] {
        let mut changed = bytes.clone();
        changed[at] ^= 1;
        std::fs::write(&first, &changed).unwrap();
        let (status, message) = check(&first);
        let line = 1 + bytes[..at].iter().filter(|&&byte| byte == b'\n').count();
        assert_eq!(status, 1);
        assert!(message.contains(&format!("first.rs:{line}:")), "{message}");
    }
    assert_eq!(check(&folder.path().join("none.rs")).0, 1);
}

/// A table in tests/fixtures/.
fn fixture(name: &str) -> PathBuf {
    upright_test_support::repository().join("tests/fixtures").join(name)
}

#[test]
fn check_names_the_format_the_rig_and_the_tick_of_a_table_that_has_another() {
    let told = |table: &str| {
        let path = fixture(table);
        let output = upright(&["design", &path_of(SINGLE), "--check", "--out", path.to_str().unwrap()]);
        assert_eq!(status(&output), 1, "{table}");
        stderr(&output).to_owned()
    };
    let format = format!("format 7, not {}", upright::table::TABLE_FORMAT);
    assert!(told("older-format.gains").contains(&format));
    let rig = told("another-rig.gains");
    assert!(
        rig.contains("rig \"double-quanser-dbpen\", not \"single-quanser-ip02\"; tick (s) 0.001, not 0.002"),
        "{rig}"
    );
    let tick = told("another-tick.gains");
    assert!(tick.contains("(tick (s) 0.001, not 0.002; rig hash 0x"), "{tick}");
}

/// The compiler reads the table; the tool is not needed for this error.
#[test]
fn a_table_of_an_older_format_does_not_compile_and_the_error_says_what_to_do() {
    let compiled = |table: &str| {
        let path = fixture(table);
        let arguments = "check --quiet --offline --package upright --lib --features image";
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(arguments.split(' '));
        output(cargo.current_dir(upright_test_support::repository()).env("UPRIGHT_GAINS", path))
    };
    let refused = compiled("older-format.gains");
    assert!(stderr(&refused).contains("this gain table has format 7"), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("upright design RIG"), "{}", stderr(&refused));
    // Control: a table of today's format compiles.
    let taken = compiled("another-rig.gains");
    assert!(taken.status.success(), "{}", stderr(&taken));
}

/// Dimensions of a matrix in the JSON.
fn shape(value: &Value) -> (usize, usize) {
    let rows = value.as_array().unwrap();
    let width = |row: &Value| row.as_array().unwrap().iter().filter(|entry| entry.is_f64()).count();
    assert!(rows.iter().all(|row| width(row) == width(&rows[0])));
    (rows.len(), width(&rows[0]))
}

#[test]
fn the_machine_readable_design_has_the_promised_shape() {
    for delay in [0, 1] {
        let text = std::fs::read_to_string(rig_path(SINGLE)).unwrap();
        let bench = Bench::new(&text.replace("delay_ticks = 0", &format!("delay_ticks = {delay}")));
        let output = bench.design(&["--json", "--no-write"]);
        assert!(status(&output) == 0 && bench.is_untouched());
        let design = object(&output);
        assert_eq!(design["rig"], SINGLE);
        assert_eq!((&design["states"], &design["delay_ticks"]), (&4.into(), &delay.into()));
        assert_eq!(design["tick_s"], 0.002);
        assert!(design["hash"].as_str().is_some_and(|hash| hash.len() == 16));
        let shapes = [
            &design["plant"]["A"],
            &design["plant"]["B"],
            &design["sampled"]["Ad"],
            &design["sampled"]["Bd"],
        ];
        assert_eq!(shapes.map(shape), [(4, 4), (4, 1), (4, 4), (4, 1)]);
        for law in ["lqr", "pole_placement"] {
            for (plane, width) in [("continuous", 4), ("sampled", 4 + delay)] {
                let law = &design[plane][law];
                assert_eq!(shape(&law["K"]), (1, width));
                assert_eq!(shape(&law["poles"]), (width, 2));
                assert!(law["N"].is_f64());
            }
            assert_eq!(design["table"][law]["k"].as_array().unwrap().len(), 4);
        }
    }
}

#[test]
fn numbers_are_shortest_decimals_and_an_absent_design_is_null() {
    let bench = Bench::new(&model("[[0, 1], [0, 0]]", "[0, 1]", LQR));
    let output = bench.design(&["--json", "--no-write"]);
    let design = object(&output);
    for plane in ["continuous", "sampled"] {
        assert!(design[plane]["pole_placement"].is_null() && design[plane]["lqr"].is_object());
    }
    assert!(design["table"]["pole_placement"].is_null());
    // √3, as Rust prints the nearest double.
    assert!(stdout(&output).contains(&format!("\"K\":[[1.0,{}]]", 3f64.sqrt())), "{}", stdout(&output));
}

#[test]
fn a_design_that_falls_ends_with_status_1_whether_it_would_be_written_or_not() {
    let text = std::fs::read_to_string(rig_path(SINGLE)).unwrap();
    let weak = Bench::new(&text.replace("force_limit_n = 13.0", "force_limit_n = 1e-9"));
    let sound = Bench::new(&text);
    for arguments in [&[][..], &["--no-write"], &["--no-write", "--json"], &["--check"]] {
        let output = weak.design(arguments);
        assert_eq!(status(&output), 1, "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("fell at"), "{arguments:?}: {}", stderr(&output));
        assert!(!stdout(&output).is_empty() && weak.is_untouched());
    }
    assert_eq!(status(&sound.design(&["--no-write"])), 0);
}

#[test]
fn a_model_has_no_newtons_metres_or_nonlinear_plant() {
    let bench = Bench::new(&model("[[0, 1], [0, 0]]", "[0, 1]", LQR));
    let rig = bench.path("rig.toml");
    let rig = rig.to_str().unwrap();
    let is_of_a_chain = |text: &str| {
        let words = ["nonlinear", "force ", " N (", " N,", " N)", " m\n", " mm", "mrad"];
        words.iter().any(|word| text.contains(word))
    };
    for arguments in [&["design", rig, "--no-write"][..], &["simulate", rig], &["verify", rig]] {
        let output = upright(arguments);
        assert_eq!(status(&output), 0, "{arguments:?}: {}", stderr(&output));
        assert!(!is_of_a_chain(stdout(&output)), "{arguments:?}:\n{}", stdout(&output));
    }
    assert!(is_of_a_chain(stdout(&upright(&["design", &path_of(SINGLE), "--no-write"]))));
}

#[test]
fn json_stays_alone_on_stdout_when_the_table_is_written_or_differs() {
    let bench = Bench::new(&model("[[0, 1], [0, 0]]", "[0, 1]", LQR));
    let output = bench.design(&["--json", "--check"]);
    assert_eq!((status(&output), object(&output)["rig"].as_str()), (1, Some("model")));
    let output = bench.design(&["--json"]);
    assert_eq!((status(&output), object(&output)["rig"].as_str()), (0, Some("model")));
    assert!(stderr(&output).contains("wrote"));
}

#[test]
fn a_fall_ends_with_status_1_and_says_what_fell() {
    let paper = path_of("quadruple-paper");
    let arguments = [
        "simulate",
        &paper,
        "--tick",
        "0.005",
        "--gains",
        "continuous",
        "--tilt",
        "0.001",
        "--sensing",
        "full-state",
        "--json",
    ];
    let output = upright(&arguments);
    let summary = object(&output);
    assert_eq!((status(&output), &summary["survives"]), (1, &false.into()));
    let link = summary["fall"]["kind"]["link"].as_u64().unwrap();
    assert!(stderr(&output).contains(&format!("link {link} fell")));
    // With gains designed for the tick, the same run balances.
    let output = upright(&[&arguments[..4], &arguments[6..]].concat());
    assert_eq!((status(&output), &object(&output)["settled"]), (0, &true.into()));
}

#[test]
fn the_example_that_the_help_says_falls_does_fall() {
    let help = upright(&["simulate", "--help"]);
    let example = stdout(&help).lines().find_map(|line| line.trim().strip_suffix("falls")).unwrap().trim();
    let arguments: Vec<&str> = example.split_whitespace().skip(1).collect();
    let output = output(
        Command::new(env!("CARGO_BIN_EXE_upright"))
            .args(&arguments)
            .current_dir(rig_path(SINGLE).parent().unwrap().parent().unwrap()),
    );
    assert_eq!(status(&output), 1, "{example}: {}", stdout(&output));
}

#[test]
fn the_record_of_a_run_names_units_and_has_a_line_per_tick() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.csv");
    let arguments = ["simulate", &path_of(SINGLE), "--tilt", "0.01", "--duration", "0.1", "--csv"];
    let to_file = upright(&[&arguments[..], &[file.to_str().unwrap()]].concat());
    let to_stdout = upright(&[&arguments[..], &["-"]].concat());
    assert_eq!((status(&to_file), status(&to_stdout)), (0, 0));
    let csv = std::fs::read_to_string(&file).unwrap();
    assert_eq!(csv, stdout(&to_stdout), "nothing but the record on stdout");
    let mut lines = csv.lines();
    assert_eq!(
        lines.next(),
        Some(
            "t_s,target_m,setpoint_m,force_requested_n,force_n,x_m,xdot_m_per_s,theta1_rad,theta1dot_rad_per_s,\
             x_m_estimated,xdot_m_per_s_estimated,theta1_rad_estimated,theta1dot_rad_per_s_estimated"
        )
    );
    assert_eq!(lines.clone().count(), 51);
    assert!(lines.all(|line| line.split(',').all(|number| number.parse::<f64>().is_ok())));
}
