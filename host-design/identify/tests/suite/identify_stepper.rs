//! Identification of machines whose drive imposes the cart's motion.

use std::path::{Path, PathBuf};

use upright_closed_loop::harness::with_firmware;
use upright_design::design::design;
use upright_design::plant::ChainParameters;
use upright_design::reality::real_chain;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_identify::{
    Doubt, DriveScale, Identification, IdentifyError, Log, ParameterKind, Settings, WiringFault, identify,
    shake, shake_with,
};

/// A machine whose shape and frictions are not those of the file.
const REALITY: &str = "[reality]\njoint_friction_n_m = [6e-4, 2e-4]\nhoming_error_rad = [0.006, -0.004]\n\
    rail_tilt_rad = 0.003\nlink_mass_percent = [-9, 7]\nlink_length_percent = [5, -8]\nlink_inertia_percent = [10, -10]\n";

fn rig(name: &str, reality: &str) -> Rig {
    let file = format!("../../rigs/{name}-stepper.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    Rig::from_toml(&format!("{text}\n{reality}"), Path::new(&file)).unwrap()
}

fn run(rig: &Rig, log: &Log, trust_wiring: bool) -> Result<Identification, IdentifyError> {
    let settings = Settings { trust_wiring, ..Settings::default() };
    identify(rig, &[(PathBuf::from("run.log"), log.clone())], &settings, &|_| ())
}

/// The log with other counts and pulses of the drive, both times `factor`, and with another travel per pulse (m).
fn with_drive(log: &Log, [counts, pulses]: [i64; 2], step_m: f64) -> Log {
    let header = upright_identify::LogHeader { drive: DriveScale::Steps(step_m), ..log.header.clone() };
    let mut other = Log::new(header);
    for (index, (tick, row)) in log.ticks().iter().zip(log.deviations().chunks(log.channels())).enumerate() {
        let mut row_counts = log.counts(index).to_vec();
        row_counts[0] = (counts * row[0]) as u16;
        other.push(upright_identify::Tick { drive: pulses as i16 * tick.drive, ..*tick }, &row_counts);
    }
    other
}

fn step_m(rig: &Rig) -> f64 {
    rig.actuator.pulses().unwrap().step_m
}

#[test]
fn shape_friction_and_zeros_are_found_as_ratios_and_nothing_of_the_cart() {
    let (truth, file) = (rig("double", REALITY), rig("double", ""));
    let log = shake(&file_as(&truth, &file), 15.0, 3).unwrap();
    let found = run(&file, &log, true).unwrap();
    assert_eq!(found.refusal, None, "{found:?}");
    assert!(found.is_moved && found.channels.len() == 2);
    let unseen = [
        ParameterKind::TotalMass,
        ParameterKind::CartViscous,
        ParameterKind::CartDry,
        ParameterKind::FirstMoment(1),
        ParameterKind::Delay,
    ];
    assert!(unseen.iter().all(|kind| found.estimate(*kind).is_none()), "{:?}", found.estimates);
    let real = real_chain(truth.chain().unwrap(), &truth.reality.parameters);
    let constants = ChainParameters::<f64>::of(&real);
    let of_file = ChainParameters::<f64>::of(file.chain().unwrap());
    let scale = of_file.a[1] / constants.a[1];
    let within = |kind: ParameterKind, wanted: f64, most: f64| {
        let estimate = found.estimate(kind).unwrap();
        let error = (estimate.new - wanted).abs();
        println!("{kind:?}: {error:.2e} of {most:.2e}, deviation {:.2e}", estimate.deviation);
        assert!(error < most, "{kind:?}: {} instead of {wanted}", estimate.new);
        assert!(error < 4.0 * estimate.deviation, "{kind:?}: {error} with deviation {}", estimate.deviation);
    };
    within(ParameterKind::FirstMoment(0), scale * constants.a[0], 2e-3 * scale * constants.a[0]);
    within(ParameterKind::Length(0), real.links[0].length_m, 2e-3 * real.links[0].length_m);
    for j in 0..2 {
        let second = scale * constants.b[(j, j)];
        within(ParameterKind::SecondMoment(j), second, 1e-3 * second);
        within(ParameterKind::JointViscous(j), scale * 0.0024, 0.05 * scale * 0.0024);
        within(ParameterKind::Zero(j), truth.reality.sensors.homing_error_rad.of_joint(j), 1e-4);
    }
    within(ParameterKind::Tilt, 0.003, 0.003);
    // What is not seen stays as in the file.
    let realised = found.realised.unwrap();
    assert_eq!(realised.cart, None);
    for channel in &found.channels {
        // The new numbers leave only the steps of the encoder.
        assert!(channel.held_out[0] > 3.0 * channel.held_out[1], "{:?}", channel.held_out);
    }
}

/// The machine of `truth`, under the name of the file.
fn file_as(truth: &Rig, file: &Rig) -> Rig {
    Rig { name: file.name.clone(), ..truth.clone() }
}

#[test]
fn a_log_of_another_drive_and_one_that_miscounts_its_pulses_are_refused_by_name() {
    let file = rig("single", "");
    let log = shake(&file, 8.0, 1).unwrap();
    assert!(run(&file, &log, true).is_ok());
    let refused = |log: &Log, words: &str| {
        let error = run(&file, log, true).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    let mut force = log.clone();
    force.header.drive = DriveScale::Force(10.0);
    refused(&force, "a machine that commands forces, the rig file is with kind = \"acceleration\"");
    refused(&with_drive(&log, [1, 1], 1e-4), "100 µm per pulse, the rig file is for 50 µm");
    refused(&with_drive(&log, [-1, 1], step_m(&file)), "its counts run against its pulses");
    refused(&with_drive(&log, [2, 1], step_m(&file)), "not counted, or counted too often");
    // And a stepper's log is none of a machine with a motor.
    let motor = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref()).unwrap();
    let of_force = shake(&motor, 8.0, 1).unwrap();
    assert!(matches!(run(&file, &of_force, true), Err(IdentifyError::OtherRig { .. })));
}

#[test]
fn a_cart_that_moves_against_its_pulses_and_a_wrong_step_are_named() {
    let file = rig("double", "");
    let log = shake(&file, 8.0, 1).unwrap();
    let best = |log: &Log| {
        let wiring = run(&file, log, false).unwrap().wiring.unwrap();
        (wiring.best.faults.clone(), wiring.best.to_string())
    };
    assert_eq!(best(&log).0, []);
    let (faults, words) = best(&with_drive(&log, [-1, -1], step_m(&file)));
    assert_eq!(faults, [WiringFault::DriveReversed]);
    assert!(words.contains("the cart moves against its pulses"), "{words}");
    let (faults, words) = best(&with_drive(&log, [2, 2], step_m(&file)));
    assert_eq!(faults, [WiringFault::Step(0.5)]);
    assert!(words.contains("0.5 times step_m"), "{words}");
}

#[test]
fn a_step_that_is_a_little_too_long_is_told_and_a_right_one_is_not() {
    let file = rig("single", "");
    let travel = |step: f64| {
        let mut machine = file.clone();
        machine.actuator.pulses_mut().unwrap().step_m *= step;
        let log = with_drive(&shake(&machine, 15.0, 1).unwrap(), [1, 1], step_m(&file));
        let found = run(&file, &log, true).unwrap();
        found.doubts.iter().find_map(|doubt| match doubt {
            Doubt::Travel { share, .. } => Some(*share),
            _ => None,
        })
    };
    assert_eq!(travel(1.0), None);
    let found = travel(1.03).unwrap();
    assert!((found - 1.03).abs() < 2e-3, "{found}");
}

#[test]
fn the_firmware_shakes_within_the_limits_of_the_drive_and_its_log_identifies_the_machine() {
    for name in ["single", "double"] {
        let (file, machine) = (rig(name, ""), rig(name, "[reality]\nlink_inertia_percent = 8\n"));
        let certified = design(&file).unwrap();
        let table = TableValues::of(&file, &certified, Gains::Sampled).unwrap();
        let log = with_firmware(&table, |target| shake_with(&machine, &table, target, 10.0, 1)).unwrap();
        let log = log.unwrap();
        let (drive, period_s) = (file.actuator.pulses().unwrap(), file.tick.period_s);
        let speeds: Vec<f64> =
            log.ticks().iter().map(|tick| log.drive(tick) * drive.step_m / period_s).collect();
        // A tick has up to a pulse more than its speed needs, one of two after each other up to two.
        let pulse = drive.step_m / period_s;
        let fastest = speeds.iter().fold(0.0, |most: f64, speed| most.max(speed.abs()));
        assert!(fastest <= drive.speed_limit_m_per_s.unwrap() + pulse, "{name}: {fastest}");
        let most = speeds.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let limit = drive.acceleration_limit_m_per_s2 * period_s + 2.0 * pulse;
        assert!(most > 0.05 * limit && most <= limit, "{name}: {most} of {limit}");
        let file = Rig { name: machine.name.clone(), ..file };
        let mut log = log;
        log.header.hash = file.hash();
        let found = run(&file, &log, true).unwrap();
        assert_eq!(found.refusal, None, "{name}");
        assert!(found.largest_angle_rad > 0.5, "{name}: {}", found.largest_angle_rad);
        let last = file.links() - 1;
        let inertia = found.estimate(ParameterKind::SecondMoment(last)).unwrap();
        let real = real_chain(machine.chain().unwrap(), &machine.reality.parameters);
        let wanted = ChainParameters::<f64>::of(&real).b[(last, last)];
        assert!((inertia.new / wanted - 1.0).abs() < 2e-3, "{name}: {} {wanted}", inertia.new);
    }
}
