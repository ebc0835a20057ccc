//! What a reload of the twin's page keeps, and how it moves for a person who prefers reduced motion, in a real browser.
//!
//! Needs Chromium or Chrome, as `twin_page.rs`.

use serde_json::Value;

use crate::report_devtools::Browser;
use crate::twin_page::{FASTEST, MACHINE, STATE, Twin, click, let_pass, set_speed, until, until_state};

const TIMES: &str =
    "(({ history }) => [0, history.length - 1].map((index) => history.time(index)))(upright.scopes())";

/// Times and values of all curves of the scopes until a time (s), as text.
fn curves_until(browser: &mut Browser, t_s: f64) -> Value {
    browser.value(&format!(
        "(({{ history }}) => history.rows.map((row) => row.subarray(0, history.after({t_s})).join()).join(';'))(upright.scopes())"
    ))
}

#[test]
fn a_reload_keeps_rig_state_and_scopes_and_a_power_up_begins_them_again() {
    let Some(mut browser) = Browser::for_test_of("the twin") else { return };
    let twin = Twin::start("single-quanser-ip02", &[]);
    browser.open_address(&twin.address, 640, "light", "screen");
    until_state(&mut browser, "Balancing");
    set_speed(&mut browser, FASTEST);
    let_pass(&mut browser, 5.0);
    set_speed(&mut browser, 1.0);
    let times = browser.value(TIMES);
    let [first, last] = [0, 1].map(|end| times[end].as_f64().unwrap());
    assert!(last - first > 4.0, "{times}");
    let curves = curves_until(&mut browser, last);
    browser.open_address(&twin.address, 640, "light", "screen");
    until_state(&mut browser, "Balancing");
    let_pass(&mut browser, 0.5);
    assert_eq!(browser.value(TIMES)[0], first);
    assert_eq!(curves_until(&mut browser, last), curves);
    assert!(browser.value(TIMES)[1].as_f64().is_some_and(|now| now > last + 0.5));
    // Where the page was not there, no curve is drawn.
    let gap = "(({ history }) => { let gap = 0; for (let k = 0; k < history.length; k += 1) gap += Number.isNaN(history.values[0][k]); return gap; })(upright.scopes())";
    assert_eq!(browser.value(gap), 1);
    assert_eq!(browser.value(&format!("{MACHINE}.factor")), 1);
    // Negative control: after a power-up, nothing older is shown, also after a reload.
    click(&mut browser, "[data-restart=upright]");
    until(&mut browser, &format!("{MACHINE}.t_s < {last}"));
    until_state(&mut browser, "Balancing");
    browser.open_address(&twin.address, 640, "light", "screen");
    until(&mut browser, "upright.scopes()?.history.length > 5");
    assert_ne!(curves_until(&mut browser, last), curves);
    assert!(browser.value(TIMES)[1].as_f64().is_some_and(|now| now < last));
    assert_eq!(browser.value(STATE), "Balancing");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn with_reduced_motion_the_camera_cuts_instead_of_gliding() {
    let Some(mut browser) = Browser::for_test_of("the twin") else { return };
    let twin = Twin::start("single-quanser-ip02", &[]);
    for reduces in [true, false] {
        browser.reduces_motion = reduces;
        browser.open_address(&twin.address, 1280, "light", "screen");
        until_state(&mut browser, "Balancing");
        // In how many frames the camera moves after the rig has fallen.
        let moves = browser.value(
            "(() => { const view = upright.view(); const state = upright.seen.picture.machine.state; \
             for (let k = 0; k < 500; k += 1) view.aim(state, true); \
             let [moves, before] = [0, view.scale]; \
             for (let k = 0; k < 500; k += 1) { view.aim(state, false); const { scale } = view; \
             if (Math.abs(scale - before) > 0.01) moves += 1; before = scale; } return moves; })()",
        );
        let moves = moves.as_u64().unwrap();
        assert!(if reduces { moves == 1 } else { moves > 10 }, "{reduces}: {moves} frames");
    }
}
