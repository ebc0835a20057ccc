//! A servo that follows its speed late: the design makes up for the lag that the rig file states.

use upright_design::design::{DriveLimits, continuous_plant};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, simulate};

use crate::acceleration::{balancing, run, stepper};
use crate::published::{certified, rig_of, rig_path, table};

/// The rig in this file with a servo of this bandwidth (Hz).
fn with_servo(name: &str, bandwidth_hz: f64) -> Rig {
    let mut rig = crate::published::rig(name);
    rig.actuator.pulses_mut().unwrap().bandwidth_hz = Some(bandwidth_hz);
    rig
}

/// The same machine, whose servo has in fact another bandwidth.
fn really(rig: &Rig, bandwidth_hz: f64) -> Rig {
    let mut real = rig.clone();
    real.reality.step_motor.bandwidth_hz = Some(bandwidth_hz);
    real
}

fn survives(real: &Rig, designed: &Rig) -> bool {
    run(real, &table(designed), &balancing(real)).0.survives()
}

#[test]
fn slow_servos_balance_one_to_four_links_if_the_rig_file_says_how_slow_they_are() {
    for name in ["single-stepper", "double-stepper", "quadruple-stepper"] {
        let ideal = crate::published::rig(name);
        let (_, at_once) = run(&ideal, &table(&ideal), &balancing(&ideal));
        for bandwidth_hz in [5.0, 20.0, 50.0] {
            let rig = with_servo(name, bandwidth_hz);
            let (summary, rms) = run(&rig, &table(&rig), &balancing(&rig));
            println!("{name}, {bandwidth_hz} Hz: {rms:.3} m/s² rms, {at_once:.3} without lag; {summary}");
            assert!(summary.survives() && rms < 2.0 * at_once, "{name} {bandwidth_hz}: {rms} {summary}");
        }
    }
    // Negative control: the same servos, of which the design does not know.
    for (name, bandwidth_hz) in
        [("single-stepper", 3.0), ("double-stepper", 5.0), ("quadruple-stepper", 20.0)]
    {
        let ideal = crate::published::rig(name);
        assert!(!survives(&really(&ideal, bandwidth_hz), &ideal), "{name}");
    }
}

/// Without noise, the model's cart is the simulated one, tick by tick, to within half a step of the pulses.
#[test]
fn the_cart_is_where_the_model_of_the_lag_says() {
    let rig = with_servo("double-stepper", 20.0);
    let scenario = Scenario { step_m: 0.1, duration_s: 3.0, ..balancing(&rig) };
    let away = |real: &Rig| {
        let (trace, summary) = simulate(real, &table(&rig), &scenario).unwrap();
        assert!(summary.survives());
        let away = trace.samples().map(|sample| (sample.state[0] - sample.estimate[0]).abs());
        away.fold(0.0, f64::max)
    };
    let step_m = rig.actuator.pulses().unwrap().step_m;
    assert!(away(&rig) < step_m, "{}", away(&rig));
    // Negative control: a servo that is faster than stated is elsewhere.
    assert!(away(&really(&rig, 30.0)) > 20.0 * step_m, "{}", away(&really(&rig, 30.0)));
}

#[test]
fn the_bandwidths_that_are_stated_as_limits_are_those_at_which_the_machine_falls() {
    for (name, bandwidth_hz) in
        [("double-stepper", 20.0), ("quadruple-stepper", 20.0), ("double-stepper", 5.0)]
    {
        let rig = with_servo(name, bandwidth_hz);
        let limits = DriveLimits::of(&rig, &certified(&rig).double).unwrap();
        println!("{name} {bandwidth_hz} Hz: {limits}");
        assert_eq!(limits.resonance_hz, None);
        assert!(survives(&really(&rig, 1.15 * limits.bandwidth_hz), &rig), "{name} {limits}");
        assert!(!survives(&really(&rig, 0.8 * limits.bandwidth_hz), &rig), "{name} {limits}");
        if let Some(largest_hz) = limits.largest_bandwidth_hz {
            assert!(survives(&really(&rig, largest_hz / 1.2), &rig), "{name} {limits}");
            assert!(!survives(&really(&rig, 1.3 * largest_hz), &rig), "{name} {limits}");
        }
    }
    let fast = with_servo("double-stepper", 5.0);
    assert!(DriveLimits::of(&fast, &certified(&fast).double).unwrap().largest_bandwidth_hz.is_some());
}

/// The machine of `rig` with a servo of second order, which overshoots.
fn really_overshooting(rig: &Rig, frequency_hz: f64) -> Rig {
    let mut real = really(rig, frequency_hz);
    real.reality.step_motor.servo_damping_percent = Some(70.0);
    real
}

#[test]
fn a_servo_of_second_order_has_to_be_faster_or_stated_as_a_longer_lag() {
    for (name, slow_hz) in [("double-stepper", 20.0), ("quadruple-stepper", 50.0)] {
        let ideal = crate::published::rig(name);
        let limits = DriveLimits::of(&ideal, &certified(&ideal).double).unwrap();
        let least_hz = limits.second_order_hz.unwrap();
        println!("{name}: {limits}");
        assert!(survives(&really_overshooting(&ideal, 1.15 * least_hz), &ideal), "{name} {limits}");
        assert!(!survives(&really_overshooting(&ideal, 0.65 * least_hz), &ideal), "{name} {limits}");
        // At a constant speed, it is behind by 2 ζ/ω, as one of first order with this bandwidth.
        let stated = with_servo(name, slow_hz / 1.4);
        assert!(survives(&really_overshooting(&stated, slow_hz), &stated), "{name}");
        // Negative control: nobody knows.
        assert!(!survives(&really_overshooting(&ideal, slow_hz), &ideal), "{name}");
    }
}

/// Found with a simulator of its own for one to four links, 1 ms, and the weights of the force.
#[test]
fn the_least_bandwidths_are_those_of_an_independent_simulation() {
    for (name, wanted) in [
        ("single-quanser-ip02", [7.7, 11.0]),
        ("double-quanser-dbpen", [28.0, 39.0]),
        ("triple-glueck-eder-kugi", [55.0, 78.0]),
        ("quadruple-paper", [166.0, 235.0]),
    ] {
        let force = crate::published::rig(name);
        let b = continuous_plant::<f64>(&force).unwrap().b[(1, 0)];
        let rig = stepper(name, force.lqr.as_ref().unwrap().force_weight / (b * b), 0.001);
        let limits = DriveLimits::of(&rig, &certified(&rig).double).unwrap();
        println!("{name}: {limits}, wanted {wanted:?}");
        let found = [limits.bandwidth_hz, limits.second_order_hz.unwrap()];
        let near = |found: f64, wanted: f64| (found / wanted - 1.0).abs() < 0.08;
        assert!(near(found[0], wanted[0]) && near(found[1], wanted[1]), "{name}: {limits}");
        // Negative control: one of first order may be slower.
        assert!(!near(found[0], wanted[1]), "{name}: {limits}");
    }
}

#[test]
fn a_bandwidth_belongs_to_a_servo() {
    let error = |text: &str| Rig::from_toml(text, std::path::Path::new("rig.toml")).unwrap_err().to_string();
    let stepper = std::fs::read_to_string(rig_path("single-stepper")).unwrap();
    let force = std::fs::read_to_string(rig_path("single-quanser-ip02")).unwrap();
    let servo = stepper.replace("kind = \"acceleration\"", "kind = \"acceleration\"\nbandwidth_hz = 20");
    assert_eq!(rig_of(&servo).actuator.pulses().unwrap().bandwidth_hz, Some(20.0));
    assert!(error(&servo.replace("= 20\n", "= -20\n")).contains("actuator.bandwidth_hz: found -20"));
    assert!(error(&force.replace("[actuator]", "[actuator]\nbandwidth_hz = 20")).contains("bandwidth_hz"));
    let damped = format!("{stepper}\n[reality]\nservo_damping_percent = 70\n");
    assert!(error(&damped).contains("only with bandwidth_hz"), "{}", error(&damped));
    assert!(
        error(&format!("{damped}bandwidth_hz = 20\n").replace("= 70", "= 100"))
            .contains("servo_damping_percent")
    );
    let motor = "[reality]\nholding_force_n = 60\nfull_step_m = 2e-4\nbandwidth_hz = 20\n";
    let both = format!("{stepper}\n{motor}").replace("[cart]\n", "[cart]\nmass_kg = 0.3\n");
    assert!(error(&both).contains("only without holding_force_n"), "{}", error(&both));
}
