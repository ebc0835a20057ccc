//! Integral action on the cart position: removes the offset that the precompensation leaves, and does not wind up.

use crate::bench::*;
use std::path::Path;

use nalgebra::SVector;
use upright::control::controller::Controller;
use upright::control::encoder::CounterWidth;
use upright::table::Law;
use upright_design::rig::{Integral, PerJoint, Rig};
use upright_design::simulate::{Bench, Scenario, Sensing, simulate};

fn with_integral(name: &str, position_weight: f64) -> Rig {
    Rig { integral: Some(Integral { position_weight, setpoint_weight: 1.0 }), ..rig(name) }
}

/// Mean distance from the set-point over the second half of the run (m): encoder steps keep the cart moving back and
/// forth.
fn offset(rig: &Rig, scenario: &Scenario) -> f64 {
    let (trace, summary) = simulate(rig, &table(rig), scenario).unwrap();
    assert!(summary.survives(), "{}: {summary}", rig.name);
    let last: Vec<f64> = trace
        .samples()
        .filter(|sample| sample.t >= 0.5 * scenario.duration_s)
        .map(|sample| sample.state[0] - sample.target)
        .collect();
    last.iter().sum::<f64>() / last.len() as f64
}

fn pulled(rig: &Rig, sensing: Sensing, force_n: f64) -> Scenario {
    Scenario {
        sensing,
        force_offset_n: force_n,
        step_m: 0.1,
        duration_s: 40.0,
        substeps: 2,
        ..Scenario::at_rest(rig, Law::Lqr)
    }
}

#[test]
fn a_constant_force_moves_the_cart_without_integral_action_and_not_with_it() {
    for (name, weight, force_n) in [("single-quanser-ip02", 100.0, 0.5), ("quadruple-paper", 10.0, 0.1)] {
        for sensing in [Sensing::FullState, Sensing::Encoders] {
            for delay_ticks in [0, 1] {
                let mut with = with_integral(name, weight);
                with.tick.delay_ticks = delay_ticks;
                let without = Rig { integral: None, ..with.clone() };
                let scenario = pulled(&with, sensing, force_n);
                let (moved, held) = (offset(&without, &scenario), offset(&with, &scenario));
                assert!(moved.abs() > 5e-3, "{name} {sensing:?} {delay_ticks}: {moved}");
                assert!(held.abs() < 1e-3, "{name} {sensing:?} {delay_ticks}: {held} where {moved} was");
            }
        }
    }
}

/// Overshoot of the cart after a step of the set-point, as a share of the step.
fn overshoot(rig: &Rig, step_m: f64) -> f64 {
    let sensing = Sensing::FullState;
    let scenario =
        Scenario { step_m, duration_s: 60.0, substeps: 2, sensing, ..Scenario::at_rest(rig, Law::Lqr) };
    let (trace, summary) = simulate(rig, &table(rig), &scenario).unwrap();
    assert!(summary.survives() && summary.final_error_m.abs() < 1e-3, "{}: {summary}", rig.name);
    trace.samples().map(|sample| sample.state[0]).fold(0.0, f64::max) / step_m - 1.0
}

#[test]
fn a_smaller_weight_of_the_set_point_overshoots_less_and_arrives_all_the_same() {
    for (name, weight, step_m) in [("single-quanser-ip02", 100.0, 0.25), ("quadruple-paper", 10.0, 0.5)] {
        let overshoots = [1.0, 0.75, 0.5, 0.25, 0.0].map(|setpoint_weight| {
            let integral = Some(Integral { position_weight: weight, setpoint_weight });
            overshoot(&Rig { integral, ..rig(name) }, step_m)
        });
        // Negative control: the whole precompensation N. The governor slows the set-point of a loop that overshoots.
        assert!(overshoots[0] > 0.1, "{name}: {overshoots:?}");
        assert!(overshoots[2] < 0.05, "{name}: {overshoots:?}");
        assert!(overshoots[4] < 0.01, "{name}: {overshoots:?}");
    }
}

#[test]
fn what_wrong_zeros_and_a_tilted_rail_leave_over_is_removed() {
    for (name, weight) in [("single-quanser-ip02", 100.0), ("quadruple-paper", 10.0)] {
        let with = with_integral(name, weight);
        let mut zeros = with.clone();
        zeros.reality.sensors.homing_error_rad = PerJoint::all(0.5_f64.to_radians());
        let mut tilted = with.clone();
        tilted.reality.sensors.rail_tilt_rad = 5e-3;
        for real in [zeros, tilted] {
            let without = Rig { integral: None, ..real.clone() };
            let scenario = Scenario { duration_s: 120.0, ..pulled(&with, Sensing::Encoders, 0.0) };
            let (moved, held) = (offset(&without, &scenario), offset(&real, &scenario));
            assert!(moved.abs() > 1e-3, "{name}: {moved}");
            assert!(held.abs() < 1e-3, "{name}: {held} where {moved} was");
        }
    }
}

#[test]
fn a_rig_that_is_not_as_described_arrives_all_the_same() {
    let with = with_integral("single-quanser-ip02", 100.0);
    let table = table(&with);
    let mut heavier = with.clone();
    let chain = heavier.chain_mut().unwrap();
    chain.cart.mass_kg = chain.cart.mass_kg.map(|mass| 1.3 * mass);
    chain.cart.friction_n_s_per_m *= 1.5;
    chain.links[0].mass_kg *= 0.8;
    let scenario = pulled(&with, Sensing::Encoders, 0.5);
    let summary = run(&heavier, &table, &scenario);
    // What is left of the dead zone lets the cart move by a millimetre or two.
    assert!(summary.survives() && summary.final_error_m.abs() < 3e-3, "{summary}");
}

/// A cart of 1 kg without pendulum, so that nothing falls while the force stays at its limit.
fn cart(force_limit_n: f64) -> Rig {
    let text = format!(
        "name = \"cart\"\n[model]\na = [[0, 1], [0, 0]]\nb = [0, 1]\n[actuator]\nforce_limit_n = {force_limit_n:e}\n\
         [lqr]\nstate_weights = [1, 1]\nforce_weight = 1\n[integral]\nposition_weight = 0.1\n"
    );
    Rig::from_toml(&text, Path::new("cart.toml")).unwrap_or_else(|error| panic!("{error}"))
}

const FAR_M: f64 = 10.0;

/// A raw step with the law alone, integrating as the firmware does or always: the cart's positions (m).
fn law_alone(rig: &Rig, conditional: bool) -> Vec<f64> {
    let values = raw_table(rig);
    let table = values.table::<2, 1>();
    let mut bench = Bench::new(rig, &at_rest(rig, Law::Lqr)).unwrap();
    let mut controller = Controller::new(&table, [CounterWidth::Bits32]).unwrap();
    controller.start_in_state(&SVector::zeros());
    controller.set_setpoint(FAR_M as f32).unwrap();
    let mut positions = Vec::new();
    for _ in 0..=40_000 {
        let x = SVector::from_fn(|i, _| bench.state()[i] as f32);
        positions.push(bench.state()[0]);
        let command = controller.control_from_state(&x);
        bench.tick(command.drive);
        if !conditional {
            // Negative control: an integral that ignores the limit.
            controller.take_force(command.requested_n, command.requested_n);
        }
        controller.predict();
    }
    positions
}

#[test]
fn the_integral_does_not_wind_up_while_the_force_is_limited() {
    let rig = cart(1.0);
    let scenario = Scenario { step_m: FAR_M, duration_s: 40.0, ..at_rest(&rig, Law::Lqr) };
    let (trace, summary) = simulate(&rig, &raw_table(&rig), &scenario).unwrap();
    let limited = trace.samples().filter(|sample| sample.requested.abs() > 1.0).count();
    assert!(limited > 2000, "the force is limited for {limited} ticks only");
    assert!(summary.settled && summary.final_error_m.abs() < 1e-3, "{summary}");
    let held = law_alone(&rig, true);
    // The loop above is that of the firmware.
    assert_eq!(held.len(), trace.samples().len());
    assert!(held.iter().zip(trace.samples()).all(|(x, sample)| x.to_bits() == sample.state[0].to_bits()));

    let overshoot = |positions: &[f64]| positions.iter().copied().fold(0.0, f64::max) / FAR_M - 1.0;
    let (held, wound) = (overshoot(&held), overshoot(&law_alone(&rig, false)));
    // Without any limit, both integrate alike.
    let strong = cart(1e6);
    let free = overshoot(&law_alone(&strong, true));
    assert_eq!(free, overshoot(&law_alone(&strong, false)));
    assert!(held < free, "no more than without a limit: {held} {free}");
    assert!(wound > 5.0 * held && wound > 1.0, "the step itself again: {wound} {held}");
}

#[test]
fn a_constant_force_beyond_all_sense_is_refused() {
    let rig = rig("quadruple-paper");
    let scenario = Scenario { force_offset_n: f64::NAN, ..at_rest(&rig, Law::Lqr) };
    assert!(simulate(&rig, &table(&rig), &scenario).unwrap_err().to_string().contains("constant force"));
}
