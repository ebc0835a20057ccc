//! The twin's page in a real browser, with real pointer and key events.
//!
//! Needs Chromium or Chrome. Without one the tests say so and pass, unless `UPRIGHT_REQUIRE_BROWSER=1` is set.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use upright::table::Law;
use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_test_support::limits::{Lines, PATIENCE, Running};
use upright_trust::verify::linear;

use crate::report_devtools::Browser;

const TELEPHONE: u32 = 390;
pub(crate) const STATE: &str = "document.getElementById('state').dataset.state ?? ''";
/// Fastest speed that the page offers (simulated seconds per second).
pub(crate) const FASTEST: f64 = 10.0;
pub(crate) const MACHINE: &str = "upright.seen.picture.machine";

/// A running twin. Dropping it ends it.
pub(crate) struct Twin {
    process: Running,
    /// Address of the page.
    pub(crate) address: String,
}

impl Twin {
    pub(crate) fn start(rig: &str, options: &[&str]) -> Self {
        let process = Command::new(env!("CARGO_BIN_EXE_upright"))
            .arg("twin")
            .arg(format!("{}/../../rigs/{rig}.toml", env!("CARGO_MANIFEST_DIR")))
            .args(options)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut process = Running(process);
        let address = Lines::from_pipe(process.stdout.take().unwrap()).next("the address of the twin");
        Self { process, address }
    }
}

fn browser() -> Option<Browser> {
    Browser::for_test_of("the twin")
}

pub(crate) fn wait(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}

/// Waits for at most `seconds` until an expression is true; returns whether it is.
pub(crate) fn comes_within(browser: &mut Browser, seconds: f64, expression: &str) -> bool {
    let begin = Instant::now();
    while browser.value(&format!("Boolean({expression})")) != true {
        if begin.elapsed().as_secs_f64() > seconds {
            return false;
        }
        wait(0.05);
    }
    true
}

/// Waits until an expression is true.
pub(crate) fn until(browser: &mut Browser, expression: &str) {
    let is_there = comes_within(browser, PATIENCE.as_secs_f64(), expression);
    assert!(is_there, "never: {expression}; state {}", browser.value(STATE));
}

/// From now on, simulated time runs `factor` times as fast as real time.
pub(crate) fn set_speed(browser: &mut Browser, factor: f64) {
    browser.value(&format!(
        "{{ const speed = document.getElementById('speed'); speed.value = '{factor}'; \
         speed.dispatchEvent(new Event('change')); }}"
    ));
    until(browser, &format!("{MACHINE}.factor === {factor}"));
}

/// Waits until `seconds` of simulated time have passed.
pub(crate) fn let_pass(browser: &mut Browser, seconds: f64) {
    let begin = browser.value(&format!("{MACHINE}.t_s")).as_f64().unwrap();
    until(browser, &format!("{MACHINE}.t_s > {}", begin + seconds));
}

pub(crate) fn until_state(browser: &mut Browser, state: &str) {
    until(browser, &format!("({STATE}) === '{state}'"));
}

/// Where the end of a link is in the window (CSS pixels).
fn end_of(browser: &mut Browser, link: usize) -> [f64; 2] {
    let expression = format!(
        "(() => {{ const view = upright.view(); const box = view.canvas.getBoundingClientRect(); \
         let [x, y, phi] = [view.arc * view.state[0], 0, 0]; \
         for (let k = 0; k < {link}; k += 1) {{ phi += view.state[2 + 2 * k]; \
         x -= view.hello.lengths_m[k] * Math.sin(phi); y += view.hello.lengths_m[k] * Math.cos(phi); }} \
         const [px, py] = view.toScreen([x, y]); \
         const frame = window.frameElement?.getBoundingClientRect() ?? {{ left: 0, top: 0 }}; \
         return [frame.left + box.left + px, frame.top + box.top + py]; }})()"
    );
    let point = browser.value(&expression);
    [0, 1].map(|axis| point[axis].as_f64().unwrap())
}

/// Grabs the end of a link and pulls it sideways for a time, then lets go.
pub(crate) fn pull(browser: &mut Browser, link: usize, by_px: f64, seconds: f64) -> Value {
    let [x, y] = end_of(browser, link);
    browser.mouse("mouseMoved", [x, y - 4.0]);
    browser.mouse("mousePressed", [x, y + 2.0]);
    for step in 1..=5 {
        browser.mouse("mouseMoved", [x + by_px * f64::from(step) / 5.0, y + 2.0]);
    }
    wait(seconds);
    let pulled = browser.value(&format!("{MACHINE}.pull"));
    browser.mouse("mouseReleased", [x + by_px, y + 2.0]);
    pulled
}

pub(crate) fn click(browser: &mut Browser, selector: &str) {
    browser.value(&format!("document.querySelector('{selector}').click()"));
}

fn set(browser: &mut Browser, name: &str, value: f64) {
    browser.value(&format!(
        "{{ const input = document.querySelector('input[name=\"{name}\"]'); input.value = {value}; \
         input.dispatchEvent(new Event('input')); }}"
    ));
    until(browser, &format!("{MACHINE}.properties['{name}'] === {value}"));
}

#[test]
fn a_link_that_is_pulled_comes_back_and_one_that_is_pulled_too_far_is_a_fault_that_can_be_cleared() {
    let Some(mut browser) = browser() else { return };
    let twin = Twin::start("single-quanser-ip02", &[]);
    browser.open_address(&twin.address, 1280, "light", "screen");
    until_state(&mut browser, "Balancing");
    let_pass(&mut browser, 1.0);
    let pulled = pull(&mut browser, 1, 4.0, 0.4);
    assert_eq!(pulled["body"], 1, "{pulled}");
    until(&mut browser, &format!("{MACHINE}.pull === null"));
    set_speed(&mut browser, FASTEST);
    let_pass(&mut browser, 1.5);
    assert_eq!(browser.value(STATE), "Balancing");
    let angle = browser.value(&format!("Math.abs({MACHINE}.state[2])"));
    assert!(angle.as_f64().is_some_and(|angle| angle < 0.05), "{angle}");

    set_speed(&mut browser, 1.0);
    pull(&mut browser, 1, 250.0, 1.0);
    until_state(&mut browser, "Fault");
    let told = browser.value("document.getElementById('fault').textContent");
    assert!(told.as_str().is_some_and(|text| text.contains("Remedy: ")), "{told}");

    // Caught and calibrated by hand, raised and armed with keys alone: a fault of an encoder or of the motor loses the
    // positions and the signs.
    catch_and_calibrate(&mut browser);
    set_speed(&mut browser, FASTEST);
    browser.key("u");
    until(&mut browser, &format!("Math.abs(Math.sin({MACHINE}.state[2] / 2)) < 1e-9"));
    until_done(&mut browser, "a", &format!("({STATE}) === 'Armed' || ({STATE}) === 'Balancing'"));
    until_state(&mut browser, "Balancing");
    browser.key("f");
    until(&mut browser, &format!("{MACHINE}.holding === 'free'"));
    let_pass(&mut browser, 1.0);
    assert_eq!(browser.value(STATE), "Balancing");
    // The emergency key works wherever the focus is.
    click(&mut browser, "[data-tab=controls]");
    browser.value("document.getElementById('setpoint').focus()");
    assert_eq!(browser.value("document.activeElement.id"), "setpoint");
    browser.key("Escape");
    until(&mut browser, &format!("({STATE}) !== 'Balancing'"));
    assert_eq!(browser.errors(), Vec::<String>::new());
}

/// Catches the rig, then homes it and checks the signs of encoders and motor, with keys alone.
pub(crate) fn catch_and_calibrate(browser: &mut Browser) {
    set_speed(browser, FASTEST);
    browser.key("j");
    until(browser, &format!("{MACHINE}.holding === 'hanging'"));
    until(
        browser,
        &format!("Math.abs({MACHINE}.state[0]) < 1e-9 && Math.abs(Math.cos({MACHINE}.state[2]) + 1) < 1e-9"),
    );
    browser.key("c");
    until(browser, &format!("({STATE}) !== 'Fault'"));
    until_done(browser, "h", &format!("({STATE}) === 'Calibrated'"));
    if browser.value("upright.seen.telemetry.against_arming.join().includes('signs')") == true {
        until_done(browser, "g", "upright.seen.telemetry.now !== null");
        browser.key("k");
        until(browser, "!upright.seen.telemetry.against_arming.join().includes('signs')");
    }
    // The page sends a held key again in real time.
    set_speed(browser, 1.0);
    let sign_is_known = "!upright.seen.telemetry.against_arming.join().includes('motor')";
    for _ in 0..10 {
        if browser.value(sign_is_known) == true {
            break;
        }
        // A key that is held until the motor has moved the cart.
        browser.value("document.dispatchEvent(new KeyboardEvent('keydown', { key: 'm' }))");
        comes_within(browser, 1.0, sign_is_known);
        browser.value("document.dispatchEvent(new KeyboardEvent('keyup', { key: 'm' }))");
        comes_within(browser, 0.5, sign_is_known);
    }
}

/// Presses a key every half second until an expression is true, as a person does whose command is refused for now.
pub(crate) fn until_done(browser: &mut Browser, key: &str, expression: &str) {
    for _ in 0..60 {
        if browser.value(&format!("Boolean({expression})")) == true {
            return;
        }
        browser.key(key);
        if comes_within(browser, 0.5, expression) {
            return;
        }
    }
    panic!("never: {expression}; {}", browser.value("document.getElementById('log').textContent"));
}

#[test]
fn a_weaker_motor_makes_the_rig_fall_at_the_gain_margin_that_verify_gives() {
    let Some(mut browser) = browser() else { return };
    let file = format!("{}/../../rigs/quadruple-paper.toml", env!("CARGO_MANIFEST_DIR"));
    let rig = Rig::from_path(Path::new(&file)).unwrap().with_law_alone(Law::Lqr);
    let certified = design(&rig).unwrap();
    let table = TableValues::of(&rig, &certified, Gains::Sampled).unwrap();
    let margin = linear(&rig, &certified, &table).unwrap()[0].margins.as_ref().unwrap().lowest_gain;
    let twin = Twin::start("quadruple-paper", &[]);
    browser.open_address(&twin.address, 1280, "light", "screen");
    until_state(&mut browser, "Balancing");
    // So near to the margin, the rig's usual force noise makes it fall in 1 of 100 runs.
    set(&mut browser, "force-noise", 0.0);
    set_speed(&mut browser, FASTEST);
    set(&mut browser, "force", (120.0 * margin).ceil() - 100.0);
    let_pass(&mut browser, 6.0);
    let fault = browser.value("document.getElementById('fault').textContent");
    assert_eq!(browser.value(STATE), "Balancing", "falls with 1.2 times the force of the margin: {fault}");
    set(&mut browser, "force", (80.0 * margin).floor() - 100.0);
    until_state(&mut browser, "Fault");
}

#[test]
fn the_page_records_draws_its_scopes_and_fits_on_a_telephone() {
    let Some(mut browser) = browser() else { return };
    let twin = Twin::start("double-quanser-dbpen", &[]);
    browser.open_address(&twin.address, TELEPHONE, "dark", "screen");
    until_state(&mut browser, "Balancing");
    let width = browser.value("document.documentElement.scrollWidth").as_u64();
    assert!(width.is_some_and(|width| width <= u64::from(TELEPHONE)), "it scrolls sideways: {width:?}");
    click(&mut browser, "#record");
    until(&mut browser, "upright.seen.picture.recording");
    wait(1.0);
    click(&mut browser, "#record");
    until(&mut browser, "!upright.seen.picture.recording");
    let csv = browser.value("fetch('recording.csv').then((answer) => answer.text())");
    let rows: Vec<&str> = csv.as_str().unwrap().lines().collect();
    assert!(rows[0].starts_with("tick,state") && rows.len() > 100, "{} rows, {}", rows.len(), rows[0]);
    let picture = browser.value("upright.scopes().picture()");
    assert!(picture.as_str().is_some_and(|url| url.starts_with("data:image/png") && url.len() > 5000));
    let dark = browser.value("getComputedStyle(document.body).backgroundColor");
    browser.open_address(&twin.address, 1280, "light", "screen");
    until_state(&mut browser, "Balancing");
    assert_ne!(browser.value("getComputedStyle(document.body).backgroundColor"), dark);
    for factor in [FASTEST, 0.1, 1.0] {
        set_speed(&mut browser, factor);
    }
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_minute_of_running_needs_no_more_memory() {
    let Some(mut browser) = browser() else { return };
    let twin = Twin::start("quadruple-paper", &[]);
    browser.open_address(&twin.address, 640, "light", "screen");
    until_state(&mut browser, "Balancing");
    set_speed(&mut browser, FASTEST);
    // The page keeps more and more until the scopes are full, after 82 s. On a busy machine it may be silent for so
    // long that the motor goes off: it then receives and draws as much.
    for _ in 0..8 {
        let_pass(&mut browser, 20.0);
    }
    let (before, resident) = (browser.objects(), resident_kib(&twin));
    let frames = browser.value("upright.seen.frames").as_f64().unwrap();
    let worked_s = browser.worked_s();
    let_pass(&mut browser, 50.0);
    let frames = browser.value("upright.seen.frames").as_f64().unwrap() - frames;
    let work_ms = 1e3 * (browser.worked_s() - worked_s) / frames;
    let (after, grown) = (browser.objects(), resident_kib(&twin) as f64 / resident as f64);
    eprintln!(
        "{frames} frames, {work_ms:.1} ms of scripts and layout for each; page {before} to {after} objects; server {grown:.3} times"
    );
    // At this speed, the page gets a tenth of the pictures of a minute of real time, with as much telemetry.
    assert!(after < before + MOST_OBJECTS, "the page grows from {before} to {after} objects");
    assert!(grown < 1.02, "the server grows {grown} times");
    assert!(work_ms < 1e3 / 60.0, "scripts and layout take {work_ms} ms for each frame");
    // Negative control: one object kept for each picture of ten seconds.
    browser.value("(globalThis.lost = Array.from({ length: 600 }, (_, index) => ({ index })), 0)");
    assert!(browser.objects() > after + MOST_OBJECTS, "{after}");
}

/// Objects on their way: messages that have arrived, and what is made of them.
const MOST_OBJECTS: f64 = 300.0;

/// Memory of the server without the pages of its file, which the system drops and loads again as it likes (KiB); 1
/// where the system does not tell.
fn resident_kib(twin: &Twin) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", twin.process.id())).unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("RssAnon"));
    line.and_then(|line| line.split_whitespace().nth(1)).and_then(|value| value.parse().ok()).unwrap_or(1)
}
