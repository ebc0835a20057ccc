//! The motor behind the pulses: a spring that follows, falls behind and slips.

use upright_design::design::DriveLimits;
use upright_design::reality::StepMotor;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, simulate};

use crate::acceleration::{balancing, quadruple, run};
use crate::published::{certified, rig_of, rig_path, table};

/// The quadruple with a motor of this holding force, and 0.23 kg of cart and rotor.
fn with_motor(holding_n: f64) -> Rig {
    let mut rig = quadruple();
    rig.chain_mut().unwrap().cart.mass_kg = Some(0.23);
    let motor = &mut rig.reality.step_motor;
    (motor.holding_force_n, motor.full_step_m) = (Some(holding_n), Some(2e-4));
    rig
}

/// Five seconds: the motor takes a hundred steps per tick.
fn shortly(rig: &Rig) -> Scenario {
    Scenario { duration_s: 5.0, ..balancing(rig) }
}

#[test]
fn a_quadruple_stands_on_its_motor_which_does_not_feel_the_friction_of_the_cart() {
    let rig = with_motor(60.0);
    let (summary, rms) = run(&rig, &table(&rig), &shortly(&rig));
    println!("60 N: {rms} m/s² rms, {summary}");
    assert!(summary.survives() && rms <= 3.5, "{rms} {summary}");
    let mut rusty = rig.clone();
    rusty.reality.friction.cart_friction_n = 10.0;
    let (summary, with_friction) = run(&rusty, &table(&rusty), &shortly(&rusty));
    println!("10 N of friction: {with_friction} m/s² rms, {summary}");
    assert!(summary.survives() && (with_friction / rms - 1.0).abs() < 0.2, "{with_friction} {summary}");
    // Negative control: too weak a motor is too slow.
    let weak = with_motor(10.0);
    let (summary, _) = run(&weak, &table(&weak), &shortly(&weak));
    assert!(!summary.survives(), "{summary}");
}

/// Another simulator finds 93 to 117 Hz, and 166 Hz.
#[test]
fn the_loop_states_how_slow_its_drive_may_be() {
    let rig = with_motor(60.0);
    let limits = DriveLimits::of(&rig, &certified(&rig).double).unwrap();
    println!("{limits:?}");
    assert!((80.0..125.0).contains(&limits.resonance_hz.unwrap()), "{limits:?}");
    assert!((150.0..185.0).contains(&limits.bandwidth_hz), "{limits:?}");
    let resonance_hz = |rig: &Rig| StepMotor::of(rig).unwrap().resonance_hz(rig.chain().unwrap()).unwrap();
    assert!((200.0..230.0).contains(&resonance_hz(&rig)), "{}", resonance_hz(&rig));
    assert!(resonance_hz(&with_motor(10.0)) < limits.resonance_hz.unwrap());
    // A motor that rings longer has to be faster.
    let mut ringing = rig.clone();
    ringing.reality.step_motor.motor_damping_percent = 3.0;
    let of_ringing = DriveLimits::of(&ringing, &certified(&ringing).double).unwrap();
    assert!(of_ringing.resonance_hz > limits.resonance_hz, "{of_ringing:?}");
    assert_eq!(of_ringing.bandwidth_hz, limits.bandwidth_hz);
    // A force has no such limits.
    let force = crate::published::rig("quadruple-paper");
    assert_eq!(DriveLimits::of(&force, &certified(&force).double), None);
}

#[test]
fn a_motor_that_is_too_weak_for_the_motion_slips() {
    let mut rig = crate::published::rig("single-stepper");
    rig.chain_mut().unwrap().cart.mass_kg = Some(0.3);
    let slip = |rig: &Rig| {
        let scenario = Scenario { step_m: 0.1, duration_s: 5.0, ..balancing(rig) };
        let (trace, _) = simulate(rig, &table(rig), &scenario).unwrap();
        let last = trace.samples().last().unwrap();
        (last.state[0] - last.estimate[0]).abs()
    };
    let motor = &mut rig.reality.step_motor;
    (motor.holding_force_n, motor.full_step_m) = (Some(20.0), Some(2e-4));
    assert!(slip(&rig) < 2e-4, "{}", slip(&rig));
    rig.reality.friction.cart_friction_n = 25.0;
    assert!(slip(&rig) > 8e-4, "{}", slip(&rig));
}

#[test]
fn a_motor_needs_the_mass_that_it_moves_and_a_drive_that_has_one() {
    let text = std::fs::read_to_string(rig_path("single-stepper")).unwrap();
    let error = |text: &str| Rig::from_toml(text, std::path::Path::new("rig.toml")).unwrap_err().to_string();
    let with = |more: &str| format!("{text}\n[reality]\n{more}\n");
    assert!(error(&with("holding_force_n = 20\nfull_step_m = 2e-4")).contains("only with mass_kg of [cart]"));
    let heavy = |more: &str| with(more).replace("[cart]\n", "[cart]\nmass_kg = 0.3\n");
    assert!(error(&heavy("holding_force_n = 20")).contains("reality.full_step_m: missing"));
    let whole = heavy("holding_force_n = 20\nfull_step_m = 2e-4\ncart_friction_n = 3");
    assert_eq!(rig_of(&whole).reality.friction.cart_friction_n, 3.0);
    let force = std::fs::read_to_string(rig_path("quadruple-paper")).unwrap();
    assert!(error(&format!("{force}\n[reality]\nfull_step_m = 1\n")).contains("reality.full_step_m"));
}
