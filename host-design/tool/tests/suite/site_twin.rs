//! Balancing in the page: the twin with the firmware itself, in Node and in a real browser, against this computer.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set.

use serde_json::{Value, json};
use upright_page::twin::InPage;

use crate::report_devtools::Browser;
use crate::site_bits::{in_node, is_wanted, late_rig};
use crate::site_page::{begin_with, opened, root, type_in, until as until_designed};
use crate::twin_page::{
    FASTEST, MACHINE, STATE, catch_and_calibrate, click, let_pass, pull, set_speed, until, until_done,
    until_state,
};

const FRAME: &str = "#twin iframe";

fn read(file: &str) -> String {
    std::fs::read_to_string(root().join("rigs").join(file)).unwrap()
}

/// What a person does: pulls the raised rig towards `x`, lowers it, raises it, and breaks an encoder.
fn script(x: f64) -> Vec<Value> {
    let motions = json!(read("single-quanser-ip02.swing-up.json"));
    script_of(&read("single-quanser-ip02.toml"), &motions, x)
}

fn script_of(toml: &str, motions: &Value, x: f64) -> Vec<Value> {
    let start =
        json!({ "twin": "start", "toml": toml, "motions": motions, "upright": true, "since_1970_s": 1.7e9 });
    let run = |asked: &[Value], pictures: usize| -> Vec<Value> {
        let picture = |number: usize| {
            let asked = if number == 0 { asked } else { &[] };
            json!({ "twin": "run", "asked": asked, "passed_s": 0.02, "most_ticks": 1000, "is_silent": false })
        };
        (0..pictures).map(picture).collect()
    };
    let machine = |what: Value| json!({ "ask": "machine", "what": what });
    let say = |line: &str| json!({ "ask": "say", "line": line });
    [
        vec![start],
        run(&[machine(json!({ "do": "pull", "body": 1, "along": 1.0, "x": x, "y": 0.3 }))], 10),
        run(&[machine(json!({ "do": "let-go" }))], 100),
        run(&[say("down")], 300),
        run(&[say("up")], 300),
        run(&[machine(json!({ "do": "defect", "name": "encoder-wire-open", "sensor": 1 }))], 50),
    ]
    .concat()
}

fn here(script: &[Value]) -> Vec<Value> {
    let mut twin = InPage::default();
    script.iter().map(|question| serde_json::from_str(&twin.answer(&question.to_string())).unwrap()).collect()
}

/// The states of the firmware in turn, and the last fault.
fn history(answers: &[Value]) -> (Vec<String>, Value) {
    let pictures = answers.iter().filter_map(|answer| answer["picture"]["telemetry"].as_array());
    let mut states: Vec<String> =
        pictures.flatten().map(|telemetry| telemetry["state"].as_str().unwrap().to_owned()).collect();
    states.dedup();
    (states, answers.last().unwrap()["picture"]["fault"]["name"].clone())
}

#[test]
fn a_rig_balanced_in_webassembly_has_the_telemetry_and_motion_of_this_computer_bit_by_bit() {
    if !is_wanted("the twin in WebAssembly") {
        return;
    }
    let asked = script(0.02);
    let (here, there) = (here(&asked), in_node(&asked));
    let (states, fault) = history(&here);
    eprintln!("{states:?}, {fault}");
    assert_eq!(
        states,
        ["Balancing", "Lowering", "Calibrated", "Raising", "Balancing", "Fault"],
        "{:?}",
        here.iter().map(|answer| &answer["picture"]["log"]).collect::<Vec<_>>()
    );
    for (number, (here, there)) in here.iter().zip(&there).enumerate() {
        assert!(here["failed"].is_null(), "{here}");
        assert_eq!(here, there, "answer {number}");
    }
    // Negative control: a pull that differs in the last bit is noticed.
    let other = in_node(&script(0.02f64.next_up()));
    assert_eq!(other[0], there[0]);
    assert_ne!(other[1..], there[1..]);
}

#[test]
fn a_late_force_and_old_readings_are_made_up_for_in_webassembly_with_the_bits_of_this_computer() {
    if !is_wanted("a late rig in WebAssembly") {
        return;
    }
    let script = |toml: &str| script_of(toml, &Value::Null, 0.02);
    let asked = script(&late_rig());
    let (here, there) = (here(&asked), in_node(&asked));
    assert_eq!(history(&here).0, ["Balancing", "Fault"]);
    assert_eq!(here, there);
    // Negative control: the lag of the table is another one in the last bit.
    let other = in_node(&script(&late_rig().replace("0.004", "0.004000000000000001")));
    assert!(there.last() != other.last() && other.iter().all(|answer| answer["failed"].is_null()));
}

/// Switches the designed rig on: raised, or hanging.
pub(crate) fn balance(browser: &mut Browser, raised: bool) {
    browser.inside = None;
    browser.value(&format!("document.getElementById('raised').checked = {raised}"));
    until_designed(browser, "!document.getElementById('balance').disabled");
    click(browser, "#balance");
    until(browser, &format!("document.querySelector('{FRAME}')?.contentWindow?.upright?.seen?.picture"));
    browser.inside = Some(FRAME);
}

/// The first row of a recording that is not what the scopes draw at its tick; its header names quantities and units.
fn unlike(csv: &str, drawn: &[Value]) -> Option<String> {
    let mut rows = csv.lines();
    let names = rows.next().unwrap();
    assert!(names.starts_with("tick,state,fault,setpoint_m,requested_n,applied_n,drive,cycles,"), "{names}");
    let mut names = names.split(',').skip(8);
    assert_eq!(
        names.by_ref().take(5).collect::<Vec<_>>(),
        ["count0", "count1", "count2", "count3", "count4"]
    );
    assert_eq!(names.by_ref().take(10).last(), Some("estimate9"));
    let is_drawn = |row: &&str| {
        let cells: Vec<&str> = row.split(',').collect();
        let tick: u64 = cells[0].parse().unwrap();
        let Some(telemetry) = drawn.iter().find(|telemetry| telemetry["tick"] == tick) else { return false };
        let numbers = |name: &str| telemetry[name].as_array().unwrap().clone();
        let scalars = ["setpoint_m", "requested_n", "applied_n", "drive"].map(|name| telemetry[name].clone());
        let lists = [numbers("counts"), numbers("estimate"), numbers("innovation")].concat();
        let told = scalars.iter().chain(&lists).map(|value| value.as_f64().unwrap() as f32);
        let written = cells[3..7].iter().chain(&cells[8..]).map(|cell| cell.parse().unwrap_or(f32::NAN));
        telemetry["state"] == cells[1] && told.eq(written)
    };
    rows.find(|row| !is_drawn(row)).map(str::to_owned)
}

#[test]
fn the_papers_rig_is_balanced_pulled_broken_and_put_back_in_the_page() {
    let Some((mut browser, _folder)) = opened() else { return };
    begin_with(&mut browser, "quadruple-paper");
    balance(&mut browser, true);
    until_state(&mut browser, "Balancing");
    let_pass(&mut browser, 1.0);
    // Four links survive little: the cart is pulled.
    let pulled = pull(&mut browser, 0, 6.0, 0.4);
    assert_eq!(pulled["body"], 0, "{pulled}");
    let_pass(&mut browser, 3.0);
    assert_eq!(browser.value(STATE), "Balancing", "{}", browser.value("upright.seen.picture.fault"));

    // Which fault it is depends on the moment: the defect has to end with the motor off, with any fault.
    browser.value("{ document.getElementById('sensor').value = 2; }");
    click(&mut browser, "[data-defect=encoder-wire-open]");
    until_state(&mut browser, "Fault");
    let fault = browser.value("upright.seen.picture.fault");
    assert!(
        ["encoder", "frozen encoder", "motor", "angle"].map(Value::from).contains(&fault["name"]),
        "{fault}"
    );

    // Put back, and recorded.
    click(&mut browser, "[data-restart=upright]");
    until_state(&mut browser, "Balancing");
    browser.value(
        "{ window.made = []; URL.createObjectURL = (blob) => { window.made.push(blob); return 'blob:x'; }; \
         window.drawn = []; const scopes = upright.scopes(); const push = scopes.push.bind(scopes); \
         scopes.push = (telemetry, machine) => { drawn.push(telemetry); push(telemetry, machine); }; }",
    );
    click(&mut browser, "#record");
    until(&mut browser, "upright.seen.picture.recording");
    let_pass(&mut browser, 1.0);
    click(&mut browser, "#record");
    until(&mut browser, "window.made.length === 1");
    let csv = browser.value("window.made[0].text()");
    let (csv, drawn) = (csv.as_str().unwrap(), browser.value("drawn"));
    assert!(csv.lines().count() > 100, "{csv}");
    assert_eq!(unlike(csv, drawn.as_array().unwrap()), None);
    // Negative control: another set-point in one row.
    let (rows, last) = csv.trim_end().rsplit_once('\n').unwrap();
    let other = last.replacen(",,", ",,1", 1);
    assert_ne!(last, other);
    assert!(unlike(&format!("{rows}\n{other}\n"), drawn.as_array().unwrap()).is_some());
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_hanging_single_is_homed_checked_jogged_and_raised_in_the_page_with_keys_alone() {
    let Some((mut browser, _folder)) = opened() else { return };
    type_in(&mut browser, &read("single-quanser-ip02.toml"));
    until_designed(&mut browser, "upright.desk.design?.states === 4");
    // The stored motions come out of the page as they went in.
    let motions = browser.value("upright.motions()");
    let stored: Value = serde_json::from_str(&read("single-quanser-ip02.swing-up.json")).unwrap();
    assert_eq!(
        serde_json::from_str::<Value>(motions.as_str().unwrap()).unwrap().to_string(),
        stored.to_string()
    );
    balance(&mut browser, false);
    until_state(&mut browser, "Disarmed");
    catch_and_calibrate(&mut browser);
    browser.key("f");
    set_speed(&mut browser, FASTEST);
    until_done(&mut browser, "w", &format!("({STATE}) === 'Raising' || ({STATE}) === 'Balancing'"));
    until_state(&mut browser, "Balancing");
    let_pass(&mut browser, 1.0);
    assert_eq!(browser.value(STATE), "Balancing");
    let upright = browser.value(&format!("Math.abs({MACHINE}.state[2])"));
    assert!(upright.as_f64().is_some_and(|angle| angle < 0.05), "{upright}");
    set_speed(&mut browser, 1.0);
    let pulled = pull(&mut browser, 1, 4.0, 0.4);
    assert_eq!(pulled["body"], 1, "{pulled}");
    let_pass(&mut browser, 2.0);
    assert_eq!(browser.value(STATE), "Balancing");
    browser.key("Escape");
    until(&mut browser, &format!("({STATE}) !== 'Balancing'"));
    browser.inside = None;
    click(&mut browser, "#close");
    assert_eq!(browser.value("document.querySelector('main').hidden"), false);
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_page_that_is_loaded_again_goes_on_with_its_run_and_scopes() {
    let Some((mut browser, _folder)) = opened() else { return };
    type_in(&mut browser, &read("single-quanser-ip02.toml"));
    until_designed(&mut browser, "upright.desk.design?.states === 4");
    balance(&mut browser, true);
    until_state(&mut browser, "Balancing");
    // Something that only this run knows.
    browser.value(
        "{ const input = document.querySelector('input[name=\"mass\"]'); input.value = 7; \
         input.dispatchEvent(new Event('input')); }",
    );
    until(&mut browser, &format!("{MACHINE}.properties.mass === 7"));
    let_pass(&mut browser, 4.0);
    let mut again = |prepare: &str| -> [f64; 3] {
        browser.inside = None;
        browser.value(&format!("addEventListener('pagehide', () => {{ {prepare} }})"));
        let address = browser.value("location.href");
        let t_s = browser
            .value("document.querySelector('#twin iframe').contentWindow.upright.seen.picture.machine.t_s");
        browser.open_address(address.as_str().unwrap(), 1280, "light", "screen");
        until(
            &mut browser,
            &format!("document.querySelector('{FRAME}')?.contentWindow?.upright?.seen?.picture"),
        );
        browser.inside = Some(FRAME);
        until_state(&mut browser, "Balancing");
        let now = browser
            .value(&format!("[{MACHINE}.t_s, {MACHINE}.properties.mass, upright.scopes().history.length]"));
        assert_eq!(browser.errors(), Vec::<String>::new());
        let [now_s, mass, messages]: [f64; 3] = serde_json::from_value(now).unwrap();
        [now_s - t_s.as_f64().unwrap(), mass, messages]
    };
    let [later_s, mass, messages] = again("");
    assert!(
        later_s > -2.0 && mass == 7.0 && messages > 500.0,
        "{later_s} s later, {mass} %, {messages} messages"
    );
    // Negative control: what was kept of another module or rig is not put into this one.
    let other = "const kept = JSON.parse(sessionStorage.getItem('upright run')); kept.kept.sum += 1; \
                 sessionStorage.setItem('upright run', JSON.stringify(kept));";
    let [later_s, mass, _] = again(other);
    assert!(later_s < -2.0 && mass == 0.0, "{later_s} s later, {mass} %");
}
