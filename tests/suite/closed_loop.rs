//! The firmware's controller against the nonlinear plant: every loop that has to stay upright does so.

use crate::bench::*;
use crate::gains::{STATES, TABLE};
use upright::control::controller::Controller;
use upright::table::Law;
use upright_design::simulate::{Bench, Scenario, Summary, simulate};

/// Runs `gains::TABLE` in the firmware's own controller, in the simplest possible loop. Returns the whole state at
/// every tick.
fn firmware_alone(scenario: &Scenario) -> Vec<[f64; STATES]> {
    let rig = rig_of_the_firmware();
    let mut controller = Controller::new(&TABLE, Bench::widths()).unwrap();
    let mut bench = Bench::new(&rig, scenario).unwrap();
    controller.select(scenario.law).unwrap();
    controller.set_setpoint(scenario.step_m as f32).unwrap();
    controller.start(&bench.counters()).unwrap();
    let ticks = (scenario.duration_s / rig.tick.period_s).round() as usize;
    (0..=ticks)
        .map(|_| {
            let state = core::array::from_fn(|i| bench.state()[i]);
            let counters = bench.counters();
            bench.tick(controller.control(&counters).drive);
            controller.predict();
            state
        })
        .collect()
}

/// Whatever rig the table is for, it balances, and the tool's simulation is exactly this run.
#[test]
fn the_firmwares_table_holds_its_rig_bit_for_bit_as_simulated() {
    let rig = rig_of_the_firmware();
    let table = table(&rig);
    for law in LAWS.into_iter().filter(|law| TABLE.law(*law).is_some()) {
        let scenario = Scenario { duration_s: 10.0, ..Scenario::acceptance(&rig, law, 1.0) };
        let states = firmware_alone(&scenario);
        let (trace, summary) = simulate(&rig, &table, &scenario).unwrap();
        assert!(summary.survives(), "{law:?}: {summary}");
        assert_eq!(states.len(), trace.samples().len());
        for (tick, (alone, sample)) in states.iter().zip(trace.samples()).enumerate() {
            let same = alone.iter().zip(sample.state).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same, "{law:?} {tick}");
        }
    }
}

#[test]
fn the_papers_rig_follows_a_metre_step_without_steady_state_error() {
    let rig = rig("quadruple-paper");
    let table = raw_table(&rig);
    // Pole placement decays with e^(-0.667 t): the last 1e-4 of a metre take ln(1e4) / 0.667 = 14 s.
    for (law, duration_s) in [(Law::Lqr, 12.0), (Law::PolePlacement, 16.0)] {
        let summary = run(&rig, &table, &metre_step(&rig, law, duration_s));
        assert!(summary.settled && summary.final_error_m.abs() < 1e-4, "{law:?}: {summary}");
        assert!(summary.peak_force_n < 20.0, "the limit takes no part in this");
        // Negative control: half way to the set-point, the error is large.
        let early = run(&rig, &table, &metre_step(&rig, law, 1.0));
        assert!(!early.settled && early.final_error_m.abs() > 1e-2, "{law:?}: {early}");
    }
}

/// Figures of a 1 m step: overshoot %, undershoot %, settling time s, angles °, force N.
fn figures(summary: &Summary) -> Vec<f64> {
    let degrees = summary.peak_angles_rad.iter().map(|angle| angle.to_degrees());
    [
        summary.overshoot_percent.unwrap(),
        summary.undershoot_percent.unwrap(),
        summary.settling_time_s.unwrap(),
        summary.peak_force_n,
    ]
    .into_iter()
    .chain(degrees)
    .collect()
}

/// Drake, MuJoCo and a hand-derived model agree on these figures for the gains as printed. Two decimals of a gain are
/// up to 0.3 % of it, which changes a figure by up to 3 %.
#[test]
fn the_papers_continuous_gains_give_the_published_responses() {
    // A tick of 0.1 ms is as good as continuous time for a loop whose fastest pole is at -528 1/s.
    let rig = paper_at(1e-4, 0);
    let table = continuous_table(&rig);
    for (law, wanted) in [
        (Law::Lqr, [1.68, 1.76, 2.11, 3.16, 12.31, 1.49, 1.34, 1.03]),
        (Law::PolePlacement, [1.02, 1.05, 5.09, 11.0, 8.48, 6.71, 2.30, 0.87]),
    ] {
        let summary = run(&rig, &table, &metre_step(&rig, law, 8.0));
        for (found, wanted) in figures(&summary).into_iter().zip(wanted) {
            assert!((found / wanted - 1.0).abs() < 0.03, "{law:?}: {found} {wanted}\n{summary}");
        }
    }
}

/// Gains that are designed for the tick request less peak force, and keep the response as intended.
#[test]
fn sampled_gains_keep_the_response_of_the_continuous_design() {
    let (continuous, sampled) = (paper_at(1e-4, 0), paper_at(1e-3, 0));
    let (continuous_table, sampled_table) = (continuous_table(&continuous), raw_table(&sampled));
    for law in LAWS {
        let meant = run(&continuous, &continuous_table, &metre_step(&continuous, law, 8.0));
        let found = run(&sampled, &sampled_table, &metre_step(&sampled, law, 8.0));
        assert!(found.peak_force_n < meant.peak_force_n);
        let time = |summary: &Summary| summary.settling_time_s.unwrap();
        // A few ticks: the sampled optimum differs slightly.
        assert!((time(&found) - time(&meant)).abs() < 5e-3, "{law:?}\n{found}\n{meant}");
        for (found, meant) in found.peak_angles_rad.iter().zip(&meant.peak_angles_rad) {
            assert!((found / meant - 1.0).abs() < 0.01, "{law:?}: {found} {meant}");
        }
    }
}

#[test]
fn single_double_and_triple_rigs_stand_under_both_laws_with_and_without_delay() {
    for name in ["single-quanser-ip02", "double-quanser-dbpen", "triple-glueck-eder-kugi"] {
        for delay_ticks in [0, 1] {
            let mut rig = rig(name);
            rig.tick.delay_ticks = delay_ticks;
            let table = raw_table(&rig);
            for law in LAWS {
                let scenario = Scenario { step_m: 0.1, duration_s: 12.0, ..lean(&rig, law, 0.01) };
                let summary = run(&rig, &table, &scenario);
                assert!(
                    // What is left of the dead zone lets the cart stop, or creep, a little off the set-point.
                    summary.settled && summary.final_error_m.abs() < 2e-3,
                    "{name} {law:?} delay {delay_ticks}: {summary}"
                );
            }
        }
    }
}

#[test]
fn the_quadruple_survives_from_any_side_and_mirrors_its_mirror_image() {
    let rig = rig("quadruple-paper");
    let table = raw_table(&rig);
    for law in LAWS {
        let start = [0.1, -0.05, 0.004, 0.0, -0.003, 0.01, 0.002, 0.0, 0.001, -0.02];
        let towards = Scenario { start: start.to_vec(), ..at_rest(&rig, law) };
        let away = Scenario { start: start.map(|entry| -entry).to_vec(), ..towards.clone() };
        let (towards, away) = (run(&rig, &table, &towards), run(&rig, &table, &away));
        assert!(towards.survives(), "{law:?}: {towards}");
        assert_eq!(towards.final_error_m, -away.final_error_m);
        assert_eq!(towards.peak_angles_rad, away.peak_angles_rad);
    }
}

#[test]
fn it_survives_under_the_papers_disturbances() {
    let rig = rig("quadruple-paper");
    let table = raw_table(&rig);
    for law in LAWS {
        // F_d ~ N(0, 0.01) and joint torques ~ N(0, 1e-9), with the variances given in the paper.
        let disturbed = Scenario {
            force_noise_n: 0.1,
            torque_noise_n_m: 1e-9f64.sqrt(),
            seed: 3,
            ..metre_step(&rig, law, 10.0)
        };
        let summary = run(&rig, &table, &disturbed);
        assert!(summary.settled, "{law:?}: {summary}");
        assert_ne!(summary, run(&rig, &table, &metre_step(&rig, law, 10.0)), "they do disturb");
    }
}
