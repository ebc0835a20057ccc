//! What the twin's page tells a person who sees a pendulum for the first time, in a real browser.
//!
//! Needs Chromium or Chrome, as `twin_page.rs`.

use crate::report_devtools::Browser;
use crate::twin_page::{
    FASTEST, MACHINE, STATE, Twin, click, comes_within, let_pass, pull, set_speed, until, until_state, wait,
};

const WINDOW: [f64; 2] = [390.0, 844.0];
const LINE: &str = "document.getElementById('state').textContent";
const ACT: &str = "document.getElementById('act')";

/// Does what the button offers until the rig is in a state: clicks it, or holds it if it says so.
fn follow_the_button(browser: &mut Browser, state: &str) {
    for _ in 0..100 {
        if browser.value(STATE) == state {
            return;
        }
        let place = browser.value(&format!(
            "{ACT}.hidden ? null : (({{ left, top }}) => [left + 20, top + 20])({ACT}.getBoundingClientRect())"
        ));
        if let [Some(x), Some(y)] = [0, 1].map(|axis| place[axis].as_f64()) {
            let is_held = browser.value(&format!("{ACT}.textContent.startsWith('Hold')")) == true;
            browser.mouse("mousePressed", [x, y]);
            if is_held {
                comes_within(browser, 2.0, &format!("!({LINE}).startsWith('The encoders')"));
                wait(0.3);
            }
            browser.mouse("mouseReleased", [x, y]);
        }
        comes_within(browser, 0.3, &format!("({STATE}) === '{state}'"));
    }
    panic!("never {state}: {}", browser.value(LINE));
}

/// The last value of the first curve of a scope: the estimate, and what is seen without one; null where there is none.
fn last_of(browser: &mut Browser, scope: usize) -> [Option<f64>; 2] {
    let value = browser.value(&format!(
        "(() => {{ const {{ history, panels }} = upright.scopes(); const slot = (history.length - 1) % history.times.length; \
         const at = panels[{scope}].offset; return [history.values[at][slot], history.seen[at]?.[slot]]; }})()"
    ));
    [0, 1].map(|kind| value[kind].as_f64())
}

#[test]
fn one_button_leads_from_power_up_to_balancing_and_up_again_after_lowering_and_after_a_fall() {
    let Some(mut browser) = Browser::for_test_of("the twin") else { return };
    let twin = Twin::start("single-quanser-ip02", &["--hanging"]);
    browser.open_address(&twin.address, WINDOW[0] as u32, "light", "screen");
    until_state(&mut browser, "Disarmed");
    // Before homing, the angle is unknown; scopes without anything to say are not there.
    until(&mut browser, "upright.scopes().history.length > 5");
    assert_eq!(last_of(&mut browser, 0), [None, None]);
    let shown = "[...document.querySelectorAll('.panel')].filter((panel) => !panel.hidden).length";
    assert_eq!(browser.value(shown), 2);
    // On a telephone, picture, line, scopes and both buttons are in one screen.
    for part in ["rig", "state", "panels", "act", "stop"] {
        let inside = format!(
            "(({{ left, top, right, bottom }}) => left >= 0 && top >= 0 && right <= {} && bottom <= {} && bottom - top > 20)\
             (document.getElementById('{part}').getBoundingClientRect())",
            WINDOW[0], WINDOW[1]
        );
        assert_eq!(browser.value(&inside), true, "{part}");
    }
    follow_the_button(&mut browser, "Balancing");
    assert_eq!(browser.value(shown), 5);
    let_pass(&mut browser, 1.0);
    // Lowered, and raised again with a click while it still swings.
    follow_the_button(&mut browser, "Lowering");
    set_speed(&mut browser, FASTEST);
    until_state(&mut browser, "Calibrated");
    let [estimate, seen] = last_of(&mut browser, 0);
    assert!(estimate.is_none() && seen.is_some_and(|angle| (angle.abs() - 180.0).abs() < 30.0), "{seen:?}");
    click(&mut browser, "#act");
    until_state(&mut browser, "Balancing");
    set_speed(&mut browser, 1.0);
    let_pass(&mut browser, 1.0);

    // A pull that is too strong is named with its force; the curves of the estimates end, and the true angle goes on.
    pull(&mut browser, 1, 250.0, 1.5);
    until_state(&mut browser, "Fault");
    let line = browser.value(LINE);
    let line = line.as_str().unwrap();
    let force =
        line.strip_prefix("It fell: a pull of ").and_then(|rest| rest.split_once(" N was too strong"));
    let force: f64 = force.unwrap_or_else(|| panic!("{line}")).0.parse().unwrap();
    assert!((0.05..20.0).contains(&force), "{line}");
    let_pass(&mut browser, 0.3);
    let [estimate, seen] = last_of(&mut browser, 0);
    let truth = browser.value(&format!("{MACHINE}.state[2]")).as_f64().unwrap().to_degrees();
    assert!(estimate.is_none() && seen.is_some_and(|angle| (angle - truth).abs() < 60.0), "{seen:?} {truth}");
    follow_the_button(&mut browser, "Balancing");
    // Negative control: a fault without a pull names none.
    let_pass(&mut browser, 2.0);
    click(&mut browser, "[data-defect=encoder-wire-open]");
    until_state(&mut browser, "Fault");
    let line = browser.value(LINE);
    assert!(line.as_str().unwrap().starts_with("Broken on purpose"), "{line}");
    assert_eq!(browser.errors(), Vec::<String>::new());
}
