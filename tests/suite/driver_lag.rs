//! A force that follows its command late, by the lag of a motor driver or a winding: the design makes up for the lag
//! that the rig file states.

use std::path::Path;

use upright::table::Law;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, simulate};
use upright_design::study::Study;
use upright_plan::{Condition, firmware_runs, with_motions};
use upright_trust::verify::{LagLimits, linear};

use crate::acceleration::{balancing, run};
use crate::published::{certified, rig_path, stored_motions, table};

const RIGS: [&str; 3] = ["single-quanser-ip02", "double-quanser-dbpen", "quadruple-paper"];

/// The rig in this file with a force that lags (s).
fn lagging(name: &str, lag_s: f64) -> Rig {
    let mut rig = crate::published::rig(name);
    rig.actuator.force_mut().unwrap().lag_s = Some(lag_s);
    rig
}

/// The same machine, whose lag is in fact another one (s).
fn really(rig: &Rig, lag_s: f64) -> Rig {
    let mut real = rig.clone();
    real.reality.driver.driver_lag_s = Some(lag_s);
    real
}

/// Whether the machine stands for 20 s, under each law, with the firmware and its tests.
fn stands(real: &Rig, designed: &Rig) -> bool {
    let table = table(designed);
    Law::ALL.into_iter().all(|law| {
        let scenario = Scenario { law, is_supervised: true, ..balancing(real) };
        let (summary, rms_n) = run(real, &table, &scenario);
        println!("{} {law}: {rms_n:.3} N rms, {summary}", real.name);
        summary.survives()
    })
}

/// K of SciPy: `solve_discrete_are` for the plant with the force as a further state, sampled by `scipy.linalg.expm`,
/// with the cost of a tick by Gauss-Legendre quadrature with 12 points.
#[test]
fn the_gains_are_those_of_the_plant_with_the_force_as_a_state() {
    let known: [(&str, &[f64]); 2] = [
        ("single-quanser-ip02", &[-43.918996, -38.746877, 131.93676, 25.745949, 0.035_877_21]),
        (
            "quadruple-paper",
            &[
                2.3988201,
                2.7997301,
                -5.2180894,
                -4.3827076,
                -157.60807,
                -4.3187338,
                449.60529,
                2.1952238,
                -464.49508,
                -20.028988,
                0.96393071,
            ],
        ),
    ];
    for (name, wanted) in known {
        let lqr = certified(&lagging(name, 0.002)).double.sampled.lqr.clone().unwrap();
        let differ = |gains: &[f64]| {
            gains.len() != wanted.len()
                || gains.iter().zip(wanted).any(|(found, wanted)| (found / wanted - 1.0).abs() > 2e-7)
        };
        assert!(!differ(lqr.k.entries()), "{name}: {:?}", lqr.k.entries());
        // Negative control: another lag.
        let other = certified(&lagging(name, 0.0021)).double.sampled.lqr.clone().unwrap();
        assert!(differ(other.k.entries()), "{name}");
    }
}

#[test]
fn one_two_and_four_links_stand_on_a_late_force_that_the_rig_file_states() {
    for (name, lag_s) in RIGS.into_iter().zip([0.02, 0.005, 0.002]) {
        let rig = lagging(name, lag_s);
        for factor in [0.8, 1.0, 1.25] {
            assert!(stands(&really(&rig, factor * lag_s), &rig), "{name} {factor}");
        }
    }
}

#[test]
fn four_links_fall_on_a_late_force_of_which_the_design_does_not_know() {
    let at_once = crate::published::rig("quadruple-paper");
    let (summary, _) = run(&really(&at_once, 0.002), &table(&at_once), &balancing(&at_once));
    assert!(!summary.survives(), "{summary}");
}

/// How far the predicted speed of the cart is off, with no other errors than those of the encoders.
#[test]
fn the_rig_moves_as_the_model_of_the_lag_says() {
    let rig = lagging("quadruple-paper", 0.002);
    let scenario = Scenario {
        step_m: 0.1,
        duration_s: 3.0,
        force_noise_n: 0.0,
        torque_noise_n_m: 0.0,
        ..balancing(&rig)
    };
    let wrong = |real: &Rig| {
        let (trace, summary) = simulate(real, &table(&rig), &scenario).unwrap();
        assert!(summary.survives());
        trace.samples().map(|sample| (sample.state[1] - sample.estimate[1]).abs()).fold(0.0, f64::max)
    };
    let (stated, other) = (wrong(&rig), wrong(&really(&rig, 0.003)));
    println!("{stated} {other}");
    assert!(1.5 * stated < other, "{stated} {other}");
}

#[test]
fn the_lags_that_are_stated_as_limits_are_those_at_which_the_machine_falls() {
    let limits = |rig: &Rig| {
        let reports = linear(rig, certified(rig), &table(rig)).unwrap();
        reports.into_iter().find(|report| report.law == Law::Lqr).unwrap().lag
    };
    let survives = |real: &Rig, rig: &Rig| run(real, &table(rig), &balancing(real)).0.survives();
    assert_eq!(limits(&crate::published::rig("quadruple-paper")), None);
    for (name, lag_s) in RIGS.into_iter().zip([0.02, 0.02, 0.002]) {
        let rig = lagging(name, lag_s);
        let found = limits(&rig).unwrap();
        println!("{name} {lag_s}: {found:?}");
        let LagLimits { least_s, largest_s } = found;
        if let Some(largest_s) = largest_s {
            assert!(survives(&really(&rig, largest_s / 1.2), &rig), "{name} {found:?}");
            assert!(!survives(&really(&rig, 1.3 * largest_s), &rig), "{name} {found:?}");
        }
        match least_s {
            None => assert!(survives(&really(&rig, 0.0), &rig), "{name}"),
            Some(least_s) => {
                assert!(survives(&really(&rig, 1.2 * least_s), &rig), "{name} {found:?}");
                assert!(!survives(&really(&rig, 0.7 * least_s), &rig), "{name} {found:?}");
            }
        }
    }
}

/// The rig with a force that begins a tick late, and then lags (s).
fn late_and_lagging(name: &str, lag_s: f64) -> Rig {
    let mut rig = lagging(name, lag_s);
    (rig.tick.delay_ticks, rig.swing_up) = (1, None);
    rig
}

/// One pending force stands for two: the machine, in which the delay and the lag are those of a real drive, stands for
/// 20 s. It falls if the file states neither, or the delay alone.
#[test]
fn a_tick_of_delay_before_a_lag_is_made_up_for() {
    for (name, lag_s) in RIGS.into_iter().zip([0.02, 0.01, 0.002]) {
        let rig = late_and_lagging(name, lag_s);
        for factor in [0.8, 1.0, 1.25] {
            assert!(stands(&really(&rig, factor * lag_s), &rig), "{name} {factor}");
        }
    }
    let rig = late_and_lagging("quadruple-paper", 0.002);
    let [mut at_once, mut delayed] = [&rig, &rig].map(Clone::clone);
    at_once.actuator.force_mut().unwrap().lag_s = None;
    at_once.tick.delay_ticks = 0;
    delayed.actuator.force_mut().unwrap().lag_s = None;
    for poor in [&at_once, &delayed] {
        assert!(!run(&really(&rig, 0.002), &table(poor), &balancing(&rig)).0.survives());
    }
}

#[test]
fn rigs_are_raised_and_lowered_as_often_with_a_late_force() {
    let condition = Condition::all()[2];
    const RUNS: u64 = 20;
    for (name, lag_s) in [("double-quanser-dbpen", 0.002), ("quadruple-paper", 0.002)] {
        let arrived = |rig: &Rig, real: &Rig| {
            let motions = stored_motions(name);
            let table = with_motions(rig, table(rig), motions, &[]).unwrap();
            let found =
                firmware_runs(real, &table, motions, &condition, 1..1 + RUNS, &Study::whole()).unwrap();
            println!("{name}: {found:?}");
            (found.raise_in_all().arrived, found.lower.arrived)
        };
        let at_once = crate::published::rig(name);
        let late = lagging(name, lag_s);
        let (with, without) = (arrived(&late, &late), arrived(&at_once, &at_once));
        assert!(with.0 + 1 >= without.0 && with.1 + 1 >= without.1, "{name}: {with:?} {without:?}");
        if name == "quadruple-paper" {
            // Negative control: the same lag, of which the table does not know.
            let unknown = arrived(&at_once, &really(&at_once, lag_s));
            assert!(2 * unknown.0 < with.0, "{unknown:?}");
        }
    }
}

#[test]
fn a_lag_belongs_to_a_force() {
    let error = |text: &str| Rig::from_toml(text, Path::new("rig.toml")).unwrap_err().to_string();
    let text = |name: &str, line: &str| {
        let text = std::fs::read_to_string(rig_path(name)).unwrap();
        text.replace("[actuator]\n", &format!("[actuator]\n{line}\n"))
    };
    let good = text("single-quanser-ip02", "driver_lag_s = 0.002");
    assert_eq!(crate::published::rig_of(&good).actuator.lag_s(), Some(0.002));
    assert!(
        error(&good.replace("driver_lag_s = 0.002", "driver_lag_s = 0"))
            .contains("actuator.driver_lag_s: found 0")
    );
    assert!(error(&text("single-stepper", "driver_lag_s = 0.002")).contains("actuator.driver_lag_s"));
}
