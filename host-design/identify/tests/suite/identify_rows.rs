//! Rows of tables as people record them: slow, uneven, with gaps, with decimal commas.

use upright_identify::Identification;

use crate::swinging::{REDUCED_LENGTH, Swing, file, identified, names, reading, reduced_length, table};

/// Times of rows every `period_s`, off by up to a third of a row to either side if `is_uneven`.
fn times(period_s: f64, is_uneven: bool) -> impl Fn(usize) -> f64 {
    move |row| {
        let off = if is_uneven { ((row * 7919 % 101) as f64 / 50.0 - 1.0) / 3.0 } else { 0.0 };
        (row as f64 + 0.5 + off) * period_s
    }
}

/// Rows without every 50th.
fn with_gaps(rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    rows.into_iter().enumerate().filter(|(row, _)| row % 50 != 49).map(|(_, row)| row).collect()
}

/// What is found in a table of a single pendulum; its reduced length has to be right.
fn found(name: &str, text: &str) -> Identification {
    let found = identified(&file(1), text, &reading()).unwrap();
    let [length, deviation] = reduced_length(&found);
    println!("{name}: {length} ± {deviation}, {REDUCED_LENGTH}; {:?}", found.rows);
    assert_eq!(found.refusal, None, "{name}");
    let error = (length - REDUCED_LENGTH).abs();
    assert!(error < 4.0 * deviation && error < 1e-3 * REDUCED_LENGTH, "{name}: {length} ± {deviation}");
    found
}

/// 30 rows a second, uneven, with gaps, in milliseconds, with decimal commas: all at once.
#[test]
fn slow_uneven_rows_with_gaps_and_decimal_commas_are_identified() {
    let rows = with_gaps(Swing::of(1).rows(times(1.0 / 30.0, true)));
    let mut text = "Time [ms];Theta1 [rad]\n".to_owned();
    for row in &rows {
        text += &format!("{:.3};{:.6}\n", 1e3 * row[0], row[1]).replace('.', ",");
    }
    let found = found("30 Hz, uneven, gaps", &text);
    let rows = found.rows.unwrap();
    assert!((rows.costs() - (33.33f64 / 2.0).sqrt()).abs() < 0.05, "{rows:?}");
    assert!((rows.uneven_s - 0.19 / 30.0).abs() < 1e-3, "{rows:?}");
    assert!((5..=7).contains(&found.lost_ticks), "{}", found.lost_ticks);
}

#[test]
fn rows_that_do_not_show_the_fastest_mode_are_refused_with_its_period() {
    let text = table(&names(2), &Swing::of(2).rows(times(0.2, false)));
    let error = identified(&file(2), &text, &reading()).unwrap_err().to_string();
    // Of two rods that hang from a fixed point, by hand: 436 ms, and a quarter of it.
    assert!(error.contains("a row every 200.0 ms") && error.contains("period is 436 ms"), "{error}");
    assert!(error.contains("record every 109.0 ms"), "{error}");
}

/// Each of them takes a few seconds: run by `.ci/run`.
#[test]
#[ignore = "takes some seconds: CI runs it"]
fn every_kind_of_rows_that_a_person_records_is_identified() {
    let of = |period_s: f64, is_uneven: bool| Swing::of(1).rows(times(period_s, is_uneven));
    let of_names = |rows: &[Vec<f64>]| table(&names(1), rows);
    let fine = found("500 Hz", &of_names(&of(0.002, false)));
    for (name, rows) in [
        ("60 Hz", of(1.0 / 60.0, false)),
        ("50 Hz", of(0.02, false)),
        ("30 Hz", of(1.0 / 30.0, false)),
        ("500 Hz, uneven", of(0.002, true)),
        ("500 Hz, gaps", with_gaps(of(0.002, false))),
        ("60 Hz, uneven", of(1.0 / 60.0, true)),
        ("60 Hz, uneven, gaps", with_gaps(of(1.0 / 60.0, true))),
    ] {
        let slow = found(name, &of_names(&rows));
        // The loss that is stated is about that of the deviations.
        let [lost, stated] =
            [reduced_length(&slow)[1] / reduced_length(&fine)[1], slow.rows.unwrap().costs()];
        println!("{name}: deviation times {lost:.2}, stated {stated:.2}");
    }
    // Two links: the error of rows that are off is larger for the faster mode.
    for (name, rows) in [
        ("double, 60 Hz", Swing::of(2).rows(times(1.0 / 60.0, false))),
        ("double, 60 Hz, uneven, gaps", with_gaps(Swing::of(2).rows(times(1.0 / 60.0, true)))),
    ] {
        let found = identified(&file(2), &table(&names(2), &rows), &reading()).unwrap();
        println!("{name}: {:?} {:?}", found.refusal, found.doubts);
        assert_eq!(found.refusal, None, "{name}");
    }
}
