//! A healthy rig is never switched off.

use upright_design::parallel;
use upright_design::reality::{corner_machine, drawn_machine};
use upright_design::rig::{PerJoint, Rig, Tolerances};
use upright_design::study::Study;
use upright_design::table::TableValues;
use upright_trust::robust::{Healthy, Machines, balance, false_alarms};

use crate::published::table;
use crate::supervised::{ALL_RIGS, rig};
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

/// Joint friction (N·m), cart friction (N) and wrong zeros (rad) that docs/reality.md estimates for a rig.
fn typical(name: &str, [joint_n_m, cart_n, zero_rad]: [f64; 3]) -> Rig {
    let mut typical = rig(name);
    typical.reality.friction.joint_friction_n_m = PerJoint::all(joint_n_m);
    typical.reality.friction.cart_friction_n = cart_n;
    typical.reality.sensors.homing_error_rad = PerJoint::all(zero_rad);
    typical
}

#[test]
fn half_a_minute_of_balancing_of_every_typical_machine_raises_no_alarm() {
    let both = &Law::ALL[..];
    let machines = [
        ("single-quanser-ip02", [5e-4, 0.5, 7e-4], both),
        ("double-quanser-dbpen", [5e-4, 0.5, 3e-3], both),
        ("triple-glueck-eder-kugi", [1e-3, 2.0, 1e-3], both),
        // The paper's LQR does not survive this friction of the joints, whatever the firmware tolerates.
        ("quadruple-paper", [1e-4, 0.2, 1e-3], &[Law::PolePlacement]),
    ];
    let of_rig = |(name, reality, laws): (&'static str, [f64; 3], &'static [Law])| {
        laws.iter().map(move |&law| (name, reality, law))
    };
    let runs: Vec<_> = machines.into_iter().flat_map(of_rig).collect();
    let found = parallel::map(runs, |(name, reality, law)| {
        (name, law, nominal(&typical(name, reality), law, 1, 30.0 / 3600.0))
    });
    for (name, law, found) in found {
        assert_eq!((&found.fault, found.rejected), (&None, 0), "{name} {law:?}: {found:?}");
    }
    // Negative control: a fifth of the thresholds.
    let quadruple = typical("quadruple-paper", [1e-4, 0.2, 1e-3]);
    let found = balance(&quadruple, &stricter_table(&quadruple), Law::PolePlacement, 1, 30.0).unwrap();
    assert!(found.fault.is_some(), "{found:?}");
}

/// The rig's table with a fifth of the thresholds for encoders and pushes.
fn stricter_table(rig: &Rig) -> TableValues {
    let mut stricter = table(rig);
    let thresholds = &mut stricter.thresholds;
    thresholds.innovation.iter_mut().chain(&mut thresholds.push).for_each(|threshold| *threshold *= 0.2);
    stricter
}

#[test]
fn sixty_times_the_disturbance_is_an_alarm() {
    // Negative control: larger disturbances do raise an alarm.
    let mut rough = rig("quadruple-paper");
    rough.verify.force_rms_n = Some(60.0 * 0.1);
    assert!(nominal(&rough, Law::Lqr, 1, 30.0 / 3600.0).fault.is_some());
}

#[test]
fn machines_of_a_study_are_within_the_tolerances_and_their_alarms_are_counted() {
    let tolerating = tolerating("single-quanser-ip02", 5.0, 3e-2);
    for number in 0..50 {
        let reality = drawn_machine(&tolerating, number).reality;
        assert!(reality.parameters.cart_mass_percent.abs() <= 5.0, "{reality:?}");
        assert!((0.0..=3e-2).contains(&reality.friction.joint_friction_n_m.of_joint(0)), "{reality:?}");
    }
    assert_ne!(drawn_machine(&tolerating, 1), drawn_machine(&tolerating, 2));
    let count = |rig: &Rig| {
        false_alarms(rig, &table(rig), Law::Lqr, (Machines::Drawn(2), 5.0), &Study::whole(), &|| ()).unwrap()
    };
    let found = count(&tolerating);
    assert_eq!((found.runs, found.alarms.len()), (2, 0), "{found:?}");
    assert!((found.hours * 3600.0 - 10.0).abs() < 0.1, "{found:?}");
    // Negative control: disturbances so large that every run ends with an alarm.
    let mut rough = tolerating;
    rough.verify.force_rms_n = Some(60.0);
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
        [
            parameters.cart_mass_percent,
            parameters.link_mass_percent.of_joint(0),
            parameters.link_mass_percent.of_joint(1),
        ]
    };
    assert_eq!(masses(&machines[0]), [-5.0, -5.0, -5.0]);
    assert_eq!(masses(&machines[6]), [-5.0, 5.0, 5.0]);
    for (number, machine) in machines.iter().enumerate() {
        assert_eq!(machine.reality.friction.joint_friction_n_m.of_joint(1), 3e-3);
        assert!(masses(machine).iter().all(|percent| percent.abs() == 5.0));
        assert!(!machines[..number].contains(machine), "{number}");
    }
    // A stepper does not feel the mass of its cart.
    let stepper = Rig { robust: tolerating.robust.clone(), ..rig("double-stepper") };
    let machines: Vec<Rig> = (0..4).map(|number| corner_machine(&stepper, number)).collect();
    assert_eq!(Machines::Corners.count(&stepper), 4);
    assert_eq!(
        [0, 1, 2, 3].map(|number: usize| masses(&machines[number])),
        [[0.0, -5.0, -5.0], [0.0, 5.0, -5.0], [0.0, -5.0, 5.0], [0.0, 5.0, 5.0]]
    );
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
fn friction_that_the_file_tolerates_is_no_alarm_and_for_stricter_tests_it_is() {
    let mut sticking = tolerating("single-quanser-ip02", 5.0, 3e-2);
    sticking.reality.friction.joint_friction_n_m = PerJoint::all(3e-2);
    let found = nominal(&sticking, Law::Lqr, 1, 20.0 / 3600.0);
    assert_eq!((&found.fault, found.rejected), (&None, 0), "{found:?}");
    // Negative control: a fifth of the thresholds.
    let found = balance(&sticking, &stricter_table(&sticking), Law::Lqr, 1, 20.0).unwrap();
    assert!(found.fault.is_some(), "{found:?}");
}

#[test]
fn thresholds_follow_from_the_tolerances_and_are_at_least_those_of_a_typical_machine() {
    let typical = table(&rig("quadruple-paper")).thresholds;
    // Less than typical changes nothing.
    assert_eq!(table(&tolerating("quadruple-paper", 1.0, 1e-5)).thresholds, typical);
    let wider = table(&tolerating("quadruple-paper", 10.0, 5e-4)).thresholds;
    let by =
        |wide: &[f32], least: &[f32]| wide.iter().zip(least).take(5).map(|(a, b)| a / b).fold(0.0, f32::max);
    let found = [by(&wider.innovation, &typical.innovation), by(&wider.frozen, &typical.frozen)];
    println!("wider by {found:?}, energy by {}", wider.motor.energy / typical.motor.energy);
    assert!(found.iter().all(|by| (1.01..4.0).contains(by)), "{found:?}");
    // By hand: link 4 carries least, 0.1 kg · 9.81 m/s² · 0.05 m; 0.5 kg are on the rail.
    let tolerances = rig("quadruple-paper").detection_tolerances().unwrap();
    assert!((tolerances.joint_friction_n_m - 0.003 * 0.04905).abs() < 1e-9, "{tolerances:?}");
    assert!((tolerances.cart_friction_n - 0.05 * 4.905).abs() < 1e-9, "{tolerances:?}");
}
