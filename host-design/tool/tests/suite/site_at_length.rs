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
/// Most bytes by which the heap may grow in the last five minutes. Measured: 7 kB.
const MOST_GROWTH: f64 = 1e5;

/// The part of the heap that is kept for a reload, and the rest (bytes). What is kept is what the run has changed in
/// the module's memory, which is larger after a hesitation.
fn heap(browser: &mut Browser) -> [f64; 2] {
    let kept = browser.value("parent.upright.keptBytes()").as_f64().unwrap();
    [kept, browser.heap() - kept]
}

#[test]
fn ten_minutes_of_balancing_in_the_page_need_no_more_memory() {
    let Some((mut browser, _folder)) = opened() else { return };
    type_in(&mut browser, &std::fs::read_to_string(root().join("rigs/single-quanser-ip02.toml")).unwrap());
    until_designed(&mut browser, "upright.desk.design?.states === 4");
    balance(&mut browser, true);
    until_state(&mut browser, "Balancing");
    set_speed(&mut browser, FASTEST);
    // Until the scopes are full, after 82 s, the page needs more and more.
    for _ in 0..8 {
        let_pass(&mut browser, 20.0);
    }
    let resident = browser.resident_kib();
    let frames = browser.value("upright.seen.frames").as_f64().unwrap();
    let (begin, worked_s) = (Instant::now(), browser.worked_s());
    for _ in 0..15 {
        let_pass(&mut browser, 20.0);
    }
    // On a slow computer the heap needs longer to reach its size: measured from its first full scopes on, it grew by
    // 0.27 MB to the size that it has at once on a fast one.
    let [_, heap_at_half] = heap(&mut browser);
    for _ in 0..15 {
        let_pass(&mut browser, 20.0);
    }
    let seconds = begin.elapsed().as_secs_f64();
    let frames = browser.value("upright.seen.frames").as_f64().unwrap() - frames;
    let work_ms = 1e3 * (browser.worked_s() - worked_s) / frames;
    let ([kept, heap_after], resident_after) = (heap(&mut browser), browser.resident_kib());
    eprintln!(
        "page: 600 simulated s in {seconds:.0} s, {:.0} frames per second, {work_ms:.1} ms of scripts and layout for each",
        frames / seconds
    );
    eprintln!(
        "page: heap without the {kept} bytes kept for a reload {heap_at_half} to {heap_after} bytes in the last 300 s; processes of the pages {resident:?} to {resident_after:?} KiB"
    );
    assert_eq!(browser.value(STATE), "Balancing");
    let growth = heap_after - heap_at_half;
    assert!(growth < MOST_GROWTH, "the page grows by {growth} bytes");
    assert!(kept > 0.0 && kept < MOST_KEPT, "{kept} bytes");
    if let (Some(before), Some(after)) = (resident, resident_after) {
        assert!((after as f64) < 1.1 * before as f64, "the thread grows from {before} to {after} KiB");
    }
    assert!(work_ms < 1e3 / 60.0, "scripts and layout take {work_ms} ms for each frame");
    // Negative control: what a page keeps by mistake is seen.
    browser.value("(globalThis.lost = Array.from({ length: 12000 }, (_, index) => ({ index })), 0)");
    let [_, heap_with_leak] = heap(&mut browser);
    assert!(heap_with_leak - heap_after > MOST_GROWTH, "{heap_after} to {heap_with_leak}");
}
