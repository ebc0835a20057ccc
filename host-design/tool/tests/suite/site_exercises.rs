//! Labs in the page: an answer is marked when a run shows it, what is solved stays solved, and a teacher's lab comes
//! from a file.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set, and needs Chromium or Chrome.

use serde_json::json;
use upright_page::{HandIn, Lab};

use crate::report_devtools::Browser;
use crate::site_page::{opened, root, until};
use crate::site_shown::saved;
use crate::twin_page::{click, comes_within, until as until_in_twin, until_state};

const FRAME: &str = "#twin iframe";
const SAID: &str = "document.getElementById('marked').textContent";

fn answer(browser: &mut Browser, answer: &str, said: &str) {
    browser.inside = None;
    browser.value(&format!(
        "{{ document.getElementById('answer').value = '{answer}'; document.getElementById('mark').click(); }}"
    ));
    let is_said = comes_within(browser, 60.0, &format!("{SAID}.startsWith('{said}')"));
    assert!(is_said, "{answer}: {}", browser.value(SAID));
}

/// Opens the exercise of this number.
fn begin(browser: &mut Browser, number: usize) {
    let button = format!("#lesson-list > button:nth-child({number})");
    click(browser, &button);
    let is_open = format!(
        "((title) => title !== '' && document.querySelector('{button}').textContent.includes(title))\
         (document.getElementById('lesson-title').textContent)"
    );
    until(browser, &is_open);
    until(browser, "!document.getElementById('balance').disabled && upright.desk.design.states === 4");
}

#[test]
fn an_answer_is_marked_when_a_run_shows_it_beside_the_twin_and_stays_solved() {
    let Some((mut browser, _folder)) = opened() else { return };
    begin(&mut browser, 5);
    answer(&mut browser, "1e400", "1e400 is larger than");
    // The right one, guessed.
    answer(&mut browser, "40", "First show it");
    click(&mut browser, "#balance");
    until_in_twin(
        &mut browser,
        &format!("document.querySelector('{FRAME}')?.contentWindow?.upright?.seen?.picture"),
    );
    for part in ["answer", "mark"] {
        let shown = format!(
            "(({{ top, bottom, height }}) => height > 10 && top >= 0 && bottom < 844)\
             (document.getElementById('{part}').getBoundingClientRect())"
        );
        assert_eq!(browser.value(&shown), true, "{part} is hidden while the twin is open");
    }
    browser.inside = Some(FRAME);
    until_state(&mut browser, "Balancing");
    browser.value(
        "{ const input = document.querySelector('input[name=\"delay\"]'); input.value = 45; \
         input.dispatchEvent(new Event('input')); }",
    );
    until_state(&mut browser, "Fault");
    // Negative control: this run does not show another answer; and a wrong one gives no hint.
    answer(&mut browser, "20", "First show it");
    answer(&mut browser, "44", "Not yet");
    let said = browser.value(SAID);
    assert!(!said.as_str().unwrap().contains("motor is turned off"), "{said}");
    answer(&mut browser, "40", "Right");
    click(&mut browser, "#close");

    begin(&mut browser, 8);
    answer(&mut browser, "10", "First show it");
    let page = browser.value("location.href").as_str().unwrap().to_owned();
    browser.open_address(&page, 1280, "light", "screen");
    until(&mut browser, "upright.desk.design");
    let ticked = "[...document.querySelectorAll('#lesson-list button')].map((button) => button.textContent.startsWith('✓'))";
    let solved: Vec<bool> = serde_json::from_value(browser.value(ticked)).unwrap();
    let expected: Vec<bool> = (1..=solved.len()).map(|number| number == 5).collect();
    assert_eq!(solved, expected);
    assert_eq!(browser.errors(), Vec::<String>::new());
}

/// Writes into a field, as a person does.
fn write(browser: &mut Browser, id: &str, value: &str) {
    browser.value(&format!(
        "{{ const field = document.getElementById('{id}'); field.value = '{value}'; \
         field.dispatchEvent(new Event('change')); }}"
    ));
}

#[test]
fn a_lab_that_is_dropped_has_the_students_own_numbers_hints_and_a_file_for_the_teacher() {
    let Some((mut browser, folder)) = opened() else { return };
    write(&mut browser, "student", "Anna");
    write(&mut browser, "seed", "4711");
    let own = std::fs::read_to_string(root().join("lessons/01-why-it-falls.toml")).unwrap();
    let own = own.replace("Why does it fall?", "Mine");
    let drop = |browser: &mut Browser, text: &str| {
        browser.value(&format!(
            "{{ const data = new DataTransfer(); data.items.add(new File([{}], 'mine.toml')); \
             document.body.dispatchEvent(new DragEvent('drop', {{ dataTransfer: data, bubbles: true, cancelable: true }})); }}",
            json!(text)
        ));
    };
    // Negative control: a file that is nearly a lab.
    drop(&mut browser, &own.replace("goals =", "gaols ="));
    let notice = "document.getElementById('notice').textContent";
    assert!(comes_within(&mut browser, 20.0, &format!("{notice}.includes('a lab has a text in')")));
    drop(&mut browser, &own);
    until(&mut browser, "document.getElementById('lesson-title').textContent === 'Mine'");
    until(&mut browser, "upright.desk.sketch.rig === 'single-stepper'");
    let length =
        browser.value("Number(document.getElementById('field-link[1].length_m').value)").as_f64().unwrap();
    assert!((length - 0.5).abs() > 0.005 && (length - 0.5).abs() <= 0.1, "{length}");
    click(&mut browser, "#hint");
    assert_eq!(browser.value("document.getElementById('hints').children.length"), 1);
    answer(&mut browser, "4.43", "Not yet");
    answer(&mut browser, &format!("{:.3}", (1.5 * 9.81 / length).sqrt()), "Right");
    click(&mut browser, "#step-after");
    click(&mut browser, "#mark");
    assert!(comes_within(&mut browser, 60.0, &format!("{SAID}.startsWith('Not yet')")));

    browser.save_into(folder.path());
    click(&mut browser, "#hand-in");
    let handed_in = HandIn::parse(&saved(&folder.path().join("Anna.json"))).unwrap();
    let rig = std::fs::read_to_string(root().join("rigs/single-stepper.toml")).unwrap();
    let marked = handed_in.marked_again(&Lab::parse(&own).unwrap(), &rig).unwrap();
    assert_eq!(marked.iter().map(|(is_right, _)| *is_right).collect::<Vec<_>>(), [true, false], "{marked:?}");
    assert_eq!((handed_in.steps[0].tries, handed_in.steps[0].hints), (2, 1));
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn gains_of_a_persons_own_run_under_the_supervisor_and_are_not_exported() {
    let Some((mut browser, _folder)) = opened() else { return };
    let verdict = "document.getElementById('verdict').textContent";
    let mut own = |gains: &str, wanted: &str| {
        browser.value(&format!(
            "{{ document.getElementById('own').value = '{gains}'; document.getElementById('use-own').click(); }}"
        ));
        until(&mut browser, wanted);
        browser.value("[upright.live().wanted.own, document.getElementById('save-table').disabled]")
    };
    let survives = format!("{verdict}.startsWith('your K survives · tilt')");
    assert_eq!(own("-40 -45 150 27", &survives), json!([[-40, -45, 150, 27], true]));
    // Negative control: a gain of the wrong sign, and too few.
    own("0 0 -150 0", &format!("{verdict} === 'your K: falls'"));
    own("1 2", "document.getElementById('own-said').textContent.startsWith('give 4 numbers')");
    click(&mut browser, "#use-designed");
    until(&mut browser, &format!("{verdict}.startsWith('survives · tilt')"));
    assert_eq!(browser.value("document.getElementById('save-table').disabled"), false);
    assert_eq!(browser.errors(), Vec::<String>::new());
}
