//! With only encoder counts, every rig balances, and counter widths and starting counts make no difference.

use crate::bench::*;
use upright::control::controller::Controller;
use upright::control::encoder::CounterWidth;
use upright::table::Law;
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Disturbance, Sample, Scenario, Sensing, simulate};
use upright_design::table::TableValues;
use upright_trust::verify::{CornerSettings, Corners, coarser, corners, endurance};

/// Force noise of 0.1 N rms on the cart, none at the joints.
const FORCE_NOISE: Disturbance = Disturbance { force_n: 0.1, torque_n_m: 0.0 };

/// The paper's rig (4096 counts per revolution, 1 kHz) with a force limit of `limit_n`.
fn paper_with_limit(limit_n: f64) -> Rig {
    let mut rig = rig("quadruple-paper");
    rig.actuator.force_mut().unwrap().limit_n = Some(limit_n);
    rig
}

fn survived(rig: &Rig, law: Law, seeds: u64, duration_s: f64) -> u64 {
    endurance(rig, &table(rig), law, &FORCE_NOISE, seeds, duration_s).unwrap().survived
}

#[test]
fn the_quadruple_survives_a_minute_of_force_noise_with_a_hundred_seeds() {
    let rig = paper_with_limit(5.0);
    for law in LAWS {
        let found = endurance(&rig, &table(&rig), law, &FORCE_NOISE, 100, 60.0).unwrap();
        assert_eq!((found.survived, found.duration_s), (100, 60.0), "{law:?}: seeds {:?} fell", found.fallen);
        assert!(found.peak_force_n > 0.3 && found.peak_force_n <= 5.0, "the noise did push: {found:?}");
    }
}

#[test]
fn too_coarse_an_encoder_and_too_small_a_force_fall() {
    for law in LAWS {
        let fine = paper_with_limit(5.0);
        assert_eq!(survived(&fine, law, 3, 5.0), 3);
        // 64 counts per revolution.
        assert_eq!(survived(&coarser(&fine, 64.0), law, 3, 5.0), 0, "{law:?}: coarse");
        // A force limit of half the noise (rms) is too small to compensate it.
        assert_eq!(survived(&paper_with_limit(0.05), law, 3, 5.0), 0, "{law:?}: weak");
    }
}

#[test]
fn the_quadruple_takes_half_a_metre_through_the_governor_in_noise() {
    let rig = paper_with_limit(5.0);
    for law in LAWS {
        let scenario =
            Scenario { step_m: 0.5, duration_s: 20.0, force_noise_n: 0.1, ..Scenario::at_rest(&rig, law) };
        assert_eq!(scenario.sensing, Sensing::Encoders);
        let summary = run(&rig, &table(&rig), &scenario);
        // The force noise keeps moving the cart by some millimetres.
        assert!(summary.survives() && summary.final_error_m.abs() < 0.05, "{law:?}: {summary}");
        assert!(summary.peak_force_n < 5.0, "{law:?}: {summary}");
    }
}

#[test]
fn single_double_and_triple_with_motor_dead_zone_and_friction_take_a_step_through_the_governor() {
    for name in ["single-quanser-ip02", "double-quanser-dbpen", "triple-glueck-eder-kugi"] {
        let rig = rig(name);
        let motor = rig.actuator.motor().unwrap();
        assert!(motor.dead_zone_v > 0.0, "{name}");
        let table = table(&rig);
        for law in LAWS {
            let step = Scenario { step_m: 0.1, duration_s: 20.0, ..Scenario::at_rest(&rig, law) };
            assert_eq!(step.sensing, Sensing::Encoders);
            let summary = run(&rig, &table, &step);
            // What is left of the dead zone, and the encoder's steps, let the cart creep off the set-point.
            assert!(summary.survives() && summary.final_error_m.abs() < 5e-3, "{name} {law:?}: {summary}");
            // Negative control: a hundredth of the supply cannot recover from a lean from which the full supply does.
            let mut tired = rig.clone();
            tired.actuator.motor_mut().unwrap().supply_v /= 100.0;
            let mut push = step.clone();
            push.start[2] = 0.02;
            assert!(run(&rig, &table, &push).survives(), "{name} {law:?}");
            assert!(!run(&tired, &table, &push).survives(), "{name} {law:?}");
        }
    }
}

/// The same run with counters that show `counter_start` at position 0: every sample, as bits.
fn bits(rig: &Rig, table: &TableValues, scenario: &Scenario, counter_start: u32) -> Vec<Vec<u64>> {
    let scenario = Scenario { counter_start, ..scenario.clone() };
    let (trace, summary) = simulate(rig, table, &scenario).unwrap();
    assert!(summary.survives(), "{summary}");
    let row = |sample: Sample<&[f64]>| {
        let numbers = [sample.requested, sample.force, sample.setpoint].into_iter();
        numbers.chain(sample.state.iter().chain(sample.estimate).copied()).map(f64::to_bits).collect()
    };
    trace.samples().map(row).collect()
}

/// Number of times that each counter wraps in that run.
fn wraps(rig: &Rig, table: &TableValues, scenario: &Scenario, counter_start: u32) -> Vec<usize> {
    let (trace, _) = simulate(rig, table, scenario).unwrap();
    rig.sensors()
        .iter()
        .enumerate()
        .map(|(index, sensor)| {
            // The cart's counter has 32 bits, those of the links have 16.
            let bits = if index == 0 { 32 } else { 16 };
            let shown: Vec<u64> = trace
                .samples()
                .map(|sample| {
                    let counts = (sample.state[sensor.state] / sensor.step::<f64>()).round() as i64;
                    u64::from(counter_start.wrapping_add(counts as u32)) & ((1 << bits) - 1)
                })
                .collect();
            shown.windows(2).filter(|pair| pair[0].abs_diff(pair[1]) > 1 << (bits - 1)).count()
        })
        .collect()
}

#[test]
fn a_wrap_of_every_counter_in_mid_run_changes_nothing() {
    for name in ["single-quanser-ip02", "triple-glueck-eder-kugi", "quadruple-paper"] {
        let rig = rig(name);
        let table = table(&rig);
        for law in LAWS {
            let mut scenario =
                Scenario { step_m: 0.2, duration_s: 5.0, force_noise_n: 0.1, ..Scenario::at_rest(&rig, law) };
            scenario.start[2] = 0.005;
            let plain = bits(&rig, &table, &scenario, 0);
            for counter_start in [u32::MAX, u32::MAX - 1, 0] {
                let wraps = wraps(&rig, &table, &scenario, counter_start);
                assert!(wraps.iter().all(|&wraps| wraps > 0), "{name} {law:?} {counter_start}: {wraps:?}");
            }
            // The links' 16 bits wrap where the cart's 32 do not, and the sign bits change.
            for counter_start in [65_535, 2 * 65_536 - 1, 7 * 65_535, (1 << 31) - 1, 1 << 15] {
                assert!(
                    bits(&rig, &table, &scenario, counter_start) == plain,
                    "{name} {law:?} {counter_start}"
                );
            }
            for counter_start in [u32::MAX, u32::MAX - 1] {
                assert!(
                    bits(&rig, &table, &scenario, counter_start) == plain,
                    "{name} {law:?} {counter_start}"
                );
            }
        }
    }
}

/// A run in the simplest possible loop, with the controller told that the counters have these widths; every state, as
/// bits. `None` if a link fell.
fn with_widths<const NX: usize, const NY: usize>(
    name: &str,
    assumed: [CounterWidth; NY],
    law: Law,
    counter_start: u32,
) -> Option<Vec<u64>> {
    let rig = rig(name);
    let values = table(&rig);
    let table = values.table::<NX, NY>();
    let mut controller = Controller::new(&table, assumed).unwrap();
    controller.select(law).unwrap();
    let mut scenario = Scenario { counter_start, force_noise_n: 0.1, ..Scenario::at_rest(&rig, law) };
    scenario.start[2] = 0.005;
    let mut bench = Bench::new(&rig, &scenario).unwrap();
    let mut at_zero = [0; NY];
    bench.read_counters_at_zero(&mut at_zero);
    controller.encoders_mut().home(&at_zero, &[0; NY]);
    controller.start(&bench.counters()).unwrap();
    controller.set_setpoint(0.2).unwrap();
    let mut states = Vec::new();
    for _ in 0..3000 {
        let counters = bench.counters();
        bench.tick(controller.control(&counters).drive);
        controller.predict();
        states.extend(bench.state().iter().map(|value| value.to_bits()));
        if bench.state()[2].abs() > 1.0 {
            return None;
        }
    }
    Some(states)
}

#[test]
fn registers_of_sixteen_bits_wrap_unnoticed_and_not_if_their_width_is_mistaken() {
    use CounterWidth::Bits32;
    for law in LAWS {
        let paper = |widths, start| with_widths::<10, 5>("quadruple-paper", widths, law, start);
        let plain = paper(Bench::widths(), 1 << 14).unwrap();
        // At 65 535 and at u32::MAX, every 16-bit register is just before its wrap; at 0, just after it.
        for start in [0, 65_535, u32::MAX] {
            assert!(paper(Bench::widths(), start).as_ref() == Some(&plain), "{law:?} {start}");
            assert!(paper([Bits32; 5], start).is_none(), "{law:?} {start}");
        }
    }
    let single = |widths| with_widths::<4, 2>("single-quanser-ip02", widths, Law::Lqr, 65_535);
    assert!(single(Bench::widths()).is_some());
    assert!(single([Bits32; 2]).is_none());
}

fn wrong_by(rig: &Rig, law: Law, percent: f64) -> Corners {
    corners(rig, &table(rig), law, percent, &CornerSettings::of(rig)).unwrap()
}

#[test]
fn every_corner_of_wrong_masses_survives_at_two_and_at_five_percent() {
    let rig = paper_with_limit(5.0);
    for law in LAWS {
        for percent in [2.0, 5.0] {
            let found = wrong_by(&rig, law, percent);
            assert_eq!((found.survived, found.corners), (32, 32), "{law:?} {percent} %: {:?}", found.lost);
        }
    }
}

#[test]
fn an_observer_that_trusts_the_papers_joint_noise_loses_corners_at_five_percent() {
    let mut rig = paper_with_limit(5.0);
    // The variance of the paper's torques, (1e-9) (N·m)², held for 1 ms.
    rig.kalman.as_mut().unwrap().joint_noise = vec![1e-12; 4];
    let found = wrong_by(&rig, Law::PolePlacement, 5.0);
    assert!(
        (1..32).contains(&(found.corners - found.survived)),
        "{} of {} survive",
        found.survived,
        found.corners
    );
    assert_eq!(found.lost.len(), found.corners - found.survived);
    // Negative control: the wrong masses are what makes it fall.
    assert_eq!(wrong_by(&rig, Law::PolePlacement, 2.0).survived, 32);
}
