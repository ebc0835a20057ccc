//! What `verify` says of a machine is what the whole firmware does on it, from power-up on.

use crate::published::{rig, rig_and_table, rig_path};
use upright::table::Law;
use upright_design::harness::{record, with_firmware};
use upright_design::rig::{PerJoint, Rig};
use upright_design::simulate::FallKind;
use upright_design::swing_up::{Stored, SwingUpError, judge};
use upright_design::table::TableValues;
use upright_design::verify::{
    IMPERFECTIONS, Imperfection, ImperfectionSettings, Survival, at_rest_disturbed, survival,
};

/// A size that is printed may differ by this share from the one at which the whole firmware turns the motor off.
const TOLERANCE: f64 = 0.2;

fn imperfection(key: &str) -> &'static Imperfection {
    IMPERFECTIONS.iter().find(|one| one.key == key).unwrap()
}

fn found(law: Law, key: &str) -> Survival {
    let (rig, table) = rig_and_table("quadruple-paper");
    survival(rig, table, law, &ImperfectionSettings::of(rig), imperfection(key)).unwrap()
}

/// Whether the whole firmware balances this machine for 10 s in all of 4 runs.
fn stays_on(machine: &Rig, table: &TableValues, law: Law) -> bool {
    (1..=4).all(|seed| {
        let scenario = at_rest_disturbed(machine, law, seed);
        let recording = with_firmware(table, |target| record(machine, table, &scenario, target)).unwrap();
        recording.is_ok_and(|recording| recording.fault.is_none())
    })
}

/// The machine with this imperfection alone.
fn machine(key: &str, size: f64) -> Rig {
    let (rig, _) = rig_and_table("quadruple-paper");
    imperfection(key).on(rig, size)
}

/// The size from which the whole firmware turns the motor off, by bisection to within a twentieth.
fn turned_off_at(law: Law, key: &str, near: f64) -> f64 {
    let (_, table) = rig_and_table("quadruple-paper");
    let (mut held, mut lost) = (near / 3.0, 3.0 * near);
    while lost > 1.05 * held {
        let middle = (held * lost).sqrt();
        if stays_on(&machine(key, middle), table, law) { held = middle } else { lost = middle }
    }
    lost
}

#[test]
fn the_size_that_verify_prints_is_the_one_at_which_the_whole_firmware_turns_the_motor_off() {
    for key in ["cart_friction_n", "homing_error_rad", "backlash_m", "rail_tilt_rad", "driver_lag_s"] {
        for law in Law::ALL {
            let found = found(law, key);
            let printed = found.turned_off_at.unwrap();
            let measured = turned_off_at(law, key, printed);
            println!(
                "{law} {key}: {printed:.3e} {measured:.3e} {:?} falls {:?}",
                found.ended_by, found.falls_at
            );
            assert!((printed / measured - 1.0).abs() < TOLERANCE, "{law} {key}: {printed} {measured}");
            assert!(matches!(found.ended_by, Some(FallKind::MotorOff(_))), "{law} {key}: {found:?}");
        }
    }
}

/// Negative control: without detection the firmware does not agree.
#[test]
fn a_firmware_without_detection_stays_on_with_a_size_at_which_verify_says_that_it_does_not() {
    let (_, table) = rig_and_table("quadruple-paper");
    let mut without = table.clone();
    without.thresholds.innovation.iter_mut().for_each(|threshold| *threshold = f32::MAX);
    without.thresholds.frozen.iter_mut().for_each(|threshold| *threshold = f32::MAX);
    without.thresholds.motor.energy = f32::MAX;
    let printed = found(Law::Lqr, "cart_friction_n").turned_off_at.unwrap();
    let machine = machine("cart_friction_n", (1.0 + TOLERANCE) * printed);
    assert!(!stays_on(&machine, table, Law::Lqr));
    assert!(stays_on(&machine, &without, Law::Lqr));
}

#[test]
fn a_swing_up_that_detection_ends_names_the_fault_and_the_tolerances_that_cure_it() {
    let mut rig = rig("double-quanser-dbpen");
    // More than twice what fault detection tolerates of this rig in any case.
    rig.reality.friction.cart_friction_n = 1.2;
    rig.reality.friction.joint_friction_n_m = PerJoint::all(5e-4);
    let stored = Stored::beside(&rig_path("double-quanser-dbpen")).unwrap();
    let Err(SwingUpError::NotRobust { arrived, help, .. }) = judge(&rig, &stored, &|_| ()) else {
        panic!("enough arrive");
    };
    assert_eq!(arrived, 116);
    let (fault, cure) = help.split_once("; ").unwrap();
    assert!(fault.starts_with("fault motor ended 40"), "{help}");
    assert!(cure.starts_with("156 of 200 arrive with robust.cart_friction_n = 1.2; "), "{help}");
}
