//! The page in a real browser.
//!
//! Needs Chromium or Chrome. Without one the test says so and passes, unless `UPRIGHT_REQUIRE_BROWSER=1` is set.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use upright_test_support::limits::output;

use crate::report_devtools::Browser;
use crate::report_rigs::{LINEAR, SINGLE};

/// Width of a phone (CSS pixels).
const TELEPHONE: u32 = 390;

const GEOMETRY: &str =
    "[...document.querySelectorAll('.stage line, .stage circle')].map((e) => e.outerHTML).join()";
const CURSORS: &str = "[...document.querySelectorAll('.cursor')].map((line) => line.getAttribute('x1'))";
const UNFOLD: &str = "document.querySelectorAll('details').forEach((folded) => { folded.open = true; })";
/// Waits for some frames, in which a running animation moves on.
const WAIT: &str = "new Promise((done) => { let frames = 12; \
                    const next = () => { frames -= 1; frames ? requestAnimationFrame(next) : done(); }; next(); })";

/// Adds a fault unless this holds.
fn require(faults: &mut Vec<String>, holds: bool, fault: &str) {
    if !holds {
        faults.push(fault.to_owned());
    }
}

/// Medium on which a page is shown.
#[derive(Debug, Clone, Copy)]
enum Medium {
    Screen,
    Telephone,
    Paper,
}

/// Everything that is wrong with a page.
fn faults(browser: &mut Browser, page: &Path, is_drawn: bool) -> Vec<String> {
    let (mut faults, light) = on_a_screen(browser, page, is_drawn);
    faults.extend(on_a_telephone(browser, page, &light));
    faults.extend(on_paper(browser, page, &light));
    faults
}

/// Its faults on a wide screen, and the colour of the page there.
fn on_a_screen(browser: &mut Browser, page: &Path, is_drawn: bool) -> (Vec<String>, Value) {
    let mut faults = Vec::new();
    let mut check = |holds: bool, fault: &str| require(&mut faults, holds, fault);
    browser.open(page, 1200, "light", "screen");
    check(browser.value("!document.getElementById('playback').hidden") == true, "no playback");
    if is_drawn {
        let still = browser.value(GEOMETRY);
        check(still.as_str().is_some_and(|geometry| !geometry.is_empty()), "nothing is drawn");
        browser.value(WAIT);
        check(browser.value(GEOMETRY) == still, "the animation moves before it is played");
        browser.value("document.getElementById('play').click()");
        browser.value(WAIT);
        check(browser.value(GEOMETRY) != still, "the animation does not move");
        browser.value("document.getElementById('play').click()");
        let paused = browser.value(GEOMETRY);
        browser.value(WAIT);
        check(browser.value(GEOMETRY) == paused, "the animation cannot be paused");
    }
    let panels = "[...document.querySelectorAll('figure[data-areas]')].flatMap((f) => f.dataset.areas.split(';')).length";
    let panels = browser.value(panels).as_u64().unwrap_or(0) as usize;
    let scrub =
        "{ const s = document.getElementById('scrub'); s.value = 700; s.dispatchEvent(new Event('input')); }";
    let before = browser.value(CURSORS);
    browser.value(scrub);
    let after = browser.value(CURSORS);
    let moved = |before: &Value, after: &Value| match (before.as_array(), after.as_array()) {
        (Some(before), Some(after)) => {
            panels > 0
                && before.len() == panels
                && before.iter().zip(after).all(|(before, after)| before != after)
        }
        _ => false,
    };
    check(moved(&before, &after), "scrubbing does not move every cursor");
    let press = "{ const p = document.querySelector('figure[data-areas] svg'); const b = p.getBoundingClientRect(); \
                 p.dispatchEvent(new PointerEvent('pointerdown', { clientX: b.left + 0.5 * b.width })); }";
    browser.value(press);
    check(moved(&after, &browser.value(CURSORS)), "a plot does not set the time");
    let every_scene = "{ const c = document.getElementById('scene'); for (let i = 0; i < c.length; i += 1) { \
                       c.value = String(i); c.dispatchEvent(new Event('change')); } }";
    browser.value(every_scene);
    let light = browser.value("getComputedStyle(document.body).backgroundColor");
    for error in browser.errors() {
        check(false, &format!("error: {error}"));
    }
    (faults, light)
}

/// Its faults on a dark telephone, for a page that has the colour `light` elsewhere.
fn on_a_telephone(browser: &mut Browser, page: &Path, light: &Value) -> Vec<String> {
    let mut faults = Vec::new();
    let mut check = |holds: bool, fault: &str| require(&mut faults, holds, fault);
    browser.open(page, TELEPHONE, "dark", "screen");
    browser.value(UNFOLD);
    let width = browser.value("document.documentElement.scrollWidth").as_u64();
    check(width.is_some_and(|width| width <= u64::from(TELEPHONE)), "it scrolls sideways on a telephone");
    let smallest = "Math.min(...[...document.querySelectorAll('svg.plot text')].map((t) => t.getBoundingClientRect().height))";
    check(
        browser.value(smallest).as_f64().is_some_and(|size| size >= 10.0),
        "text too small for a telephone",
    );
    let dark = browser.value("getComputedStyle(document.body).backgroundColor");
    check(*light != dark, "the page does not follow the dark scheme");
    let ink = browser.value("getComputedStyle(document.querySelector('svg.plot text')).fill");
    check(ink != "rgb(0, 0, 0)", "the plots do not follow the dark scheme");
    faults
}

/// Its faults when it is printed.
fn on_paper(browser: &mut Browser, page: &Path, light: &Value) -> Vec<String> {
    let mut faults = Vec::new();
    let mut check = |holds: bool, fault: &str| require(&mut faults, holds, fault);
    browser.open(page, 800, "dark", "print");
    check(
        browser.value("getComputedStyle(document.body).backgroundColor") == *light,
        "it prints on dark paper",
    );
    let controls = browser.value("getComputedStyle(document.querySelector('.controls')).display");
    check(controls == "none", "it prints its buttons");
    faults
}

/// The page without its content security policy.
fn without_policy(html: &str) -> String {
    let begin = html.find("<meta http-equiv=\"Content-Security-Policy\"").expect("a policy");
    let end = begin + html[begin..].find('\n').unwrap() + 1;
    [&html[..begin], &html[end..]].concat()
}

/// The verdict and every requirement come first, the rest is folded, and little stays in sight while one scrolls.
fn a_person_sees_the_verdict_first(browser: &mut Browser, page: &Path) {
    for width in [TELEPHONE, 1200] {
        browser.open(page, width, "light", "screen");
        let bottom = "document.querySelector('.verdict').getBoundingClientRect().bottom < 844";
        assert_eq!(browser.value(bottom), true, "{width}");
        let first = "document.querySelector('main > *').id";
        assert_eq!(browser.value(first), "trust");
        let height = browser.value("document.documentElement.scrollHeight").as_f64().unwrap();
        assert!(height < 7000.0, "{width}: {height} px");
        browser.value(UNFOLD);
        browser.value("document.getElementById('run-tilt').scrollIntoView()");
        let stays = browser.value(
            "[...document.querySelectorAll('main *')].filter((part) => getComputedStyle(part).position === 'sticky') \
             .reduce((sum, part) => sum + part.getBoundingClientRect().height, 0)",
        );
        assert!(stays.as_f64().is_some_and(|height| height < 0.15 * 844.0), "{width}: {stays} px");
        let read = "[...document.querySelectorAll('.controls select')].every((choice) => parseFloat(getComputedStyle(choice).fontSize) > 10)";
        assert_eq!(browser.value(read), true, "{width}: a choice cannot be read");
        let doubled = "[...document.querySelectorAll('nav a')].length - new Set([...document.querySelectorAll('nav a')].map(String)).size";
        assert_eq!(browser.value(doubled), 0);
        // A link leads into what is folded.
        browser.value("document.querySelectorAll('details').forEach((folded) => { folded.open = false; })");
        browser.value("document.querySelector('nav a[href=\"#gains\"]').click()");
        browser.value(WAIT);
        let shown = "(({ top }) => Math.abs(top) < 200)(document.getElementById('gains').getBoundingClientRect()) \
                     && document.getElementById('gains').closest('details').open";
        assert_eq!(browser.value(shown), true, "{width}");
    }
    assert_eq!(browser.errors(), Vec::<String>::new());
}

/// The page's policy stops scripts and styles that are not its own, and asks nobody.
fn nothing_else_is_let_in(browser: &mut Browser, page: &Path, html: &str) {
    for foreign in [
        "<script>document.body.dataset.foreign = 1</script></body>",
        "<script src=\"https://upright.invalid/x.js\"></script></body>",
        "<img src=\"https://upright.invalid/x.png\"></body>",
        "<style>body { --foreign: 1 }</style></body>",
    ] {
        std::fs::write(page, html.replace("</body>", foreign)).unwrap();
        browser.open(page, 1200, "light", "screen");
        let errors = browser.errors();
        assert!(
            errors.iter().any(|error| error.contains("Content Security Policy")),
            "{foreign}: {errors:?}"
        );
        let is_in = "document.body.dataset.foreign === '1' || getComputedStyle(document.body).getPropertyValue('--foreign') !== ''";
        assert_eq!(browser.value(is_in), false, "{foreign}");
    }
    // Negative control: without the policy, the script runs.
    let open =
        without_policy(html).replace("</body>", "<script>document.body.dataset.foreign = 1</script></body>");
    std::fs::write(page, open).unwrap();
    browser.open(page, 1200, "light", "screen");
    assert_eq!(browser.value("document.body.dataset.foreign"), "1");
    std::fs::write(page, html).unwrap();
}

#[test]
fn a_test_without_its_browser_passes_says_so_and_fails_where_one_is_required() {
    let nowhere = tempfile::tempdir().unwrap();
    let tested = |is_required: bool| {
        let mut tests = Command::new(std::env::current_exe().unwrap());
        tests
            .args(["--exact", "report_browser::the_page_works_in_a_browser_and_each_of_its_faults_is_found"]);
        tests.env("PATH", nowhere.path()).env_remove("UPRIGHT_REQUIRE_BROWSER");
        if is_required {
            tests.env("UPRIGHT_REQUIRE_BROWSER", "1");
        }
        output(&mut tests)
    };
    let left_out = tested(false);
    assert!(left_out.status.success(), "{left_out:?}");
    let said = String::from_utf8(left_out.stderr).unwrap();
    assert_eq!(said, "not exercised: the report in a browser: no chromium or google-chrome in the PATH\n");
    assert!(!tested(true).status.success());
}

/// Negative controls of [`faults`] on a page without a policy that has the colour `light`.
fn each_fault_is_found(browser: &mut Browser, page: &Path, html: &str, light: &Value) {
    use Medium::{Paper, Screen, Telephone};
    let broken = [
        (Screen, "</body>", "<script>throw new Error('on purpose')</script></body>", "on purpose"),
        (
            Screen,
            "</body>",
            "<script src=\"https://upright.invalid/x.js\"></script></body>",
            "request for https://upright.invalid",
        ),
        (
            Telephone,
            "<main>",
            "<main><div style=\"width: 600px\">too wide</div>",
            "it scrolls sideways on a telephone",
        ),
        (Screen, "drawMachine();", "", "the animation does not move"),
        (Screen, "requestAnimationFrame(tick);", "", "the animation does not move"),
        (Screen, "moveCursors();", "", "scrubbing does not move every cursor"),
        (
            Telephone,
            "prefers-color-scheme: dark",
            "prefers-color-scheme: none",
            "the page does not follow the dark scheme",
        ),
        (Paper, "@media screen and (prefers", "@media (prefers", "it prints on dark paper"),
        (Paper, "nav, .controls, noscript", "nav, noscript", "it prints its buttons"),
        (
            Telephone,
            "<svg class=\"plot\"",
            "<svg style=\"width: 150px\" class=\"plot\"",
            "text too small for a telephone",
        ),
    ];
    for (medium, part, instead, fault) in broken {
        assert!(html.contains(part), "{part}");
        std::fs::write(page, html.replace(part, instead)).unwrap();
        let found = match medium {
            Screen => on_a_screen(browser, page, true).0,
            Telephone => on_a_telephone(browser, page, light),
            Paper => on_paper(browser, page, light),
        };
        assert!(found.iter().any(|found| found.contains(fault)), "{fault}: {found:?}");
    }
}

#[test]
fn the_page_works_in_a_browser_and_each_of_its_faults_is_found() {
    let Some(mut browser) = Browser::for_test_of("the report") else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("report.html");
    let html = &SINGLE.html;
    std::fs::write(&page, html).unwrap();
    assert_eq!(faults(&mut browser, &page, true), Vec::<String>::new());
    a_person_sees_the_verdict_first(&mut browser, &page);
    nothing_else_is_let_in(&mut browser, &page, html);
    // The negative controls put scripts and styles into the page.
    let html = &without_policy(html);
    std::fs::write(&page, html).unwrap();
    browser.open(&page, 1200, "light", "screen");
    let light = browser.value("getComputedStyle(document.body).backgroundColor");

    each_fault_is_found(&mut browser, &page, html, &light);
    std::fs::write(&page, &LINEAR.html).unwrap();
    assert_eq!(faults(&mut browser, &page, false), Vec::<String>::new());
}
