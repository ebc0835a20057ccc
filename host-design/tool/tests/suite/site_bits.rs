//! The page's module computes the same bits as this computer, in Node and in the page.
//!
//! Needs Node, Chromium, a compiler for WebAssembly, and minutes to compile, so the tests run only where
//! `UPRIGHT_REQUIRE_WASM=1` is set.

use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use serde_json::{Value, json};
use upright_page::{Desk, TICKS};
use upright_test_support::limits::{PATIENCE, output};
use upright_tool::site::{Example, examples, module};

use crate::equipment::{is_required, not_exercised};
use crate::site_page::{opened, root, until as until_designed};
use crate::twin_page::comes_within;

/// Rigs that the firmware does not run on the host: a model with ten states, of which only the table is compared.
const NO_FIRMWARE: [&str; 1] = ["quadruple-paper-printed"];

/// All rigs of the project, and one whose force and readings are late: name, text, stored motions.
fn rigs() -> Vec<(String, String, Option<String>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    let read = |file: &Path| std::fs::read_to_string(file).ok();
    let name = |file: &Path| file.file_stem().unwrap().to_string_lossy().into_owned();
    let published = files
        .iter()
        .map(|file| (name(file), read(file).unwrap(), read(&file.with_extension("swing-up.json"))));
    published.chain([("late".to_owned(), late_rig(), None)]).collect()
}

/// The text of a rig whose force begins a tick late and lags, and whose sensor is slow.
pub(crate) fn late_rig() -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/single-quanser-ip02.toml");
    let text = std::fs::read_to_string(file).unwrap();
    text.replace("delay_ticks = 0", "delay_ticks = 1")
        .replacen("[actuator]\n", "[actuator]\ndriver_lag_s = 0.004\n", 1)
        .replacen("[[link]]\n", "[[link]]\nsensor_delay_s = 0.002\n", 1)
}

/// Whether the module is wanted here; says so if not.
pub(crate) fn is_wanted(what: &str) -> bool {
    let is_wanted = is_required("UPRIGHT_REQUIRE_WASM");
    if !is_wanted {
        not_exercised(&format!("{what}: set UPRIGHT_REQUIRE_WASM=1"));
    }
    is_wanted
}

/// The answers of the module in Node.
pub(crate) fn in_node(questions: &[Value]) -> Vec<Value> {
    in_node_with_time(questions).0
}

/// The same, and the least processor time of an answer, as text.
pub(crate) fn in_node_with_time(questions: &[Value]) -> (Vec<Value>, String) {
    let folder = tempfile::tempdir().unwrap();
    let (wasm, asked) = (folder.path().join("page.wasm"), folder.path().join("questions.json"));
    std::fs::write(&wasm, module().unwrap()).unwrap();
    std::fs::write(&asked, json!(questions).to_string()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/in_node.mjs");
    let output = output(Command::new("node").arg(script).args([&wasm, &asked]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let answers: Vec<String> = serde_json::from_slice(&output.stdout).unwrap();
    let answers = answers.iter().map(|answer| serde_json::from_str(answer).unwrap()).collect();
    (answers, String::from_utf8_lossy(&output.stderr).into_owned())
}

/// What is asked of all machines, and the answers of this computer.
struct Compared {
    rigs: Vec<(String, String, Option<String>)>,
    /// The table and run of each rig; then three short runs of the first one, with one operation of the second and
    /// third rounded as another compiler might.
    questions: Vec<Value>,
    here: Vec<Value>,
}

/// The same for all tests: it takes as long as the compiler for WebAssembly, and goes on beside it.
fn compared() -> &'static Compared {
    static COMPARED: LazyLock<Compared> = LazyLock::new(|| {
        let rigs = rigs();
        let ask = |(_, toml, motions): &(String, String, Option<String>), rounding: &str, ticks: u32| json!({ "ask": "fingerprint", "toml": toml, "motions": motions, "rounding": rounding, "ticks": ticks });
        let mut questions: Vec<Value> = rigs.iter().map(|rig| ask(rig, "as-written", TICKS)).collect();
        questions
            .extend(["as-written", "fused", "other-order"].map(|rounding| ask(&rigs[0], rounding, 2000)));
        let here = upright_design::parallel::map(0..questions.len(), |number| -> Value {
            // The same question for all of the short runs: on this computer, nothing is planted.
            let number = number.min(rigs.len());
            serde_json::from_str(&Desk::default().answer(&questions[number].to_string())).unwrap()
        });
        Compared { rigs, questions, here }
    });
    &COMPARED
}

impl Compared {
    /// Compares the answers of another machine.
    fn assert_same(&self, there: &[Value]) {
        for ((name, _, motions), (here, there)) in self.rigs.iter().zip(self.here.iter().zip(there)) {
            eprintln!("{name}: {there}");
            assert_eq!(here, there, "{name}");
            if there["run"].is_null() {
                assert!(NO_FIRMWARE.contains(&name.as_str()), "{name}: {there}");
                continue;
            }
            assert!(
                there["ticks"][0].as_u64() > Some(20_000) && there["fault"].is_string(),
                "{name}: {there}"
            );
            let moves = [1, 2].map(|motion| there["ticks"][motion].as_u64() > Some(0));
            assert_eq!(moves, [motions.is_some(); 2], "{name}: {there}");
        }
        // Negative control: with one operation rounded otherwise there, the run differs and the table does not.
        let planted = self.rigs.len();
        assert_eq!(self.here[planted], there[planted]);
        for (here, there) in self.here.iter().zip(there).skip(planted + 1) {
            assert!(there["run"] != here["run"] && there["table"] == here["table"], "{there}");
        }
    }
}

#[test]
fn tables_and_runs_of_all_rigs_have_the_same_bits_in_webassembly() {
    if !is_wanted("WebAssembly against this computer") {
        return;
    }
    let compared = compared();
    compared.assert_same(&in_node(&compared.questions));
}

#[test]
fn tables_and_runs_of_all_rigs_have_the_same_bits_in_the_page() {
    let Some((mut browser, _folder)) = opened() else { return };
    let compared = compared();
    browser.value(&format!(
        "{{ window.found = []; \
         (async () => {{ for (const question of {}) found.push(await upright.ask(question)); }})(); 0; }}",
        json!(compared.questions)
    ));
    let is_done = format!("found.length === {}", compared.questions.len());
    assert!(comes_within(&mut browser, PATIENCE.as_secs_f64(), &is_done), "{}", browser.value("found"));
    compared.assert_same(browser.value("found").as_array().unwrap());

    // Each example is shown, with its run.
    for Example { name, .. } in examples(&root().join("rigs")).unwrap() {
        browser.value(&format!(
            "{{ const example = document.getElementById('example'); example.value = '{name}'; \
             document.getElementById('verdict').textContent = ''; example.dispatchEvent(new Event('change')); }}"
        ));
        until_designed(
            &mut browser,
            &format!(
                "upright.desk.design.rig === '{name}' && document.getElementById('verdict').textContent"
            ),
        );
        let verdict = browser.value("document.getElementById('verdict').textContent");
        let verdict = verdict.as_str().unwrap();
        assert!(verdict.starts_with("survives"), "{name}: {verdict}");
    }
    assert_eq!(browser.errors(), Vec::<String>::new());
}
