//! Identification of simulated machines that differ from the rig file.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use upright_design::plant::ChainParameters;
use upright_design::reality::real_chain;
use upright_design::rig::Rig;
use upright_identify::{
    Doubt, Excitation, Identification, IdentifyError, Log, ParameterKind, Refusal, Settings, WiringFault,
    identify, shake,
};

const FILE: &str = "../../rigs/double-quanser-dbpen.toml";

/// A machine that differs from the file in everything that is identified.
const REALITY: &str = "[reality]\njoint_friction_n_m = [1.5e-3, 1e-3]\ncart_friction_n = 0.2\n\
    homing_error_rad = [0.006, -0.004]\nrail_tilt_rad = 0.003\nlatency_s = 4e-4\ncart_mass_percent = 8\n\
    link_mass_percent = [-9, 7]\nlink_length_percent = [5, -8]\nlink_inertia_percent = [10, -10]\n";

fn rig(reality: &str) -> Rig {
    let text = std::fs::read_to_string(FILE).unwrap();
    Rig::from_toml(&format!("{text}\n{reality}"), Path::new(FILE)).unwrap()
}

/// 15 s of the machine, recorded once.
fn log() -> &'static Log {
    static LOG: OnceLock<Log> = OnceLock::new();
    LOG.get_or_init(|| shake(&rig(REALITY), 15.0, 3).unwrap())
}

fn run(rig: &Rig, log: &Log, settings: &Settings) -> Result<Identification, IdentifyError> {
    identify(rig, &[(PathBuf::from("run.log"), log.clone())], settings, &|_| ())
}

const TRUSTED: Settings = Settings {
    eccentricity: false,
    weighed_kg_m: None,
    trust_wiring: true,
    trust_numbers: false,
    without_drag: false,
    without_dry: false,
};

/// The log with each row of deviations from hanging (counts) changed.
fn rewired(log: &Log, change: impl Fn(&mut [i64])) -> Log {
    let mut other = Log::new(log.header.clone());
    for (tick, row) in log.ticks().iter().zip(log.deviations().chunks(log.channels())) {
        let mut row = row.to_vec();
        change(&mut row);
        let counts: Vec<u16> = row
            .iter()
            .zip(&log.header.hanging)
            .map(|(row, hanging)| hanging.wrapping_add(*row as u16))
            .collect();
        other.push(*tick, &counts);
    }
    other
}

#[test]
fn the_parameters_of_a_double_pendulum_are_found_with_their_deviations() {
    let (truth, file) = (rig(REALITY), rig(""));
    let found = run(&file, log(), &TRUSTED).unwrap();
    assert_eq!(found.refusal, None, "{found:?}");
    let chain = truth.chain().unwrap();
    let real = real_chain(chain, &truth.reality.parameters);
    let constants = ChainParameters::<f64>::of(&real);
    let of = |kind: ParameterKind| found.estimate(kind).unwrap();
    let within = |kind: ParameterKind, wanted: f64, most: f64| {
        let estimate = of(kind);
        let error = (estimate.new - wanted).abs();
        assert!(error < most, "{kind:?}: {} instead of {wanted}", estimate.new);
        assert!(error < 4.0 * estimate.deviation, "{kind:?}: {error} with deviation {}", estimate.deviation);
    };
    // The ratios that make up the shape are known much better than the common scale.
    let ratio = |one: ParameterKind, other: ParameterKind| of(one).new / of(other).new;
    let shape = ratio(ParameterKind::FirstMoment(0), ParameterKind::FirstMoment(1))
        / (constants.a[0] / constants.a[1]);
    assert!((shape - 1.0).abs() < 1e-3, "{shape}");
    within(ParameterKind::Length(0), real.links[0].length_m, 1e-3 * real.links[0].length_m);
    for j in 0..2 {
        within(ParameterKind::FirstMoment(j), constants.a[j], 0.01 * constants.a[j]);
        within(ParameterKind::SecondMoment(j), constants.b[(j, j)], 0.01 * constants.b[(j, j)]);
        within(ParameterKind::Zero(j), truth.reality.sensors.homing_error_rad.of_joint(j), 0.0009);
        within(ParameterKind::JointViscous(j), 0.0024, 0.00024);
    }
    within(ParameterKind::TotalMass, constants.total_mass, 0.02 * constants.total_mass);
    within(ParameterKind::Tilt, 0.003, 0.001);
    // The old file predicts the held-out samples at least five times worse.
    for channel in &found.channels {
        assert!(channel.held_out[0] > 5.0 * channel.held_out[1], "{channel:?}");
    }
    // The masses that were chosen add up to the total mass that was identified.
    let realised = found.realised.unwrap();
    let total: f64 =
        realised.cart.unwrap().mass_kg + realised.links.iter().map(|link| link.mass_kg).sum::<f64>();
    assert!((total - of_total(&found.estimates)).abs() < 1e-9);
}

/// Readings that are 4 ms old look like frictions that are negative.
#[test]
fn readings_that_are_old_are_known_if_the_file_states_their_age() {
    let with = |delay_s: f64, reality: &str| {
        let mut rig = rig(reality);
        rig.chain_mut().unwrap().links.iter_mut().for_each(|link| link.sensor_delay_s = delay_s);
        rig
    };
    let (truth, file) = (with(4e-3, REALITY), with(4e-3, ""));
    let mut log = shake(&truth, 15.0, 3).unwrap();
    let constants =
        ChainParameters::<f64>::of(&real_chain(truth.chain().unwrap(), &truth.reality.parameters));
    let dry = |j: usize| truth.reality.friction.joint_friction_n_m.of_joint(j);
    // Errors in deviations.
    let errors = |found: &Identification| {
        let error = |(kind, wanted): (ParameterKind, f64)| {
            let estimate = found.estimate(kind).unwrap();
            println!("{kind:?}: {} ± {}, {wanted}", estimate.new, estimate.deviation);
            (estimate.new - wanted).abs() / estimate.deviation
        };
        [
            (ParameterKind::TotalMass, constants.total_mass),
            (ParameterKind::Length(0), constants.b[(0, 1)] / constants.a[1]),
            (ParameterKind::JointViscous(0), 0.0024),
            (ParameterKind::JointViscous(1), 0.0024),
            (ParameterKind::JointDry(0), dry(0)),
            (ParameterKind::JointDry(1), dry(1)),
        ]
        .map(error)
    };
    let found = run(&file, &log, &TRUSTED).unwrap();
    assert_eq!(found.refusal, None, "{found:?}");
    assert!(errors(&found).iter().all(|&error| error < 4.0), "{found:?}");
    // Negative control: a file that does not state it.
    let silent = rig("");
    log.header.hash = silent.hash();
    let found = run(&silent, &log, &TRUSTED).unwrap();
    println!("{:?} {:?}", found.refusal, found.doubts);
    let is_negative = |doubt: &Doubt| matches!(doubt, Doubt::Negative { .. });
    assert!(found.doubts.iter().any(is_negative), "{:?}", found.doubts);
}

#[test]
fn a_force_that_follows_late_is_known_if_the_file_states_its_lag() {
    let with = |lag_s: f64, reality: &str| {
        let mut rig = rig(reality);
        rig.actuator.force_mut().unwrap().lag_s = Some(lag_s);
        rig
    };
    let (truth, file) = (with(4e-3, REALITY), with(4e-3, ""));
    let log = shake(&truth, 15.0, 3).unwrap();
    let found = run(&file, &log, &TRUSTED).unwrap();
    assert_eq!(found.refusal, None, "{found:?}");
    let of = |found: &Identification, kind| {
        let estimate = found.estimate(kind).unwrap();
        (estimate.new, estimate.deviation)
    };
    let constants =
        ChainParameters::<f64>::of(&real_chain(truth.chain().unwrap(), &truth.reality.parameters));
    let (mass_kg, deviation_kg) = of(&found, ParameterKind::TotalMass);
    assert!((mass_kg - constants.total_mass).abs() < 4.0 * deviation_kg, "{mass_kg}");
    // The latency of 0.4 ms in ticks, and nothing of the lag.
    let (delay, deviation) = of(&found, ParameterKind::Delay);
    assert!((delay - 0.4).abs() < 4.0 * deviation && deviation < 0.1, "{delay} ± {deviation}");
    // Negative control: without the lag in the file, it is found as a delay.
    let unstated = run(&rig(""), &log, &TRUSTED).unwrap();
    assert!(of(&unstated, ParameterKind::Delay).0 > 1.5, "{unstated:?}");
}

fn of_total(estimates: &[upright_identify::Estimate]) -> f64 {
    estimates.iter().find(|estimate| estimate.kind == ParameterKind::TotalMass).unwrap().new
}

#[test]
fn faults_of_the_wiring_are_named() {
    let file = rig("");
    let first = |log: &Log| {
        let found = run(&file, log, &Settings::default()).unwrap();
        (found.wiring.unwrap().best.faults, found.refusal, found.estimates.len())
    };
    use WiringFault::{Counts, MotorReversed, Reversed, Swapped};
    let faults: [(&[WiringFault], Log); 5] = [
        (&[Swapped(1, 2)], rewired(log(), |row| row.swap(1, 2))),
        (&[Counts(2, 3.0)], rewired(log(), |row| row[2] *= 3)),
        (&[MotorReversed], rewired(log(), |row| row.iter_mut().for_each(|count| *count = -*count))),
        (
            &[Reversed(1), Reversed(2)],
            rewired(log(), |row| row[1..].iter_mut().for_each(|count| *count = -*count)),
        ),
        (&[Reversed(2), Counts(1, 2.0)], rewired(log(), |row| [row[1], row[2]] = [2 * row[1], -row[2]])),
    ];
    for (wiring, log) in faults {
        let (best, refusal, estimates) = first(&log);
        assert_eq!(best, wiring);
        assert!(matches!(refusal, Some(Refusal::Wiring(_))), "{wiring:?}");
        assert_eq!(estimates, 0);
    }
}

#[test]
fn logs_that_say_nothing_are_refused() {
    let file = rig("");
    let still = rewired(log(), |row| row[2] = 0);
    assert_eq!(run(&file, &still, &TRUSTED), Err(IdentifyError::Still("joint 2".to_owned())));
    let mut short = Log::new(log().header.clone());
    log().ticks()[..3000].iter().enumerate().for_each(|(at, tick)| short.push(*tick, log().counts(at)));
    assert!(matches!(run(&file, &short, &TRUSTED), Err(IdentifyError::TooShort { .. })));
    // Readings that are older than the log.
    let text =
        std::fs::read_to_string(FILE).unwrap().replacen("[[link]]", "[[link]]\nsensor_delay_s = 99", 1);
    let old = Rig::from_toml(&text, Path::new(FILE)).unwrap();
    assert!(matches!(run(&old, log(), &TRUSTED), Err(IdentifyError::TooShort { .. })));
    for name in ["single-quanser-ip02", "triple-glueck-eder-kugi"] {
        let other = Rig::from_path(Path::new(&format!("../../rigs/{name}.toml"))).unwrap();
        assert!(matches!(run(&other, log(), &TRUSTED), Err(IdentifyError::OtherRig { .. })));
    }
    let text = std::fs::read_to_string(FILE).unwrap().replace("period_s = 0.001", "period_s = 0.002");
    let slower = Rig::from_toml(&text, Path::new(FILE)).unwrap();
    assert!(matches!(run(&slower, log(), &TRUSTED), Err(IdentifyError::OtherRig { .. })));
}

#[test]
fn a_log_that_no_machine_explains_does_not_fit() {
    // The second encoder slips a little all the time.
    let slipping = rewired(log(), |row| row[2] += row[0] / 40);
    let found = run(&rig(""), &slipping, &TRUSTED).unwrap();
    assert!(
        matches!(found.refusal, Some(Refusal::Misfit(_) | Refusal::NotPhysical(_))),
        "{:?}",
        found.refusal
    );
}

#[test]
fn the_excitation_keeps_the_model_within_its_rail() {
    for name in ["single-quanser-ip02", "triple-glueck-eder-kugi", "quadruple-paper"] {
        let rig = Rig::from_path(Path::new(&format!("../../rigs/{name}.toml"))).unwrap();
        let excitation = Excitation::design(&rig, 20.0, 1).unwrap();
        let most = rig.actuator.largest_force_n().unwrap();
        assert!(excitation.amplitude_n > 1e-4 * most, "{name}: {excitation:?}");
        assert_eq!(excitation.force_n(0.0, 0.0, 0.0), 0.0);
    }
    let model = "name = \"m\"\n[model]\na = [[0, 1], [1, 0]]\nb = [0, 1]\n";
    if let Ok(rig) = Rig::from_toml(model, Path::new("m.toml")) {
        assert!(matches!(Excitation::design(&rig, 20.0, 1), Err(IdentifyError::NoEncoders(_))));
    }
}

/// The log of a machine whose absolute sensor is off by `off_rad` once per turn, and what is found in it.
fn with_absolute(text: &str, off_rad: f64) -> (Rig, Log) {
    let name = Path::new("../../rigs/single-absolute.toml");
    let file = Rig::from_toml(text, name).unwrap();
    let real = format!(
        "[reality]\neccentricity_rad = {off_rad}\neccentricity_phase_rad = 0.7\nlink_length_percent = 4\n"
    );
    let truth = Rig::from_toml(&format!("{text}\n{real}"), name).unwrap();
    let log = shake(&truth, 20.0, 3).unwrap();
    let found = run(&file, &log, &TRUSTED).unwrap();
    assert_eq!(found.refusal, None, "{found:?}");
    let chain = truth.chain().unwrap();
    let constants = ChainParameters::<f64>::of(&real_chain(chain, &truth.reality.parameters));
    for (kind, wanted) in [
        (ParameterKind::FirstMoment(0), constants.a[0]),
        (ParameterKind::SecondMoment(0), constants.b[(0, 0)]),
        (ParameterKind::TotalMass, constants.total_mass),
        (ParameterKind::EccentricSine(0), off_rad * 0.7f64.cos()),
        (ParameterKind::EccentricCosine(0), off_rad * 0.7f64.sin()),
    ] {
        let estimate = found.estimate(kind).unwrap();
        println!("{kind:?}: {} ± {}, {wanted}", estimate.new, estimate.deviation);
        let error = (estimate.new - wanted).abs();
        assert!(error < 4.0 * estimate.deviation, "{kind:?}: {estimate:?}, {wanted}");
    }
    // The sensor's own zero is not one of the link.
    let zero = found.estimate(ParameterKind::Zero(0)).unwrap();
    assert!(zero.new.abs() < 0.01, "{zero:?}");
    (file, log)
}

/// The magnet of an absolute sensor is never exactly over it: 0.3° once per turn. A potentiometer is not linear: half a
/// percent of its travel to either side.
#[test]
fn an_absolute_sensor_whose_magnet_is_off_or_that_is_not_linear_is_identified_and_not_fitted_as_an_encoder() {
    let text = std::fs::read_to_string("../../rigs/single-absolute.toml").unwrap();
    let (file, log) = with_absolute(&text, 0.0052);
    let potentiometer = text.replace("sensor_bits = 14", "sensor_bits = 12\nsensor_travel_rad = 5.934");
    let zero = text.lines().find(|line| line.starts_with("sensor_zero_counts")).unwrap();
    with_absolute(&potentiometer.replace(zero, "sensor_zero_counts = 3100"), 0.03);
    // Negative control: as an encoder, which has no noise, it fits no machine.
    let mut encoder = file;
    encoder.chain_mut().unwrap().links[0].encoder =
        Some(upright_design::rig::LinkEncoder::CountsPerRev(16_384.0));
    let mut log = log;
    log.header.hash = encoder.hash();
    assert!(run(&encoder, &log, &TRUSTED).unwrap().refusal.is_some());
}
