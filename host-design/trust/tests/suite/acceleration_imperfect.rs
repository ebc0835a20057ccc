//! Imperfect machines whose drive takes pulses.

use std::path::Path;

use upright::control::actuator::Drive;
use upright::table::Law;
use upright_design::rig::{IMPERFECTIONS, Imperfection, Rig};
use upright_design::simulate::{Bench, FallKind, Scenario};
use upright_trust::verify::{ImperfectionSettings, SizeRuns, imperfections, of_size};

use crate::published::{rig, rig_path, table};

fn settings(rig: &Rig) -> ImperfectionSettings {
    ImperfectionSettings { duration_s: 5.0, seeds: 1, relative: 0.5, ..ImperfectionSettings::of(rig) }
}

fn named(key: &str) -> &'static Imperfection {
    IMPERFECTIONS.iter().find(|one| one.key == key).unwrap()
}

fn with(rig: &Rig, key: &str, size: f64) -> SizeRuns {
    of_size(rig, &table(rig), Law::Lqr, &settings(rig), named(key), size).unwrap()
}

/// The single with a motor behind its pulses, and with these further sections.
fn with_motor(further: &str) -> Rig {
    let text = std::fs::read_to_string(rig_path("single-stepper")).unwrap();
    let text = text.replacen("[cart]", "[cart]\nmass_kg = 0.3", 1);
    let motor = "[reality]\nholding_force_n = 30\nfull_step_m = 2e-4\n";
    Rig::from_toml(&format!("{text}\n{motor}\n{further}"), Path::new("rig.toml")).unwrap()
}

#[test]
fn every_imperfection_of_a_stepper_has_a_size_or_a_reason() {
    let rig = rig("double-stepper");
    let found = imperfections(&rig, &table(&rig), Law::Lqr, &settings(&rig), &|| ()).unwrap();
    let of = |key: &str| found.alone.iter().find(|one| one.imperfection.key == key).unwrap();
    assert_eq!((found.alone.len(), found.left_out.len()), (7, 6));
    let falls_at = of("joint_friction_n_m").falls_at.unwrap();
    assert!((1e-3..1e-2).contains(&falls_at), "{falls_at}");
    let eccentric = of("eccentricity_rad");
    assert!(matches!(eccentric.ended_by, Some(FallKind::MotorOff(_))), "{eccentric:?}");
    assert!(eccentric.turned_off_at < eccentric.falls_at);
    // The noise of a drive that goes where its pulses say is 0, and a hundred times that is no change.
    assert!(eccentric.tried.iter().any(|change| change.ends_with("kalman.joint_noise")), "{eccentric:?}");
    let impossible = ["acceleration_noise", "cart_friction_n"];
    assert!(impossible.iter().all(|word| !eccentric.tried.iter().any(|change| change.contains(word))));
}

/// No force on the cart moves the links of a stepper, and friction holds them up to an encoder's count.
#[test]
fn links_that_stick_do_not_pass_for_links_that_are_balanced() {
    let rig = rig("quadruple-stepper");
    assert_eq!(with(&rig, "joint_friction_n_m", 1e-2).survived, 0);
    assert_eq!(with(&rig, "joint_friction_n_m", 1e-6).stayed_on, 1, "negative control");
}

#[test]
fn friction_of_the_cart_changes_nothing_before_the_motor_slips() {
    let friction = named("cart_friction_n");
    assert!(friction.not_on(&rig("single-stepper")).is_some());
    let motor = with_motor("[verify]\ncart_friction_n = 10");
    assert_eq!((friction.not_on(&motor), &motor.must_survive[..]), (None, &[(friction, 10.0)][..]));
    assert!(format!("{motor:?}").contains("must_survive: [(cart_friction_n, 10.0)]"));
    assert_eq!(with(&motor, "cart_friction_n", 10.0).stayed_on, 1);
    assert_eq!(with(&motor, "cart_friction_n", 100.0).stayed_on, 0, "negative control");
}

#[test]
fn the_cart_of_a_late_drive_moves_a_tick_after_its_pulses() {
    let prompt = rig("single-stepper");
    let mut late = prompt.clone();
    late.tick.delay_ticks = 1;
    let moved = |rig: &Rig| {
        let mut bench = Bench::new(rig, &Scenario::at_rest(rig, Law::Lqr)).unwrap();
        [10, 0, 0].map(|pulses| {
            bench.tick(Drive::Steps(pulses));
            ((bench.state()[0] / 5e-5).round() as i64, bench.counters::<2>()[0])
        })
    };
    assert_eq!(moved(&prompt), [(10, 10), (10, 10), (10, 10)]);
    assert_eq!(moved(&late), [(0, 10), (10, 10), (10, 10)]);
}
