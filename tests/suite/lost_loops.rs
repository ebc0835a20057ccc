//! Loops that have to fall do so, which shows that the closed-loop tests can fail. Also the limits and seeds of a run.

use crate::bench::*;
use upright::table::{Law, TableError};
use upright_design::simulate::{FallKind, Scenario, SimulationError, simulate};
use upright_design::table::TableValues;

const LEAN: f64 = 0.001;

#[test]
fn continuous_gains_fall_at_five_milliseconds_where_sampled_ones_survive() {
    let rig = paper_at(0.005, 0);
    let scenario = Scenario { step_m: 0.05, ..lean(&rig, Law::Lqr, LEAN) };
    let held = run(&rig, &continuous_table(&rig), &scenario);
    // Spectral radius 3.1: from a milliradian to the horizontal in about seven ticks, and the force limit.
    assert!(held.fall.as_ref().is_some_and(|fall| fall.at_s < 0.5), "{held}");
    let redesigned = run(&rig, &table(&rig), &scenario);
    assert!(redesigned.settled && redesigned.final_error_m.abs() < 1e-4, "{redesigned}");
}

#[test]
fn sampled_gains_hold_even_at_ten_milliseconds() {
    let rig = paper_at(0.01, 0);
    let table = raw_table(&rig);
    for law in LAWS {
        let summary = run(&rig, &table, &Scenario { step_m: 0.05, ..lean(&rig, law, LEAN) });
        assert!(summary.settled, "{law:?}: {summary}");
    }
}

#[test]
fn a_delay_that_was_designed_for_survives_and_one_that_was_ignored_falls() {
    let rig = paper_at(0.002, 1);
    let scenario = lean(&rig, Law::Lqr, LEAN);
    let ignored = run(&rig, &continuous_table(&rig), &scenario);
    assert!(!ignored.survives(), "{ignored}");
    let designed = table(&rig);
    for law in LAWS {
        let summary = run(&rig, &designed, &lean(&rig, law, LEAN));
        assert!(summary.settled, "{law:?}: {summary}");
    }
    // The same continuous gains balance without the delay.
    let prompt = paper_at(0.002, 0);
    assert!(run(&prompt, &continuous_table(&prompt), &scenario).survives());
}

fn with_gain(table: &TableValues, law: Law, entry: usize, factor: f32) -> TableValues {
    let mut broken = table.clone();
    broken.laws[law].as_mut().unwrap().k[entry] *= factor;
    broken
}

#[test]
fn a_gain_that_is_wrong_by_a_fifth_or_in_sign_falls() {
    let rig = rig("quadruple-paper");
    let table = raw_table(&rig);
    for (law, entry, factor) in [
        // The LQR depends most on the third link's angle. (With 20 % less of it, the loop only oscillates.)
        (Law::Lqr, 6, 1.2),
        (Law::PolePlacement, 5, 0.8),
        (Law::PolePlacement, 3, 1.2),
        (Law::Lqr, 4, -1.0),
        (Law::PolePlacement, 2, -1.0),
    ] {
        // A loop that diverges by 0.1 % per tick needs time to fall.
        let scenario = Scenario { duration_s: 30.0, ..lean(&rig, law, LEAN) };
        let broken = run(&rig, &with_gain(&table, law, entry, factor), &scenario);
        assert!(!broken.survives(), "{law:?} K[{entry}] times {factor}: {broken}");
        assert!(run(&rig, &with_gain(&table, law, entry, 1.0), &scenario).settled);
    }
}

#[test]
fn no_run_exceeds_the_force_limit() {
    let mut rig = rig("quadruple-paper");
    // A limit below the 9.2 N that the pole placement requests at a step of 1 m.
    rig.actuator.force_mut().unwrap().limit_n = Some(5.0);
    let table = raw_table(&rig);
    let (trace, summary) = simulate(&rig, &table, &metre_step(&rig, Law::PolePlacement, 2.0)).unwrap();
    assert!(trace.samples().all(|sample| sample.force.abs() <= 5.0));
    assert_eq!(summary.peak_force_n, 5.0);
    assert!(summary.peak_requested_force_n > 9.0, "the limit did take part: {summary}");
}

#[test]
fn a_lean_that_the_force_cannot_catch_falls() {
    let mut rig = rig("quadruple-paper");
    let scenario = lean(&rig, Law::Lqr, 0.02);
    assert!(run(&rig, &table(&rig), &scenario).survives());
    rig.actuator.force_mut().unwrap().limit_n = Some(0.05);
    let weak = run(&rig, &table(&rig), &scenario);
    assert!(matches!(weak.fall.as_ref().map(|fall| fall.kind), Some(FallKind::Link(_))), "{weak}");
}

#[test]
fn a_set_point_beyond_the_rail_ends_at_its_end() {
    let rig = rig("quadruple-paper");
    let beyond = Scenario { step_m: 3.0, ..at_rest(&rig, Law::Lqr) };
    let summary = run(&rig, &table(&rig), &beyond);
    assert_eq!(summary.fall.map(|fall| fall.kind), Some(FallKind::EndOfRail));
}

#[test]
fn the_same_seed_gives_the_same_run_bit_for_bit_and_another_seed_another_run() {
    let rig = rig("quadruple-paper");
    let table = raw_table(&rig);
    let record = |seed| {
        let scenario = Scenario {
            force_noise_n: 0.1,
            torque_noise_n_m: 3e-5,
            seed,
            duration_s: 2.0,
            ..at_rest(&rig, Law::Lqr)
        };
        let mut csv = Vec::new();
        simulate(&rig, &table, &scenario).unwrap().0.write_csv(&mut csv).unwrap();
        csv
    };
    assert_eq!(record(7), record(7));
    assert_ne!(record(7), record(8));
}

/// A run at rest proves nothing: even an unstable loop does not fall without a push.
#[test]
fn balance_is_only_proved_by_a_push() {
    let rig = paper_at(0.005, 0);
    let table = continuous_table(&rig);
    assert!(run(&rig, &table, &at_rest(&rig, Law::Lqr)).survives());
    assert!(!run(&rig, &table, &Scenario::acceptance(&rig, Law::Lqr, 1.0)).survives());
}

#[test]
fn a_table_that_the_firmware_refuses_is_not_simulated() {
    let rig = rig("quadruple-paper");
    let mut damaged = table(&rig);
    damaged.tick_s = f32::NAN;
    let error = simulate(&rig, &damaged, &at_rest(&rig, Law::Lqr)).unwrap_err();
    assert_eq!(error, SimulationError::Table(TableError::Value));
}

#[test]
fn a_run_whose_record_would_fill_the_memory_is_refused() {
    let rig = rig("quadruple-paper");
    let table = raw_table(&rig);
    let forever = Scenario { duration_s: 1e9, ..at_rest(&rig, Law::Lqr) };
    let error = simulate(&rig, &table, &forever).unwrap_err();
    assert!(matches!(error, SimulationError::TooLong { .. }), "{error}");
}
