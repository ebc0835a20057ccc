//! A healthy rig is never switched off.

use upright_design::parallel;
use upright_design::rig::{PerJoint, Rig, Tolerances};
use upright_design::robust::{Healthy, Machines, balance, corner_machine, false_alarms, healthy_machine};
use upright_design::study::Study;

use crate::published::table;
use crate::supervised::{ALL_RIGS, rig};
use upright::supervision::fault::Fault;
use upright::table::Law;

/// Balances for some hours. The set-point changes sides every minute.
fn nominal(rig: &Rig, law: Law, seed: u64, hours: f64) -> Healthy {
    balance(rig, &table(rig), law, seed, 3600.0 * hours).unwrap()
}

#[test]
fn half_a_minute_of_nominal_balancing_of_every_rig_raises_no_alarm() {
    let of_rig = |name: &'static str| [Law::Lqr, Law::PolePlacement].map(|law| (name, law));
    let runs: Vec<_> = ALL_RIGS.into_iter().flat_map(of_rig).collect();
    let found = parallel::map(runs, |(name, law)| (name, law, nominal(&rig(name), law, 1, 30.0 / 3600.0)));
    for (name, law, found) in found {
        assert_eq!(found.fault, None, "{name} {law:?}: {found:?}");
    }
}

#[test]
fn twenty_times_the_disturbance_is_an_alarm() {
    // Negative control: larger disturbances do raise an alarm.
    let mut rough = rig("quadruple-paper");
    rough.verify.force_rms_n = Some(20.0 * 0.1);
    assert!(nominal(&rough, Law::Lqr, 1, 30.0 / 3600.0).fault.is_some());
}

#[test]
fn machines_of_a_study_are_within_the_tolerances_and_their_alarms_are_counted() {
    let tolerating = tolerating("single-quanser-ip02", 5.0, 3e-2);
    for number in 0..50 {
        let reality = healthy_machine(&tolerating, number).reality;
        assert!(reality.parameters.cart_mass_percent.abs() <= 5.0, "{reality:?}");
        assert!((0.0..=3e-2).contains(&reality.friction.joint_friction_n_m.of(0)), "{reality:?}");
    }
    assert_ne!(healthy_machine(&tolerating, 1), healthy_machine(&tolerating, 2));
    let count = |rig: &Rig| {
        false_alarms(rig, &table(rig), Law::Lqr, (Machines::Drawn(2), 5.0), &Study::whole(), &|| ()).unwrap()
    };
    let found = count(&tolerating);
    assert_eq!((found.runs, found.alarms.len()), (2, 0), "{found:?}");
    assert!((found.hours * 3600.0 - 10.0).abs() < 0.1, "{found:?}");
    // Negative control: disturbances so large that every run ends with an alarm.
    let mut rough = tolerating;
    rough.verify.force_rms_n = Some(20.0);
    let found = count(&rough);
    assert_eq!(found.alarms.len(), 2, "{found:?}");
}

#[test]
fn machines_at_the_corners_have_every_combination_of_wrong_masses_and_all_of_the_friction() {
    let tolerating = tolerating("double-quanser-dbpen", 5.0, 3e-3);
    let machines: Vec<Rig> = (0..8).map(|number| corner_machine(&tolerating, number)).collect();
    assert_eq!(Machines::Corners.count(&tolerating), 8);
    let masses = |machine: &Rig| {
        let parameters = &machine.reality.parameters;
        [parameters.cart_mass_percent, parameters.link_mass_percent.of(0), parameters.link_mass_percent.of(1)]
    };
    assert_eq!(masses(&machines[0]), [-5.0, -5.0, -5.0]);
    assert_eq!(masses(&machines[6]), [-5.0, 5.0, 5.0]);
    for (number, machine) in machines.iter().enumerate() {
        assert_eq!(machine.reality.friction.joint_friction_n_m.of(1), 3e-3);
        assert!(masses(machine).iter().all(|percent| percent.abs() == 5.0));
        assert!(!machines[..number].contains(machine), "{number}");
    }
}

/// The rig file with these tolerances in place of its own.
fn tolerating(name: &str, percent: f64, friction_n_m: f64) -> Rig {
    let mut tolerating = rig(name);
    let mut tolerances = Tolerances::default();
    (tolerances.mass_percent, tolerances.joint_friction_n_m) = (percent, friction_n_m);
    tolerating.robust = Some(tolerances);
    tolerating
}

#[test]
fn friction_that_the_file_tolerates_is_no_alarm_and_without_the_tolerance_it_is() {
    let mut sticking = tolerating("single-quanser-ip02", 5.0, 3e-2);
    sticking.reality.friction.joint_friction_n_m = PerJoint::all(3e-2);
    let found = nominal(&sticking, Law::Lqr, 1, 20.0 / 3600.0);
    assert_eq!((&found.fault, found.rejected), (&None, 0), "{found:?}");
    // Negative control: the same machine, with thresholds for the exact model.
    sticking.robust = None;
    let found = nominal(&sticking, Law::Lqr, 1, 20.0 / 3600.0);
    assert_eq!(found.fault, Some(Fault::Encoder.to_string()), "{found:?}");
}

#[test]
fn thresholds_follow_from_the_tolerances() {
    let exact = table(&rig("quadruple-paper")).thresholds;
    assert_eq!(table(&tolerating("quadruple-paper", 0.0, 0.0)).thresholds, exact);
    let wider = table(&tolerating("quadruple-paper", 5.0, 5e-5)).thresholds;
    let by =
        |wide: &[f32], exact: &[f32]| wide.iter().zip(exact).take(5).map(|(a, b)| a / b).fold(0.0, f32::max);
    let found = [by(&wider.innovation, &exact.innovation), by(&wider.frozen, &exact.frozen)];
    println!("wider by {found:?}, energy by {}", wider.motor.energy / exact.motor.energy);
    assert!(found.iter().all(|by| (1.05..4.0).contains(by)), "{found:?}");
}
