//! What is not as the file says is found, or doubted: travel per count of the cart, air drag, errors of absolute
//! sensors, halves of a log that contradict each other, and a new file that says something else.

use std::path::{Path, PathBuf};

use upright_design::rig::Rig;
use upright_identify::{
    Doubt, Identification, Log, ParameterKind, Recordings, Settings, identify, identify_recordings, shake,
};

/// A cart that a force moves, with a link and a cheap absolute sensor.
const RIG: &str = "name = \"one\"\n[cart]\nmass_kg = 0.6\nfriction_n_s_per_m = 2\ntravel_m = [-0.4, 0.4]\n\
    encoder_step_m = 2e-5\n[[link]]\nmass_kg = 0.1\nlength_m = 0.3\nfriction_n_m_s_per_rad = 2e-4\n\
    sensor_bits = 12\nsensor_zero_counts = 100\nsensor_noise_rad = 1e-3\n[actuator]\nforce_limit_n = 10\n\
    [tick]\nperiod_s = 0.002\n[lqr]\nstate_weights = [100, 1, 100, 1]\nforce_weight = 0.1\n\
    [kalman]\nforce_noise_n2_s = 2e-4\njoint_noise = [1e-8]\n[reality]\njoint_friction_n_m = 2e-4\ncart_friction_n = 0.3\n";

fn rig(text: &str) -> Rig {
    Rig::from_toml(text, Path::new("one.toml")).unwrap()
}

fn run(file: &Rig, log: &Log) -> Identification {
    let settings = Settings { trust_wiring: true, ..Settings::default() };
    identify(file, &[(PathBuf::from("run.log"), log.clone())], &settings, &|_| ()).unwrap()
}

/// Error of an estimate in its deviations.
fn off(found: &Identification, kind: ParameterKind, wanted: f64) -> f64 {
    let estimate = found.estimate(kind).unwrap();
    println!("{kind:?}: {} ± {}, {wanted}", estimate.new, estimate.deviation);
    (estimate.new - wanted).abs() / estimate.deviation
}

/// Frictions and total mass of the machine of [`RIG`].
const FRICTIONS: [(ParameterKind, f64); 5] = [
    (ParameterKind::TotalMass, 0.7),
    (ParameterKind::CartViscous, 2.0),
    (ParameterKind::CartDry, 0.3),
    (ParameterKind::JointViscous(0), 2e-4),
    (ParameterKind::JointDry(0), 2e-4),
];

#[test]
fn a_cart_sensor_with_another_travel_per_count_is_found_doubted_and_not_written_into_masses() {
    let log = shake(&rig(RIG), 10.0, 1).unwrap();
    let travel_of = |found: &Identification| {
        found.doubts.iter().find_map(|doubt| match doubt {
            Doubt::Travel { share, .. } => Some(*share),
            _ => None,
        })
    };
    let wrong = rig(&RIG.replace("encoder_step_m = 2e-5", "encoder_step_m = 2.4e-5"));
    let found = run(&wrong, &log);
    let share = travel_of(&found).unwrap();
    assert!((share * 1.2 - 1.0).abs() < 5e-3 && found.doubted().is_some(), "{share}");
    assert!(FRICTIONS.iter().all(|(kind, wanted)| off(&found, *kind, *wanted) < 4.0), "{found:?}");
    // The negative control: nothing is doubted of a file that is right.
    let found = run(&rig(RIG), &log);
    assert_eq!((travel_of(&found), found.doubted()), (None, None));
    let mass = found.estimate(ParameterKind::TotalMass).unwrap();
    assert!(mass.deviation < 0.005 * mass.new, "{mass:?}");
}

#[test]
fn air_drag_and_an_error_twice_per_turn_that_the_file_does_not_have_are_not_written_into_frictions() {
    let more =
        "air_drag_n_m_s2_per_rad2 = 1.4e-5\ntwice_per_turn_rad = 0.04\ntwice_per_turn_phase_rad = 0.5\n";
    let log = shake(&rig(&format!("{RIG}{more}")), 10.0, 2).unwrap();
    let found = run(&rig(RIG), &log);
    assert_eq!(found.refusal, None);
    let wanted = [
        (ParameterKind::AirDrag(0), 1.4e-5),
        (ParameterKind::TwiceSine(0), 0.04 * 0.5f64.cos()),
        (ParameterKind::TwiceCosine(0), 0.04 * 0.5f64.sin()),
    ];
    for (kind, wanted) in wanted.into_iter().chain(FRICTIONS) {
        assert!(off(&found, kind, wanted) < 4.0, "{kind:?}");
    }
    // The negative control: the intervals are not so wide that they would cover anything.
    let deviation = |kind| found.estimate(kind).unwrap().deviation;
    assert!(deviation(ParameterKind::AirDrag(0)) < 7e-6 && deviation(ParameterKind::TwiceSine(0)) < 0.004);
}

#[test]
fn a_joint_that_slips_within_the_log_makes_its_halves_contradict_each_other() {
    let log = shake(&rig(RIG), 10.0, 1).unwrap();
    let mut slipped = Log::new(log.header.clone());
    for (index, tick) in log.ticks().iter().enumerate() {
        let mut counts = log.counts(index).to_vec();
        // 1° of 12 bits.
        counts[1] = counts[1].wrapping_add(if index > 2000 { 11 } else { 0 });
        slipped.push(*tick, &counts);
    }
    let contradicts = |found: &Identification| {
        found.doubts.iter().any(
            |doubt| matches!(doubt, Doubt::Halves { kinds, .. } if kinds.contains(&ParameterKind::Zero(0))),
        )
    };
    let found = run(&rig(RIG), &slipped);
    assert!(contradicts(&found), "{:?}", found.doubts);
    assert!(!contradicts(&run(&rig(RIG), &log)), "the negative control");
}

/// A force has no key that a weighing could scale with the masses: the new file would move too little.
#[test]
fn a_new_file_that_does_not_say_what_was_found_is_doubted() {
    let (file, log) = (rig(RIG), shake(&rig(RIG), 10.0, 1).unwrap());
    let logs = Recordings::Logs(vec![(PathBuf::from("run.log"), log)]);
    let with = |weighed_kg_m: Option<f64>| {
        let settings = Settings { trust_wiring: true, weighed_kg_m, ..Settings::default() };
        let found = identify_recordings(&file, Some(RIG), &logs, None, &settings, &|_| ()).unwrap();
        let is_doubted = found.doubts.iter().any(|doubt| matches!(doubt, Doubt::Rewritten { .. }));
        (is_doubted || found.refusal.is_some(), found.channels[0].held_out[1])
    };
    let (as_found, weighed) = (with(None), with(Some(0.03)));
    assert!(!as_found.0 && weighed.0, "{as_found:?} {weighed:?}");
    // What is printed is the error of the file.
    assert!(weighed.1 > 5.0 * as_found.1, "{as_found:?} {weighed:?}");
}
