//! Rigs whose drive imposes the cart's acceleration: rig file, model, gains, observer, and the loop of pulses.

use std::path::Path;

use upright::table::{Equilibrium, Law};
use upright_design::design::continuous_plant;
use upright_design::numerics::{Matrix, spectral_radius};
use upright_design::plant::{ChainParameters, ChainPlant, WideChainState, linearise};
use upright_design::rig::{AccelerationDrive, Actuator, CartInput, Reality, Rig};
use upright_design::simulate::{Scenario, Sensing, SimulationError, Summary, simulate};
use upright_design::table::TableValues;

use crate::published::{certified, rig, table};

/// The rig in this file on a stepper, with this weight of its acceleration.
pub(crate) fn stepper(name: &str, weight: f64, period_s: f64) -> Rig {
    let mut rig = rig(name);
    let drive = AccelerationDrive {
        acceleration_limit_m_per_s2: 15.0,
        step_m: 12.5e-6,
        speed_limit_m_per_s: Some(0.5),
        step_rate_limit_hz: None,
        bandwidth_hz: None,
    };
    rig.actuator = Actuator::Pulses(drive);
    rig.tick.period_s = period_s;
    (rig.pole_placement, rig.swing_up, rig.reality) = (None, None, Reality::default());
    rig.lqr.as_mut().unwrap().force_weight = weight;
    rig.kalman.as_mut().unwrap().force_noise_n2_s = 0.0;
    let chain = rig.chain_mut().unwrap();
    (chain.input, chain.cart.mass_kg, chain.cart.encoder_step_m) = (CartInput::Acceleration, None, None);
    rig
}

pub(crate) fn quadruple() -> Rig {
    stepper("quadruple-paper", 0.0166064, 0.001)
}

fn sampled_gains(rig: &Rig) -> Vec<f64> {
    certified(rig).double.sampled.lqr.as_ref().unwrap().k.entries().to_vec()
}

fn are_close(found: &[f64], wanted: &[f64]) -> bool {
    found.len() == wanted.len() && found.iter().zip(wanted).all(|(x, y)| (x - y).abs() <= 1e-5 * y.abs())
}

/// Gains from a model with the mean speed held, computed elsewhere.
#[test]
fn gains_are_those_of_an_independent_design_with_the_mean_speed_held() {
    let gains = sampled_gains(&quadruple());
    let mean =
        [17.8747, 19.7335, -88.3463, -29.068, -964.795, -27.3146, 3003.95, 14.6194, -3138.62, -135.505];
    assert!(are_close(&gains, &mean), "{gains:?}");
    // Negative control: those with the acceleration held.
    let held =
        [17.7195, 19.5598, -87.4031, -28.8072, -959.071, -27.0942, 2980.97, 14.5628, -3112.41, -134.355];
    assert!(!are_close(&gains, &held));
    let gains = sampled_gains(&stepper("single-quanser-ip02", 0.127259, 0.005));
    assert!(are_close(&gains, &[-37.5382, -27.4366, 107.247, 21.1239]), "{gains:?}");
}

/// Of a public machine only gains for a held acceleration are known, from the integral of the cost and from its sum
/// over ticks. Link and weights are the ones that give them; those for held speeds are of another program.
#[test]
fn gains_of_a_public_machine_are_those_of_another_program() {
    let mut rig = stepper("single-quanser-ip02", 0.04, 0.01);
    rig.lqr.as_mut().unwrap().state_weights = vec![24.99938, 3.99994, 32.84086, 0.24980];
    let link = &mut rig.chain_mut().unwrap().links[0];
    (link.length_m, link.friction_n_m_s_per_rad) = (0.21518352 * 1.5, 0.0);
    (link.centre_of_mass_m, link.inertia_kg_m2) = (None, None);
    let gains = sampled_gains(&rig);
    assert!(are_close(&gains, &[-21.5582, -18.3660, 69.6122, 9.87655]), "{gains:?}");
    // Negative controls: those for a held acceleration, and with the sum over ticks.
    for other in [[-21.5385, -18.3507, 69.5947, 9.87466], [-21.4998, -18.3199, 69.5054, 9.86244]] {
        assert!(!are_close(&gains, &other), "{other:?}");
    }
}

/// Solved for the force that gives the cart an acceleration a, the model of the force is that of the acceleration.
#[test]
fn the_model_is_that_of_the_force_without_the_cart() {
    for name in ["single-multiarm", "double-multiarm", "triple-multiarm", "quadruple-paper"] {
        let force = continuous_plant::<f64>(&rig(name)).unwrap();
        let model = continuous_plant::<f64>(&stepper(name, 1.0, 0.001)).unwrap();
        let per_force = force.b[(1, 0)];
        let scale = force.a.largest_entry();
        for row in 0..force.a.rows() {
            let gain = force.b[(row, 0)] / per_force;
            assert!((model.b[(row, 0)] - gain).abs() < 1e-11 * gain.abs().max(1.0), "{name}, row {row}");
            for column in 0..force.a.cols() {
                let wanted = force.a[(row, column)] - gain * force.a[(1, column)];
                let error = (model.a[(row, column)] - wanted).abs();
                assert!(error < 1e-11 * scale, "{name}, row {row}, column {column}: {error}");
            }
        }
    }
}

#[test]
fn neither_mass_nor_friction_of_the_cart_matter() {
    let light = quadruple();
    let mut heavy = light.clone();
    let cart = &mut heavy.chain_mut().unwrap().cart;
    (cart.mass_kg, cart.friction_n_s_per_m) = (Some(7.0), 10.0);
    let [a, b] = [&light, &heavy].map(|rig| &certified(rig).double);
    assert_eq!((&a.ad, &a.bd, &a.sampled), (&b.ad, &b.bd, &b.sampled));
    // Negative control: with force, both do.
    let [light, mut heavy] = [(); 2].map(|()| rig("quadruple-paper"));
    heavy.chain_mut().unwrap().cart.mass_kg = Some(0.11);
    let [a, b] = [&light, &heavy].map(|rig| continuous_plant::<f64>(rig).unwrap().a);
    assert_ne!(a, b);
}

#[test]
fn the_links_move_as_under_the_force_that_gives_the_same_acceleration() {
    let with = |rig: &Rig| ChainPlant::<4>::of(rig.chain().unwrap()).unwrap();
    let (force, acceleration) = (with(&rig("quadruple-paper")), with(&quadruple()));
    let state =
        WideChainState { x: 0.1, xdot: -0.7, phi: [2.0, -1.1, 0.4, 3.0], phidot: [3.0, -5.0, 1.5, 7.0] };
    let (torques, wanted) = ([1e-3, -2e-3, 0.0, 1e-3], 12.0);
    let at = |input: f64| force.derivative(&state, input, &torques);
    let needed = (wanted - at(0.0).xdot) / (at(1.0).xdot - at(0.0).xdot);
    let (of_force, found) = (at(needed), acceleration.derivative(&state, wanted, &torques));
    assert_eq!(found.xdot, wanted);
    for (x, y) in of_force.phidot.iter().zip(&found.phidot) {
        assert!((x - y).abs() < 1e-9 * y.abs(), "{x} {y}");
    }
    // A jump of the speed is the limit of a short push.
    let jumped = acceleration.with_cart_speed(&state, 0.3);
    let short = 1e-7;
    let pushed = state.plus(short, &acceleration.derivative(&state, 1.0 / short, &torques));
    for (x, y) in pushed.phidot.iter().zip(&jumped.phidot) {
        assert!((x - y).abs() < 1e-4 * y.abs(), "{x} {y}");
    }
    // The linear model agrees with the equations.
    let parameters = ChainParameters::<f64>::of(quadruple().chain().unwrap());
    let linear = linearise(&parameters, Equilibrium::UPRIGHT).unwrap();
    let small = WideChainState::<4>::from_relative(&[0.0, 0.0, 1e-7, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mut rate = [0.0; 10];
    acceleration.derivative(&small, 0.0, &[0.0; 4]).write_relative(&mut rate);
    for (row, rate) in rate.iter().enumerate() {
        assert!((rate / 1e-7 - linear.a[(row, 2)]).abs() < 1e-3, "row {row}");
    }
}

/// The cart's state comes from the pulses: no encoder corrects it, and its count corrects nothing.
#[test]
fn the_observer_takes_the_cart_from_the_pulses() {
    let rig = quadruple();
    let l = &certified(&rig).double.kalman.as_ref().unwrap().l_filter;
    assert_eq!((l.rows(), l.cols()), (10, 5));
    for (row, column) in (0..10).flat_map(|row| (0..5).map(move |column| (row, column))) {
        let is_of_cart = row < 2 || column == 0;
        assert_eq!(l[(row, column)] == 0.0, is_of_cart, "{row} {column}");
    }
    // Coarser steps make the links' encoders worth less.
    let mut coarse = rig.clone();
    coarse.actuator.pulses_mut().unwrap().step_m = 1e-4;
    let other = &certified(&coarse).double.kalman.as_ref().unwrap().l_filter;
    assert!(other[(2, 1)] < l[(2, 1)]);
}

fn radius(ad: &Matrix<f64>, bd: &Matrix<f64>, k: &Matrix<f64>) -> f64 {
    spectral_radius(&(ad - &(bd * k))).unwrap()
}

/// A generator that takes the new speed at the beginning of the tick moves the cart too far: a quadruple falls at
/// 10 ms.
#[test]
fn pulses_at_the_speed_of_the_ticks_end_would_topple_a_quadruple() {
    let design = &certified(&stepper("quadruple-paper", 0.0166064, 0.01)).double;
    let k = &design.sampled.lqr.as_ref().unwrap().k;
    assert!(radius(&design.ad, &design.bd, k) < 1.0);
    let jump = (&design.ad * &design.b).scaled(&0.01);
    assert!(radius(&design.ad, &jump, k) > 1.5);
}

pub(crate) fn run(rig: &Rig, table: &TableValues, scenario: &Scenario) -> (Summary, f64) {
    let (trace, summary) = simulate(rig, table, scenario).unwrap();
    let squares: f64 = trace.samples().map(|sample| sample.force * sample.force).sum();
    (summary, (squares / trace.samples().len() as f64).sqrt())
}

/// A run of 20 s that begins with a lean of the first link.
pub(crate) fn balancing(rig: &Rig) -> Scenario {
    let mut scenario = Scenario { duration_s: 20.0, ..Scenario::at_rest(rig, Law::Lqr) };
    scenario.start[2] = 0.002;
    scenario
}

#[test]
fn a_quadruple_balances_on_pulses() {
    let rig = quadruple();
    let (summary, rms) = run(&rig, &table(&rig), &balancing(&rig));
    println!("{rms} m/s² rms, {summary}");
    assert!(summary.survives() && rms <= 3.5, "{rms} {summary}");
    // Negative control: pulses that move the cart twice as far as the table says.
    let mut coarse = rig.clone();
    coarse.actuator.pulses_mut().unwrap().step_m *= 2.0;
    let (summary, _) = run(&coarse, &table(&rig), &balancing(&rig));
    assert!(!summary.survives(), "{summary}");
}

#[test]
fn a_quadruple_stands_on_pulses_of_100_um_and_falls_on_those_of_150_um() {
    for (step_m, stands) in [(50e-6, true), (100e-6, true), (150e-6, false), (200e-6, false)] {
        let mut rig = quadruple();
        rig.actuator.pulses_mut().unwrap().step_m = step_m;
        let (summary, rms) = run(&rig, &table(&rig), &balancing(&rig));
        println!("{step_m} m: {rms} m/s² rms, {summary}");
        assert_eq!(summary.survives(), stands, "{step_m} m: {summary}");
    }
}

/// Every path of the set-point leaves half of the drive's acceleration and speed.
#[test]
fn the_governor_leaves_half_of_the_drives_limits() {
    let mut rig = rig("single-stepper");
    // On its own rail of 0.35 m, the margin at the ends binds before the drive.
    rig.chain_mut().unwrap().cart.travel_m = [-1.0, 1.0];
    let step = |rig: &Rig| table(rig).laws.lqr.as_ref().unwrap().setpoint_step;
    let free = step(&rig);
    let drive = rig.actuator.pulses_mut().unwrap();
    (drive.speed_limit_m_per_s, drive.acceleration_limit_m_per_s2) = (Some(0.1), 1.0);
    let slow = step(&rig);
    assert!(slow < free, "{slow} {free}");
    let scenario = Scenario { step_m: 0.12, duration_s: 15.0, ..Scenario::at_rest(&rig, Law::Lqr) };
    let (trace, summary) = simulate(&rig, &table(&rig), &scenario).unwrap();
    assert!(summary.survives() && summary.final_error_m.abs() < 5e-3, "{summary}");
    let fastest = trace.samples().map(|sample| sample.estimate[1].abs()).fold(0.0, f64::max);
    assert!(fastest <= 0.051 && summary.peak_force_n <= 0.51, "{fastest} m/s, {summary}");
    // Negative control: without the governor, the same step goes to the limits.
    let (trace, _) = simulate(&rig, &table(&rig).without_governor(), &scenario).unwrap();
    assert!(trace.samples().any(|sample| sample.force.abs() > 0.9));
}

#[test]
fn the_public_machine_balances_and_follows_its_set_point() {
    let rig = rig("single-stepper");
    let scenario = Scenario { step_m: 0.05, step_at_s: 2.0, is_supervised: true, ..balancing(&rig) };
    let (summary, rms) = run(&rig, &table(&rig), &scenario);
    println!("{rms} m/s² rms, {summary}");
    assert!(summary.survives() && summary.final_error_m.abs() < 5e-3, "{summary}");
    // The drive's limits hold.
    let drive = rig.actuator.pulses().unwrap();
    assert!(summary.peak_force_n <= drive.acceleration_limit_m_per_s2);
    assert!(summary.to_string().contains("m/s²"), "{summary}");
    // The whole state cannot be measured: the cart's is what the pulses say.
    let full = Scenario { sensing: Sensing::FullState, ..scenario };
    assert_eq!(simulate(&rig, &table(&rig), &full).unwrap_err(), SimulationError::FullState);
}

#[test]
fn keys_of_a_force_are_refused_with_what_to_do() {
    let text = std::fs::read_to_string(crate::published::rig_path("single-stepper")).unwrap();
    let refused = |from: &str, to: &str, words: &[&str]| {
        assert!(text.contains(from), "{from}");
        let error = Rig::from_toml(&text.replace(from, to), Path::new("rig.toml")).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "{to}: {error}");
        }
    };
    let actuator = "kind = \"acceleration\"\n";
    refused(actuator, "", &["actuator.acceleration_limit_m_per_s2", "set kind = \"acceleration\""]);
    refused(actuator, "kind = \"speed\"\n", &["actuator.kind", "\"force\" or \"acceleration\""]);
    refused(
        actuator,
        "kind = \"acceleration\"\nforce_limit_n = 3\n",
        &["actuator.force_limit_n", "leave it out"],
    );
    refused(actuator, "kind = \"acceleration\"\nsupply_v = 3\n", &["actuator.supply_v", "leave it out"]);
    refused("step_m = 5e-5\n", "", &["actuator.step_m", "missing", "travel of the cart per pulse"]);
    refused("= 20000", "= 20", &["actuator.step_rate_limit_hz", ">= 200 (Hz)"]);
    refused("[cart]\n", "[cart]\nencoder_step_m = 1e-5\n", &["cart.encoder_step_m", "step_m of [actuator]"]);
    refused("[cart]\n", "[cart]\nsensor_bits = 14\n", &["cart.sensor_bits", "step_m of [actuator]"]);
    refused("acceleration_weight", "force_weight", &["lqr.force_weight", "give acceleration_weight instead"]);
    refused("acceleration_noise_m2_per_s3", "force_noise_n2_s", &["kalman.force_noise_n2_s"]);
    refused("period_s = 0.01", "period_s = 0.01\ndelay_ticks = 1", &["actuator.kind", "delay_ticks"]);
    refused("[kalman]\n", "[kalman]\nobserver_poles = [[-9, 0], [-9, 0]]\n", &["kalman.observer_poles"]);
    refused("[limits]\n", "[limits]\njog_force_n = 1\n", &["limits.jog_force_n", "leave it out"]);
    refused("[limits]\n", "[reality]\ncart_friction_n = 1\n[limits]\n", &["reality.cart_friction_n"]);
    refused("[limits]\n", "[reality]\nlatency_s = 1e-4\n[limits]\n", &["reality.latency_s"]);
    refused("[limits]\n", "[robust]\ncart_friction_n = 1\n[limits]\n", &["robust.cart_friction_n"]);
    refused("[limits]\n", "[friction]\ncart_n = 1\n[limits]\n", &["friction.cart_n"]);
    refused("[limits]\n", "[verify]\nlatency_s = 1e-4\n[limits]\n", &["verify.latency_s"]);
    refused("[limits]\n", "[verify]\ncart_friction_n = 1\n[limits]\n", &["verify.cart_friction_n"]);
    let [key, other] = ["swing_up.force_n", "give acceleration_m_per_s2 instead"];
    refused("longest_s = 8", "force_n = 1", &[key, other]);
    // And the other way round.
    let force = std::fs::read_to_string(crate::published::rig_path("quadruple-paper")).unwrap();
    let other = |from: &str, to: &str| {
        Rig::from_toml(&force.replace(from, to), Path::new("rig.toml")).unwrap_err().to_string()
    };
    assert!(other("force_weight = 1", "acceleration_weight = 1").contains("give force_weight instead"));
    let plan = other("[swing_up]\n", "[swing_up]\nacceleration_m_per_s2 = 1\n");
    assert!(
        plan.contains("swing_up.acceleration_m_per_s2") && plan.contains("give force_n instead"),
        "{plan}"
    );
    assert!(other("mass_kg = 0.1\nfriction_n_s", "friction_n_s").contains("cart.mass_kg: missing"));
}
