//! How soon the page shows something, and what a change does.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set, and needs Chromium or Chrome.

use std::time::Instant;

use serde_json::{Value, json};
use upright_page::Desk;

use crate::site_bits::in_node_with_time;
use crate::site_page::{begin_with, opened, root};

/// Most processor time of the module for gains, certificates and closed loop (s), and as a multiple of the time that
/// the library itself takes, where that is more. How long a person waits is printed: it depends on the load.
const MOST: (f64, f64) = (1.0, 4.0);

/// Moves a weight four times. For each: time to the gains with their certificate and the closed loop, from there to the
/// poles, for the closed loop alone, and the longest pause of the page (ms).
const MOVED: &str = "(async () => {
    const weight = document.getElementById('weight-lqr.force_weight');
    const all = [];
    for (const exponent of [0.3, 0.6, 0.9, 1.2]) {
      const { design, poles } = upright.desk;
      const begin = performance.now();
      let [last, pause, designed] = [begin, 0, null];
      weight.value = exponent;
      weight.dispatchEvent(new Event('input'));
      while (upright.desk.poles === poles) {
        await new Promise((take) => { setTimeout(take, 4); });
        const now = performance.now();
        pause = Math.max(pause, now - last);
        last = now;
        if (upright.desk.design !== design) designed ??= now - begin;
      }
      const toml = document.getElementById('toml').value;
      const run = performance.now();
      await upright.ask({ ask: 'design', toml, lean_rad: 0.005, step_m: 0.1 });
      all.push([designed, last - begin - designed, performance.now() - run, pause]);
    }
    return all;
  })()";

/// Questions for the same with other weights.
fn questions() -> Vec<Value> {
    let toml = std::fs::read_to_string(root().join("rigs/quadruple-paper.toml")).unwrap();
    let with = |weight: i32| toml.replace("force_weight = 1\n", &format!("force_weight = {weight}\n"));
    (2..6)
        .map(|weight| json!({ "ask": "design", "toml": with(weight), "lean_rad": 0.005, "step_m": 0.1 }))
        .collect()
}

/// Shortest time of this computer for one of them (s).
fn here_s() -> f64 {
    let once = |design: Value| {
        let begin = Instant::now();
        let answer: Value = serde_json::from_str(&Desk::default().answer(&design.to_string())).unwrap();
        assert!(answer["laws"][0]["run"].is_object(), "{answer}");
        begin.elapsed().as_secs_f64()
    };
    questions().into_iter().map(once).fold(f64::INFINITY, f64::min)
}

#[test]
fn gains_and_closed_loop_follow_a_weight_in_a_second_of_processor_time_and_the_page_stays_free() {
    let Some((mut browser, _folder)) = opened() else { return };
    let moved_s = browser.value("upright.live().began_ms / 1e3").as_f64().unwrap();
    begin_with(&mut browser, "quadruple-paper");
    let first_s = browser.value("performance.getEntriesByName('first-contentful-paint')[0].startTime / 1e3");
    let moved: Vec<[f64; 4]> = serde_json::from_value(browser.value(MOVED)).unwrap();
    let (here_s, first_s) = (here_s(), first_s.as_f64().unwrap());
    let least = |place: usize| moved.iter().map(|times| times[place]).fold(f64::INFINITY, f64::min);
    let [designed, poles, run, pause] = [0, 1, 2, 3].map(least);
    eprintln!("page: first picture {first_s:.2} s after it is opened from the disk");
    eprintln!("page: a rig moves {moved_s:.2} s after it is opened");
    eprintln!(
        "page: a weight of four links moved: gains, certificates and closed loop after {:.2} s, of which the run {:.2} s; \
         poles {:.2} s later; longest pause of the page {:.2} s; the library itself {here_s:.2} s",
        designed / 1e3,
        run / 1e3,
        poles / 1e3,
        pause / 1e3
    );
    let (_, processor) = in_node_with_time(&questions());
    eprintln!(
        "page: processor time of the module for gains, certificates and closed loop, in Node: {processor}"
    );
    let processor_s: f64 = processor.trim_end_matches(" s").parse().unwrap();
    assert!(processor_s < MOST.0.max(MOST.1 * here_s), "{processor_s} s, here {here_s} s");
    assert!(pause < 0.5 * designed, "{moved:?} ms");
    // Negative control: what the page computes itself makes it pause.
    let own = "(() => { const begin = performance.now(); while (performance.now() < begin + 300); })()";
    let busy =
        MOVED.replace("weight.dispatchEvent", &format!("setTimeout(() => {own}, 1); weight.dispatchEvent"));
    let moved: Vec<[f64; 4]> = serde_json::from_value(browser.value(&busy)).unwrap();
    assert!(moved.iter().all(|times| times[3] > 250.0), "{moved:?}");
    assert_eq!(browser.errors(), Vec::<String>::new());
}
