//! Exercises of the page: an answer is marked when a run shows it, and what is solved stays solved.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set, and needs Chromium or Chrome.

use crate::report_devtools::Browser;
use crate::site_page::{opened, until};
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
    click(browser, &format!("#lesson-list button:nth-child({number})"));
    until(browser, "!document.getElementById('balance').disabled && upright.desk.design.states === 4");
}

#[test]
fn an_answer_is_marked_when_a_run_shows_it_beside_the_twin_and_stays_solved() {
    let Some((mut browser, _folder)) = opened() else { return };
    begin(&mut browser, 2);
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

    begin(&mut browser, 5);
    answer(&mut browser, "10", "First show it");
    let page = browser.value("location.href").as_str().unwrap().to_owned();
    browser.open_address(&page, 1280, "light", "screen");
    until(&mut browser, "upright.desk.design");
    let ticked = "[...document.querySelectorAll('#lesson-list button')].map((button) => button.textContent.startsWith('✓'))";
    assert_eq!(browser.value(ticked), serde_json::json!([false, true, false, false, false]));
    assert_eq!(browser.errors(), Vec::<String>::new());
}
