//! The page that designs rigs, opened from a disk in a real browser.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set, and needs Chromium or Chrome.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use upright_page::Desk;
use upright_test_support::limits::{PATIENCE, output};
use upright_tool::site::{examples, labs, module, page};

use crate::report_devtools::Browser;
use crate::site_bits::is_wanted;
use crate::twin_page::comes_within;

/// Most bytes that a server sends for the page, compressed.
const COMPRESSED: usize = 1_050_000;
pub(crate) const TELEPHONE: u32 = 390;

pub(crate) fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Waits until the page has computed everything, and an expression is true.
pub(crate) fn until(browser: &mut Browser, expression: &str) {
    let begin = Instant::now();
    while browser.value(&format!("Boolean(!upright.isBusy() && ({expression}))")) != true {
        let told = browser.value("document.getElementById('told').textContent");
        // A script that has stopped computes nothing more.
        assert_eq!(browser.errors(), Vec::<String>::new(), "before {expression}");
        assert!(begin.elapsed() < PATIENCE, "never: {expression}; {told}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

pub(crate) fn type_in(browser: &mut Browser, toml: &str) {
    browser.value(&format!(
        "{{ const text = document.getElementById('toml'); text.value = {}; text.dispatchEvent(new Event('input')); }}",
        json!(toml)
    ));
}

/// What the command line writes into a file.
pub(crate) fn written(arguments: &[&str], option: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("written");
    let written = output(Command::new(env!("CARGO_BIN_EXE_upright")).args(arguments).arg(option).arg(&file));
    assert!(written.status.success(), "{arguments:?}");
    std::fs::read_to_string(file).unwrap()
}

/// The page in a folder, opened; `None` where it cannot be.
pub(crate) fn opened() -> Option<(Browser, tempfile::TempDir)> {
    opened_in(1280)
}

/// The same in a window of this width (CSS pixels).
pub(crate) fn opened_in(width: u32) -> Option<(Browser, tempfile::TempDir)> {
    let what = "the page that designs rigs";
    let mut browser = is_wanted(what).then(|| Browser::for_test_of(what)).flatten()?;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("index.html");
    let (examples, labs) = (examples(&root().join("rigs")), labs(&root().join("lessons")));
    let text = page(&module().unwrap(), &examples.unwrap(), &labs.unwrap());
    std::fs::write(&file, &text).unwrap();
    let compressed = miniz_oxide::deflate::compress_to_vec(text.as_bytes(), 9).len();
    eprintln!("page: {} bytes, {compressed} compressed", text.len());
    assert!(compressed < COMPRESSED, "{compressed} bytes");
    let begin = Instant::now();
    browser.open(&file, width, "light", "screen");
    until(&mut browser, "upright.desk.design && upright.desk.poles");
    eprintln!(
        "page: opened, with gains and poles of a single link, after {:.2} s",
        begin.elapsed().as_secs_f64()
    );
    Some((browser, folder))
}

/// Puts an example on the desk.
pub(crate) fn begin_with(browser: &mut Browser, rig: &str) {
    browser.value(&format!(
        "{{ const example = document.getElementById('example'); example.value = '{rig}'; \
         example.dispatchEvent(new Event('change')); }}"
    ));
    until(browser, &format!("upright.desk.design?.rig === '{rig}' && upright.desk.poles"));
}

#[test]
fn a_rig_is_designed_and_exported_in_the_page_as_on_the_command_line() {
    let Some((mut browser, _folder)) = opened() else { return };
    begin_with(&mut browser, "quadruple-paper");
    let gains = browser.value("document.getElementById('gains').textContent");
    assert!(gains.as_str().unwrap().contains("3.16228  3.68443  −14.6001  −5.75422"), "{gains}");
    let rig = root().join("rigs/quadruple-paper.toml");
    let name = rig.to_str().unwrap();
    assert_eq!(browser.value("upright.exported('table')"), written(&["design", name], "--out"));
    assert_eq!(browser.value("upright.exported('header')"), written(&["export", name], "--c"));
    // The run of the other law, with its header of units.
    browser.value(
        "{ const law = document.getElementById('law'); law.value = 'pole-placement'; \
         law.dispatchEvent(new Event('change')); }",
    );
    let csv = browser.value("upright.exported('csv')");
    let run = |law: &str| {
        let tilt = (0.5 / (180.0 / std::f64::consts::PI)).to_string();
        let run = ["simulate", name, "--law", law, "--duration", "8", "--step", "0.1", "--tilt", &tilt];
        written(&run, "--csv")
    };
    assert!(csv.as_str().unwrap().starts_with("t_s,target_m,setpoint_m,force_requested_n,force_n,x_m,"));
    assert_eq!(csv, run("pole-placement"));
    // Negative control: the run of another law.
    assert_ne!(csv, run("lqr"));
    assert_eq!(browser.errors(), Vec::<String>::new());

    // Negative control: the policy keeps the page from asking anybody.
    browser.value("fetch('data:,hello').catch(() => 0)");
    assert!(browser.errors().iter().any(|error| error.contains("Content Security Policy")));
}

#[test]
fn the_trust_report_of_the_page_is_that_of_this_computer_and_goes_with_its_rig() {
    let Some((mut browser, _folder)) = opened() else { return };
    let single = std::fs::read_to_string(root().join("rigs/single-quanser-ip02.toml")).unwrap();
    type_in(&mut browser, &single);
    until(&mut browser, "upright.desk.design.states === 4 && !document.getElementById('verify').disabled");
    browser.value("document.getElementById('verify').click()");
    let mut desk = Desk::default();
    let (mut here, mut step) = (Value::Null, 0);
    while here["steps"].is_null() || here["step"] != here["steps"] {
        let question = json!({ "ask": "verify", "toml": single, "step": step });
        here = serde_json::from_str(&desk.answer(&question.to_string())).unwrap();
        assert!(here["failed"].is_null(), "{here}");
        step += 1;
    }
    // While it computes, the page is free: another question is answered.
    assert!(browser.value("upright.ask({ ask: 'check', toml: '' })")["failed"].is_object());
    until(&mut browser, "!document.getElementById('verify').disabled");
    assert_eq!(browser.value("upright.trusted()"), here["laws"]);
    let shown = browser.value("document.getElementById('trust-rows').children.length");
    assert_eq!(shown, here["laws"][0]["rows"].as_array().unwrap().len());
    // Negative control: what was found is not shown with another rig.
    type_in(&mut browser, &single.replace("mass_kg", "mass_kg "));
    until(&mut browser, "document.getElementById('trust-rows').children.length === 0");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn an_answer_to_an_exercise_is_marked_in_the_page() {
    let Some((mut browser, _folder)) = opened() else { return };
    browser.value("document.querySelectorAll('#lesson-list button')[1].click()");
    until(&mut browser, "upright.desk.design.states === 4 && !document.getElementById('lesson').hidden");
    let mut mark = |answer: &str, said: &str| {
        browser.value(&format!(
            "{{ document.getElementById('answer').value = '{answer}'; document.getElementById('mark').click(); }}"
        ));
        until(&mut browser, &format!("document.getElementById('marked').textContent.startsWith('{said}')"));
    };
    // Negative control: wrong gains, and too few.
    mark("0 0 150 0", "Not yet");
    mark("1 2", "give 4 numbers");
    mark("-40 -45 150 27", "Right");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_rig_is_typed_corrected_changed_and_sent_as_a_link() {
    let Some((mut browser, _folder)) = opened() else { return };
    begin_with(&mut browser, "quadruple-paper");
    let toml = std::fs::read_to_string(root().join("rigs/quadruple-paper.toml")).unwrap();
    let wrong = toml.replace("force_weight", "force_wait");
    let line = wrong.lines().position(|line| line.starts_with("force_wait")).unwrap() + 1;
    type_in(&mut browser, &wrong);
    until(&mut browser, "!document.getElementById('problem').hidden");
    let problem = browser.value("document.getElementById('problem').textContent");
    assert!(problem.as_str().unwrap().starts_with(&format!("line {line}: ")), "{problem}");
    assert_eq!(browser.value("document.querySelector('#lines b').textContent"), line.to_string());
    type_in(&mut browser, &toml.replace("force_weight = 1\n", "force_weight = 4\n"));
    let first_gain = "upright.desk.design.laws[0].continuous.k[0]";
    until(&mut browser, &format!("document.getElementById('problem').hidden && {first_gain} < 2"));

    // A page that is loaded again has the rig as it was; with reduced motion, nothing nudges it.
    until(&mut browser, "upright.live().nudges > 0");
    browser.reduces_motion = true;
    let address = browser.value("location.href");
    browser.open_address(address.as_str().unwrap(), 1280, "light", "screen");
    until(&mut browser, &format!("upright.desk.design && upright.desk.poles && {first_gain} < 2"));
    assert!(comes_within(&mut browser, 20.0, "upright.live().latest?.state === 'Balancing'"));
    assert!(!comes_within(&mut browser, 6.0, "upright.live().nudges > 0"));

    // A weight that is moved changes text and gains.
    browser.value(
        "{ const weight = document.getElementById('weight-lqr.force_weight'); weight.value = 0; \
         weight.dispatchEvent(new Event('input')); }",
    );
    until(&mut browser, &format!("Math.abs({first_gain} - 3.16228) < 1e-5"));
    assert_eq!(browser.value("document.getElementById('toml').value"), toml);

    // The address holds the rig, behind the mark that is never sent; the page also fits on a telephone.
    browser.value("document.getElementById('link').click()");
    let address = browser.value("location.href");
    assert!(address.as_str().unwrap().contains("#rig="));
    assert_eq!(browser.errors(), Vec::<String>::new());
    browser.open_address("about:blank", TELEPHONE, "dark", "screen");
    browser.open_address(address.as_str().unwrap(), TELEPHONE, "dark", "screen");
    until(&mut browser, "upright.desk.design");
    assert_eq!(browser.value("document.getElementById('toml').value"), toml);
    let width = browser.value("document.documentElement.scrollWidth").as_u64();
    assert!(width.is_some_and(|width| width <= u64::from(TELEPHONE)), "it scrolls sideways: {width:?}");
    assert_eq!(browser.errors(), Vec::<String>::new());
}
