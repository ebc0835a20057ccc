//! An arm in the twin's page: from the side and from above, and in its own units.
//!
//! Needs Chromium or Chrome, as `twin_page.rs`.

use serde_json::Value;

use crate::report_devtools::Browser;
use crate::twin_page::{MACHINE, STATE, Twin, let_pass, pull, until, until_state, wait};

/// Where an angle of the arm is in the window, this far out on its circle (CSS pixels).
fn above(browser: &mut Browser, angle_rad: f64, share: f64) -> [f64; 2] {
    let point = browser.value(&format!(
        "(() => {{ const view = upright.view(); const {{ above }} = view.parts(); \
         const box = view.canvas.getBoundingClientRect(); const far = {share} * above.radius; \
         return [box.left + above.x + far * Math.sin({angle_rad}), box.top + above.y + far * Math.cos({angle_rad})]; }})()"
    ));
    [0, 1].map(|axis| point[axis].as_f64().unwrap())
}

fn number(browser: &mut Browser, expression: &str) -> f64 {
    browser.value(expression).as_f64().unwrap()
}

#[test]
fn an_arm_is_pulled_from_the_side_and_from_above_and_goes_where_its_circle_is_clicked() {
    let Some(mut browser) = Browser::for_test_of("an arm in the twin") else { return };
    let twin = Twin::start("single-srv02-rotary", &[]);
    browser.open_address(&twin.address, 1280, "light", "screen");
    until_state(&mut browser, "Balancing");
    let_pass(&mut browser, 1.0);
    let pulled = pull(&mut browser, 1, 4.0, 0.4);
    assert_eq!(pulled["body"], 1, "{pulled}");
    let_pass(&mut browser, 2.0);
    assert_eq!(browser.value(STATE), "Balancing");

    // The end of the arm, from above: the pull turns it the way of the pointer.
    let alpha = number(&mut browser, &format!("{MACHINE}.state[0]"));
    let (from, to) = (above(&mut browser, alpha, 0.9), above(&mut browser, alpha + 0.15, 0.9));
    browser.mouse("mouseMoved", from);
    browser.mouse("mousePressed", from);
    browser.mouse("mouseMoved", to);
    wait(0.3);
    let pull = browser.value(&format!("{MACHINE}.pull"));
    browser.mouse("mouseReleased", to);
    assert_eq!(pull["body"], 0, "{pull}");
    let meant_rad = pull["to"][0].as_f64().unwrap() / 0.216;
    assert!((meant_rad - alpha - 0.15).abs() < 0.02, "{meant_rad} from {alpha}");
    let_pass(&mut browser, 2.0);
    assert_eq!(browser.value(STATE), "Balancing");

    // The set-point is an angle.
    let there = above(&mut browser, 0.5, 1.0);
    browser.mouse("mouseMoved", there);
    browser.mouse("mousePressed", there);
    browser.mouse("mouseReleased", there);
    until(&mut browser, "Math.abs(upright.seen.telemetry.setpoint_m - 0.5) < 0.02");
    let_pass(&mut browser, 5.0);
    assert!((number(&mut browser, &format!("{MACHINE}.state[0]")) - 0.5).abs() < 0.1);

    // Nothing on the page is of a cart.
    let said = browser.value(
        "[document.documentElement.innerText, ...[...document.querySelectorAll('[title], [aria-label]')]\
         .map((element) => `${element.title} ${element.getAttribute('aria-label')}`)].join('\\n')",
    );
    let said = said.as_str().unwrap();
    let all = browser.value("JSON.stringify([upright.view().hello.properties.map(({ label, unit }) => label + unit), upright.view().hello.sensors])");
    for text in [said, all.as_str().unwrap()] {
        assert!(!text.contains("cart") && text.contains("arm"), "{text}");
    }
    assert!(said.contains("Arm angle") && said.contains("N·m"), "{said}");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn negative_control_a_cart_has_no_view_from_above_and_is_called_a_cart() {
    let Some(mut browser) = Browser::for_test_of("a cart in the twin") else { return };
    let twin = Twin::start("single-quanser-ip02", &[]);
    browser.open_address(&twin.address, 1280, "light", "screen");
    until_state(&mut browser, "Balancing");
    assert_eq!(browser.value("upright.view().parts().above"), Value::Null);
    assert_eq!(browser.value("upright.view().hello.sensors[0]"), "cart");
    assert_eq!(browser.value("upright.view().hello.input[1]"), "N");
}
