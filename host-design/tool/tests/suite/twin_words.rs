//! What the twin's page says: in words that are true, and that a screen reader has, too.
//!
//! Needs Chromium or Chrome, as `twin_page.rs`.

use serde_json::{Value, json};

use crate::report_devtools::Browser;
use crate::twin_page::{Twin, until, until_state};

/// What the guide shows of a rig in a state; `hello`, `latest` and `wish` are parts of the truth.
fn guided(browser: &mut Browser, hello: &Value, latest: &Value, machine: &Value, wish: &Value) -> Value {
    browser.value(&format!(
        "import(new URL('guide.js', location.href)).then(({{ guide }}) => guide({{ \
         hello: {{ is_simulated: true, base: {{ noun: 'cart' }}, has_swing_up: true, falls_when_held: false, ...{hello} }}, \
         picture: {{ ended: null, commander: 1, fault: null, machine: {{ t_s: 1, pull: null, holding: 'free', ...{machine} }} }}, \
         latest: {{ against_arming: [], against_swing_up: [], now: null, ...{latest} }}, \
         wish: {{ name: null, left_s: 0, lapsed: null, ...{wish} }}, fall: null, step: 0, isCommander: true }}))"
    ))
}

#[test]
fn the_guide_says_that_a_wish_has_lapsed_that_a_link_does_not_hang_and_that_a_held_pull_fells_many_links() {
    let Some(mut browser) = Browser::for_test_of("the twin") else { return };
    let twin = Twin::start("single-quanser-ip02", &[]);
    browser.open_address(&twin.address, 1280, "light", "screen");
    let none = json!({});
    let text = |shown: &Value, part: &str| shown[part].as_str().unwrap().to_owned();
    let swings =
        json!({ "state": "Calibrated", "against_swing_up": ["the links do not hang", "something moves"] });
    // Falling from upright, it does not hang.
    let falling = guided(&mut browser, &none, &swings, &none, &none);
    assert!(!text(&falling, "line").starts_with("Hanging"), "{falling}");
    let sways = json!({ "state": "Calibrated", "against_swing_up": ["something moves"] });
    assert!(text(&guided(&mut browser, &none, &sways, &none, &none), "line").starts_with("Hanging"));
    // A wish says how long it stands, and that it has lapsed; the hand helps.
    let waits = guided(&mut browser, &none, &swings, &none, &json!({ "name": "up", "left_s": 42 }));
    assert!(text(&waits, "below").contains("waits 42 s more"), "{waits}");
    let lapsed = guided(&mut browser, &none, &swings, &none, &json!({ "lapsed": "up" }));
    assert!(text(&lapsed, "below").starts_with("Not raised: after 60 s"), "{lapsed}");
    assert_eq!(lapsed["act"]["text"], "Hold it still");
    let wish = browser.value(
        "import(new URL('guide.js', location.href)).then(({ Wish }) => { const wish = new Wish(() => {}); \
         const latest = { state: 'Calibrated', against_swing_up: ['something moves'] }; \
         wish.set('up', true); wish.take(latest); const before = wish.told(); \
         wish.since -= 61e3; wish.take(latest); return [before, wish.told()]; })",
    );
    assert_eq!([&wish[0]["name"], &wish[0]["lapsed"]], [&json!("up"), &Value::Null]);
    assert_eq!([&wish[1]["name"], &wish[1]["lapsed"]], [&Value::Null, &json!("up")]);

    // A motor that can still the links needs no hand.
    let stills = guided(&mut browser, &json!({ "has_stilling": true }), &swings, &none, &none);
    assert_eq!([&stills["act"]["text"], &stills["act"]["asks"][0]["line"]], ["Still and raise", "still"]);
    assert_eq!(guided(&mut browser, &none, &swings, &none, &none)["act"]["text"], "Raise when still");
    let stilling =
        guided(&mut browser, &none, &json!({ "state": "Stilling" }), &none, &json!({ "name": "up" }));
    assert!(text(&stilling, "below").contains("then raises them"), "{stilling}");

    // Before a person pulls, and while they do.
    let balancing = json!({ "state": "Balancing" });
    let many = json!({ "falls_when_held": true });
    let said = guided(&mut browser, &many, &balancing, &none, &none);
    assert!(text(&said, "below").contains("a pull that is held fells it"), "{said}");
    let pull = json!({ "pull": { "body": 2, "force_n": [0.1, 0.0] } });
    assert!(text(&guided(&mut browser, &many, &balancing, &pull, &none), "below").contains("Let go at once"));
    let few = guided(&mut browser, &none, &balancing, &none, &none);
    assert!(!text(&few, "below").contains("fells"), "{few}");
    // Keys of the rig file come without the marks around them.
    let keyed = json!({ "state": "Armed", "against_arming": ["lean beyond `angle_rad`"] });
    assert_eq!(text(&guided(&mut browser, &none, &keyed, &none, &none), "below"), "Lean beyond angle_rad");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn angles_are_shown_within_a_turn_with_the_turns_beside_them_and_axes_have_round_labels() {
    let Some(mut browser) = Browser::for_test_of("the twin") else { return };
    let twin = Twin::start("single-quanser-ip02", &[]);
    browser.open_address(&twin.address, 1280, "light", "screen");
    until_state(&mut browser, "Balancing");
    until(&mut browser, "upright.scopes().history.length > 5");
    // As after many turns of a link that has fallen.
    let shown = browser.value(
        "(() => { const scopes = upright.scopes(); const { history } = scopes; history.push = () => {}; \
         for (const row of history.seen) row?.fill(-9050); for (const row of history.values) row.fill(NaN); \
         scopes.end = history.last; scopes.drawPanel(scopes.panels[0]); \
         return scopes.panels[0].values[0].textContent; })()",
    );
    assert_eq!(shown, "(−50, −25 turns)");
    let scale = |call: &str| format!("import(new URL('scale.js', location.href)).then((scale) => {call})");
    let within =
        browser.value(&scale("[0, 30, -30, 180, 200, -180, -170, 370].map((a) => scale.within(a, 360))"));
    assert_eq!(within, json!([0, 30, -30, 180, 200, 180, 190, 10]));
    assert_eq!(browser.value(&scale("[scale.within(-9050), scale.turnsOf(-9050)]")), json!([-9050, ""]));
    let axis = browser.value(&scale("scale.roundValues(-0.3, 0.35, 0.1).join()"));
    assert_eq!(axis, "-0.3,-0.2,-0.1,0,0.1,0.2,0.3");
    assert_eq!(browser.value(&scale("scale.roundValues(1.01, 1.04, 0.1).length")), 0);
}

#[test]
fn every_control_has_a_name_and_no_word_of_a_tab_is_broken_on_a_small_telephone() {
    let Some(mut browser) = Browser::for_test_of("the twin") else { return };
    let twin = Twin::start("single-quanser-ip02", &[]);
    for width in [1280, 390, 320] {
        browser.open_address(&twin.address, width, "light", "screen");
        until_state(&mut browser, "Balancing");
        let broken = browser.value(
            "[...document.querySelectorAll('#tabs button')].flatMap((button) => { \
             const text = button.firstChild; const box = button.getBoundingClientRect(); \
             return [...text.data.matchAll(/\\S+/g)].filter(({ 0: word, index }) => { \
             const range = document.createRange(); range.setStart(text, index); range.setEnd(text, index + word.length); \
             const rects = [...range.getClientRects()]; \
             return rects.length !== 1 || rects[0].left < box.left || rects[0].right > box.right; }).map(([word]) => word); })",
        );
        assert_eq!(broken, json!([]), "{width}");
        for drawer in ["controls", "unknown", "break"] {
            browser.value(&format!("document.querySelector('[data-tab={drawer}]').click()"));
            assert_eq!(browser.unnamed_controls(), Vec::<String>::new(), "{width} {drawer}");
            let keys = browser.value("document.getElementById('defects').textContent.includes('`')");
            assert_eq!(keys, false);
        }
    }
    assert_eq!(browser.errors(), Vec::<String>::new());
}
