//! The desk of the page does not lose what a person works on, and says what is wrong where they look.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set, and needs Chromium or Chrome.

use serde_json::json;

use crate::report_devtools::Browser;
use crate::site_page::{TELEPHONE, opened, opened_in, root, type_in, until};
use crate::twin_page::{click, comes_within};

const TEXT: &str = "document.getElementById('toml').value";
const VERDICT: &str = "document.getElementById('verdict')";

fn read(rig: &str) -> String {
    std::fs::read_to_string(root().join(format!("rigs/{rig}.toml"))).unwrap()
}

/// A rig that is no example.
fn own() -> String {
    read("single-quanser-ip02").replace("mass_kg = 0.230", "mass_kg = 0.231")
}

fn address(browser: &mut Browser) -> String {
    browser.value("location.href").as_str().unwrap().to_owned()
}

fn reload(browser: &mut Browser, address: &str) {
    // A page that differs in the part behind the mark alone is not loaded again.
    browser.open_address("about:blank", 1280, "light", "screen");
    browser.open_address(address, 1280, "light", "screen");
    until(browser, "upright.desk.design");
}

/// Waits until what is shown is the design of this text, which is in the editor.
fn designed(browser: &mut Browser, toml: &str) {
    until(browser, &format!("{TEXT} === {} && {VERDICT}.textContent.startsWith('survives')", json!(toml)));
}

#[test]
fn edited_work_outlives_the_link_it_came_from_and_a_damaged_link_stops_nothing() {
    let Some((mut browser, _folder)) = opened() else { return };
    type_in(&mut browser, &own());
    designed(&mut browser, &own());
    click(&mut browser, "#link");
    let link = address(&mut browser);
    assert!(link.contains("#rig="), "{link}");
    // Loaded again, unchanged: the rig of the link. Changed and loaded again: the change.
    reload(&mut browser, &link);
    assert_eq!(browser.value(TEXT), own());
    let edited = own().replace("0.231", "0.232");
    type_in(&mut browser, &edited);
    designed(&mut browser, &edited);
    let now = address(&mut browser);
    assert!(!now.contains('#'), "{now}");
    reload(&mut browser, &now);
    assert_eq!(browser.value(TEXT), edited);

    let (plain, code) = link.split_once("#rig=").unwrap();
    // A link of an older page has no sum. What a person has changed is not replaced before they say so.
    let old = format!("{plain}#rig={}", code.split_once('.').unwrap().1);
    reload(&mut browser, &old);
    assert_eq!(browser.value(TEXT), edited);
    click(&mut browser, "#notice button:nth-of-type(2)");
    assert_eq!((browser.value(TEXT), address(&mut browser)), (json!(edited), plain.to_owned()));
    reload(&mut browser, &old);
    click(&mut browser, "#notice button");
    designed(&mut browser, &own());
    // What is in a link may be no rig.
    browser.open_address("about:blank", 1280, "light", "screen");
    browser.open_address(&format!("{plain}#rig=AAAA"), 1280, "light", "screen");
    until(&mut browser, "!document.getElementById('problem').hidden");
    click(&mut browser, "#undo");
    designed(&mut browser, &own());
    let cut = &link[..link.len() - 40];
    for damaged in [cut.to_owned(), format!("{plain}#rig=%%%"), link.replace("#rig=", "#rig=x")] {
        reload(&mut browser, &damaged);
        let said = browser.value("document.getElementById('notice').textContent");
        assert!(said.as_str().unwrap().contains("link is damaged"), "{damaged}: {said}");
        type_in(&mut browser, &own());
        designed(&mut browser, &own());
        assert_eq!(browser.errors(), Vec::<String>::new());
    }
}

#[test]
fn a_rig_that_an_example_an_exercise_or_a_field_replaces_comes_back_with_undo() {
    let Some((mut browser, folder)) = opened() else { return };
    type_in(&mut browser, &own());
    designed(&mut browser, &own());
    let begin = "{ const example = document.getElementById('example'); example.value = 'double-quanser-dbpen'; \
                 example.dispatchEvent(new Event('change')); }";
    browser.value(begin);
    designed(&mut browser, &read("double-quanser-dbpen"));
    click(&mut browser, "#notice button");
    designed(&mut browser, &own());
    click(&mut browser, "#redo");
    designed(&mut browser, &read("double-quanser-dbpen"));
    click(&mut browser, "#undo");
    designed(&mut browser, &own());
    // An exercise, and the keys; also after the page is loaded again.
    click(&mut browser, "#lesson-list button:nth-child(2)");
    designed(&mut browser, &read("single-quanser-ip02"));
    let page = address(&mut browser);
    reload(&mut browser, &page);
    let undo = "document.getElementById('toml').dispatchEvent(new KeyboardEvent('keydown', \
                { key: 'z', ctrlKey: true, cancelable: true }))";
    assert_eq!(browser.value(undo), false, "the browser's own undo is in the way");
    designed(&mut browser, &own());
    // A field.
    field(&mut browser, "link[1].mass_kg", "0.3");
    designed(&mut browser, &own().replace("0.231", "0.3"));
    click(&mut browser, "#undo");
    designed(&mut browser, &own());
    // A file that is dropped.
    let dropped = read("double-quanser-dbpen");
    browser.value(&format!(
        "{{ const data = new DataTransfer(); data.items.add(new File([{}], 'mine.toml')); \
         document.body.dispatchEvent(new DragEvent('drop', {{ dataTransfer: data, bubbles: true, cancelable: true }})); }}",
        json!(dropped)
    ));
    designed(&mut browser, &dropped);
    click(&mut browser, "#notice button");
    designed(&mut browser, &own());
    // Negative control: an untouched example needs no word.
    browser.value(begin);
    designed(&mut browser, &read("double-quanser-dbpen"));
    browser.value(&begin.replace("double-quanser-dbpen", "single-stepper"));
    designed(&mut browser, &read("single-stepper"));
    assert_eq!(browser.value("document.getElementById('notice').hidden"), true);
    assert_eq!(browser.errors(), Vec::<String>::new());
    drop(folder);
}

/// Writes a value into a field, as a person does.
fn field(browser: &mut Browser, key: &str, value: &str) {
    browser.value(&format!(
        "{{ const input = document.getElementById('field-{key}'); input.value = '{value}'; \
         input.dispatchEvent(new Event('change')); }}"
    ));
}

#[test]
fn after_a_wrong_input_nothing_is_called_good_and_the_reason_is_in_sight() {
    let Some((mut browser, _folder)) = opened() else { return };
    let good = format!("{VERDICT}.className === 'good'");
    until(&mut browser, &good);
    let in_sight =
        format!("(({{ top, bottom }}) => top >= 0 && bottom <= 800)({VERDICT}.getBoundingClientRect())");
    for (value, reason) in [
        ("-1", "mass"),
        ("", "give a number"),
        ("abc", "is no number"),
        ("1e400", "larger than"),
        ("1e9", ""),
    ] {
        field(&mut browser, "link[1].mass_kg", value);
        let is_told =
            format!("{VERDICT}.className !== 'good' && !/^survives( ·|$)/.test({VERDICT}.textContent)");
        until(&mut browser, &is_told);
        if !reason.is_empty() {
            let told = browser.value(&format!(
                "[{VERDICT}, document.getElementById('field-link[1].mass_kg').nextElementSibling].map((e) => e.textContent)"
            ));
            for told in [&told[0], &told[1]] {
                let told = told.as_str().unwrap();
                assert!(
                    told.contains(reason) && !told.contains("quoted") && !told.contains('`'),
                    "{value}: {told}"
                );
            }
            assert_eq!(browser.value("document.getElementById('save-table').disabled"), true);
            assert_eq!(browser.value("document.getElementById('stage').classList.contains('old')"), true);
        }
        assert_eq!(browser.value(&in_sight), true, "{value}");
        field(&mut browser, "link[1].mass_kg", "0.23");
        until(&mut browser, &good);
    }
    // An error in the text.
    type_in(&mut browser, &own().replace("mass_kg", "mas_kg"));
    until(
        &mut browser,
        &format!("{VERDICT}.className === 'bad' && {VERDICT}.textContent.startsWith('line ')"),
    );
    assert_eq!(browser.value(&in_sight), true);
    // What no bench has is said beside the verdict, which is then not green.
    let heavy = own().replace("mass_kg = 0.231", "mass_kg = 3000.0");
    type_in(&mut browser, &heavy);
    until(&mut browser, "document.getElementById('unusual').textContent.includes('link[1].mass_kg')");
    until(&mut browser, &format!("{VERDICT}.textContent !== '' && {VERDICT}.className !== 'good'"));
    // A file that is not typed to its end.
    let (lawless, _) = heavy.split_once("[lqr]").unwrap();
    type_in(&mut browser, lawless);
    until(&mut browser, &format!("{VERDICT}.textContent.includes('asks for no control law')"));
    click(&mut browser, "#keep");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn what_moves_its_verdict_and_the_sliders_are_in_the_first_screen_before_any_figure() {
    for (width, height) in [(TELEPHONE, 844), (1280, 800)] {
        let Some((mut browser, _folder)) = opened_in(width) else { return };
        until(
            &mut browser,
            &format!("/^survives · tilt up to .*° · touch of .* N$/.test({VERDICT}.textContent)"),
        );
        for part in ["rig", "verdict", "dial-length", "dial-weight", "dial-late", "balance"] {
            let bottom =
                browser.value(&format!("document.getElementById('{part}').getBoundingClientRect().bottom"));
            assert!(bottom.as_f64().unwrap() <= f64::from(height), "{width}: {part} ends at {bottom}");
        }
        let before = browser.value(
            "[...document.querySelectorAll('main input, main button, main select, main textarea')].every((control) => \
             document.getElementById('rig').compareDocumentPosition(control) & Node.DOCUMENT_POSITION_FOLLOWING)",
        );
        assert_eq!(before, true, "a form comes before what moves");
        assert_eq!(browser.value("document.getElementById('example').value"), "single-quanser-ip02");
        for tab in 1..=9 {
            click(&mut browser, &format!("#tabs button:nth-child({tab})"));
            let panels = browser.value("document.querySelectorAll('[data-panel]:not([hidden])').length");
            assert_eq!(panels, 1);
            assert_eq!(browser.unnamed_controls(), Vec::<String>::new(), "{tab}");
        }
        click(&mut browser, "#tabs button");
        // Negative control.
        browser.value("document.querySelector('label[for=dial-length]').remove()");
        assert!(comes_within(&mut browser, 1.0, "!document.querySelector('label[for=dial-length]')"));
        assert_eq!(browser.unnamed_controls(), ["\"slider\""]);
        assert_eq!(browser.errors(), Vec::<String>::new());
    }
}

/// Moves a slider of the first view.
fn dial(browser: &mut Browser, name: &str, value: f64) {
    browser.value(&format!(
        "{{ const dial = document.getElementById('dial-{name}'); dial.value = {value}; \
         dial.dispatchEvent(new Event('input')); }}"
    ));
}

#[test]
fn a_slider_designs_the_rig_again_lets_the_new_one_stand_and_says_what_changed() {
    let Some((mut browser, _folder)) = opened() else { return };
    let sentence = format!("{VERDICT}.textContent.includes('touch')");
    until(&mut browser, &sentence);
    let before = browser.value("upright.desk.survival");
    dial(&mut browser, "length", 1.0);
    let stands = "Math.abs(upright.live().hello.lengths_m[0] - 1.28) < 0.01 && upright.live().latest?.state === 'Balancing'";
    assert!(comes_within(&mut browser, 20.0, stands));
    until(&mut browser, &sentence);
    // Twice as long: centre of mass and inertia go with it.
    let text = browser.value(TEXT);
    for line in ["length_m = 1.28", "centre_of_mass_m = 0.659061", "inertia_kg_m2 = 0.0313923"] {
        assert!(text.as_str().unwrap().contains(line), "{line}: {text}");
    }
    let changed = |browser: &mut Browser| {
        let rows = "[...document.querySelectorAll('#changes tr')].map((row) => row.cells[0].textContent)";
        browser.value(rows)
    };
    until(&mut browser, "upright.desk.survival && document.querySelectorAll('#changes tr').length > 2");
    assert_ne!(browser.value("upright.desk.survival"), before);
    assert_eq!(changed(&mut browser)[0], "tilt");
    click(&mut browser, "#undo");
    designed(&mut browser, &read("single-quanser-ip02"));
    until(&mut browser, "upright.desk.survival");
    assert_eq!(browser.value("upright.desk.survival"), before);
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn what_differs_from_the_example_is_listed_and_two_loops_stand_side_by_side() {
    let Some((mut browser, _folder)) = opened() else { return };
    until(&mut browser, "upright.desk.survival");
    click(&mut browser, "#keep");
    dial(&mut browser, "weight", 1.0);
    until(&mut browser, "document.querySelectorAll('#differences tr').length === 2");
    let differs = "document.getElementById('changed').textContent";
    assert_eq!(browser.value(differs), "2 values differ from single-quanser-ip02");
    click(&mut browser, "#changed");
    click(&mut browser, "#differences tr:nth-child(2) button");
    until(&mut browser, "document.querySelectorAll('#differences tr').length === 1");
    assert!(browser.value(TEXT).as_str().unwrap().contains("inertia_kg_m2 = 7.88e-3"));
    click(&mut browser, "[data-tab=run]");
    let columns = "[...document.querySelectorAll('#side-by-side tr')].map((row) => [row.cells[1].textContent, row.cells[2].textContent])";
    until(&mut browser, "upright.desk.survival && document.querySelectorAll('#side-by-side tr').length > 3");
    let columns: Vec<[String; 2]> = serde_json::from_value(browser.value(columns)).unwrap();
    assert!(
        columns[0][0].starts_with("kept") && columns.iter().skip(1).any(|[kept, now]| kept != now),
        "{columns:?}"
    );
    click(&mut browser, "#replay");
    assert!(comes_within(&mut browser, 10.0, "document.querySelectorAll('#together polyline').length === 2"));
    click(&mut browser, "#forget");
    assert_eq!(browser.value("document.getElementById('compared').hidden"), true);
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn links_drive_and_sensors_are_chosen_by_their_pictures() {
    let Some((mut browser, _folder)) = opened() else { return };
    until(&mut browser, "upright.desk.survival");
    let [links, drive, sensors] = [1, 2, 3];
    let choose = |browser: &mut Browser, group: usize, number: usize| {
        click(browser, &format!("#pictures .choice:nth-of-type({group}) button:nth-child({number})"));
        until(browser, &format!("{VERDICT}.textContent.startsWith('survives')"));
    };
    choose(&mut browser, links, 2);
    until(&mut browser, "upright.desk.sketch.lengths_m.length === 2");
    choose(&mut browser, sensors, 2);
    until(&mut browser, "upright.desk.sketch.sensors === 'absolute'");
    choose(&mut browser, links, 1);
    choose(&mut browser, drive, 3);
    until(&mut browser, "upright.desk.sketch.drive === 'stepper'");
    assert!(comes_within(&mut browser, 20.0, "upright.live().hello.input[0] === 'acceleration'"));
    assert_eq!(browser.errors(), Vec::<String>::new());
}
