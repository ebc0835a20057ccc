//! What the page costs at length: memory and time for each frame.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set, and needs Chromium or Chrome. Its name makes it begin first, because it
//! takes longest.

use std::time::Instant;

use crate::report_devtools::Browser;
use crate::site_page::{opened, root, type_in, until as until_designed};
use crate::site_twin::balance;
use crate::twin_page::{FASTEST, STATE, let_pass, set_speed, until_state};

/// Most bytes that a tab's store takes as text.
const MOST_KEPT: f64 = 5e6;

/// The part of the heap that is kept for a reload (bytes).
fn kept(browser: &mut Browser) -> f64 {
    browser.value("parent.upright.keptBytes()").as_f64().unwrap()
}

#[test]
fn ten_minutes_of_balancing_in_the_page_need_no_more_memory() {
    let Some((mut browser, _folder)) = opened() else { return };
    type_in(&mut browser, &std::fs::read_to_string(root().join("rigs/single-quanser-ip02.toml")).unwrap());
    until_designed(&mut browser, "upright.desk.design?.states === 4");
    balance(&mut browser, true);
    until_state(&mut browser, "Balancing");
    set_speed(&mut browser, FASTEST);
    // The heap grows until the scopes are full, after 82 s, and is flat from 130 s on.
    for _ in 0..8 {
        let_pass(&mut browser, 20.0);
    }
    let (heap, kept, resident) = (browser.heap(), kept(&mut browser), browser.resident_kib());
    let frames = browser.value("upright.seen.frames").as_f64().unwrap();
    let (begin, worked_s) = (Instant::now(), browser.worked_s());
    for _ in 0..30 {
        let_pass(&mut browser, 20.0);
    }
    let seconds = begin.elapsed().as_secs_f64();
    let frames = browser.value("upright.seen.frames").as_f64().unwrap() - frames;
    let work_ms = 1e3 * (browser.worked_s() - worked_s) / frames;
    let (heap_after, kept_after, resident_after) =
        (browser.heap(), self::kept(&mut browser), browser.resident_kib());
    eprintln!(
        "page: 600 simulated s in {seconds:.0} s, {:.0} frames per second, {work_ms:.1} ms of scripts and layout for each",
        frames / seconds
    );
    eprintln!(
        "page: heap {heap} to {heap_after} bytes, with what is kept for a reload, {kept} to {kept_after}; processes of the pages {resident:?} to {resident_after:?} KiB"
    );
    assert_eq!(browser.value(STATE), "Balancing");
    // What is kept for a reload is what the run has changed in the module's memory, which is larger after a hesitation.
    let [heap, heap_after] = [heap - kept, heap_after - kept_after];
    assert!(heap_after < 1.02 * heap + 1e5, "the page grows from {heap} to {heap_after} bytes");
    assert!(kept_after > 0.0 && kept_after < MOST_KEPT, "{kept_after} bytes");
    if let (Some(before), Some(after)) = (resident, resident_after) {
        assert!((after as f64) < 1.1 * before as f64, "the thread grows from {before} to {after} KiB");
    }
    assert!(work_ms < 1e3 / 60.0, "scripts and layout take {work_ms} ms for each frame");
}
