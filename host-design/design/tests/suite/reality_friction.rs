//! Dry friction and air drag, compared with known results.

use crate::plant_rigs::{chain, rod, unequal_rods};
use core::f64::consts::PI;
use proptest::prelude::*;
use std::path::Path;
use upright_design::plant::{Plant, chain_plant};
use upright_design::reality::{RealChain, real_plant};
use upright_design::rig::{Chain, PerJoint, PlantDescription, Reality, Rig};

const MINIMAL: &str = "name = \"real\"\n[cart]\nmass_kg = 1\n[[link]]\nmass_kg = 1\nlength_m = 1\n";

fn rig_of(chain: Chain, reality: Reality) -> Rig {
    let rig = Rig::from_toml(MINIMAL, Path::new("real.toml")).unwrap();
    Rig { plant: PlantDescription::Chain(chain), reality, ..rig }
}

fn machine(chain: &Chain, reality: Reality) -> Box<dyn Plant> {
    real_plant(chain, &rig_of(chain.clone(), reality)).unwrap()
}

fn joint_friction(friction_n_m: f64) -> Reality {
    let mut reality = Reality::default();
    reality.friction.joint_friction_n_m = PerJoint::all(friction_n_m);
    reality
}

fn state(plant: &dyn Plant) -> Vec<f64> {
    let mut state = vec![0.0; plant.states()];
    plant.write_state(&mut state);
    state
}

/// A block of 2 kg, with a link that is too light to matter, on a rail that rises by 0.1 rad.
fn block_on_incline(friction_n: f64) -> Box<dyn Plant> {
    let mut reality = Reality::default();
    reality.friction.cart_friction_n = friction_n;
    reality.sensors.rail_tilt_rad = 0.1;
    let mut block = machine(&chain(2.0, vec![rod(1e-12, 0.5)]), reality);
    block.set_state(&[0.0, 0.0, PI, 0.0]);
    block
}

#[test]
fn a_block_on_an_incline_sticks_for_minutes_or_slides_as_in_the_textbook() {
    let pull_n = 2.0 * 9.81 * 0.1f64.sin();
    // The spring of the contact is loaded suddenly and overshoots to twice its deflection, so with a factor of 1.01
    // the block slips before it sticks.
    for (factor, slip_m, creep_m) in [(3.0, 5e-5, 1e-20), (1.01, 5e-3, 1e-15)] {
        let mut stuck = block_on_incline(factor * pull_n);
        stuck.advance(0.0, &[0.0], 20.0, 20_000);
        let at = state(&*stuck)[0];
        assert!(at < 0.0 && at > -slip_m, "{factor}: {at}");
        stuck.advance(0.0, &[0.0], 180.0, 180_000);
        let here = state(&*stuck)[0];
        assert!((here - at).abs() <= creep_m, "{factor}: {here:e} after {at:e}");
    }
    let mut sliding = block_on_incline(0.5 * pull_n);
    sliding.advance(0.0, &[0.0], 0.5, 500);
    let before = state(&*sliding)[1];
    sliding.advance(0.0, &[0.0], 1.0, 1000);
    let acceleration = state(&*sliding)[1] - before;
    assert!((acceleration + 0.25 * pull_n).abs() < 1e-9, "{acceleration}");
}

/// Turning points (rad, from hanging) of a pendulum that is let go at `angle`; its cart is too heavy to move.
fn turning_points(friction_n_m: f64, angle: f64, count: usize) -> Vec<f64> {
    let mut reality = joint_friction(friction_n_m);
    reality.friction.presliding_rad = PerJoint::all(1e-5);
    let mut pendulum = machine(&chain(1e12, vec![rod(1.0, 1.0)]), reality);
    pendulum.set_state(&[0.0, 0.0, PI + angle, 0.0]);
    let (mut points, mut before) = (vec![angle], 0.0);
    while points.len() < count {
        pendulum.advance(0.0, &[0.0], 1e-4, 1);
        let now = state(&*pendulum);
        if before * now[3] < 0.0 {
            points.push(now[2] - PI);
        }
        before = now[3];
    }
    points
}

#[test]
fn the_swing_of_a_pendulum_with_dry_friction_decays_linearly() {
    // F / (m g c): half of what the swing loses from one turning point to the next.
    let loss = |friction: f64| friction / (9.81 * 0.5);
    let points = turning_points(0.02, 0.1, 11);
    for pair in points.windows(2) {
        let lost = pair[0].abs() - pair[1].abs();
        // m g c (cos θ' - cos θ) = F (θ + θ'): at 0.1 rad within 0.2 % of the linear law.
        assert!((lost / (2.0 * loss(0.02)) - 1.0).abs() < 4e-3, "{points:?}");
    }
    // With viscous friction the losses would shrink with the swing, to 35 % here.
    let (first, last) = (points[0].abs() - points[1].abs(), points[9].abs() - points[10].abs());
    assert!(last > 0.99 * first, "{first} {last}");
}

#[test]
fn air_drag_takes_the_cube_of_each_links_rate() {
    let drag = [0.05, 0.02];
    let swing = |drag: PerJoint| {
        let mut reality = Reality::default();
        reality.air_drag.air_drag_n_m_s2_per_rad2 = drag;
        let mut links = machine(&unequal_rods(2), reality);
        links.set_state(&[0.0, 0.0, 1.5, 0.0, -2.0, 0.0]);
        links
    };
    let energy = |plant: &dyn Plant| plant.energy().map(|energy| energy.kinetic + energy.potential).unwrap();
    let mut swinging = swing(PerJoint::each(drag.to_vec()));
    let (before, mut lost) = (energy(&*swinging), 0.0);
    let mut last = 0.0;
    for _ in 0..20_000 {
        swinging.advance(0.0, &[0.0; 2], 1e-4, 1);
        let now = state(&*swinging);
        // The drag acts on the rate of a link, not of a joint.
        let power = drag[0] * now[3].abs().powi(3) + drag[1] * (now[3] + now[5]).abs().powi(3);
        lost += 0.5e-4 * (last + power);
        last = power;
    }
    let found = before - energy(&*swinging);
    assert!(found > 0.1 && (found / lost - 1.0).abs() < 1e-4, "{found} {lost}");
    // The negative control: without the key nothing is lost.
    let mut free = swing(PerJoint::all(0.0));
    free.advance(0.0, &[0.0; 2], 2.0, 20_000);
    assert!((before - energy(&*free)).abs() < 1e-6 * found);
}

#[test]
fn stuck_joints_stay_stuck_to_machine_precision_for_minutes() {
    let links = 3;
    let mut hanging = vec![0.0; 2 * links + 2];
    for (joint, angle) in [PI + 0.05, -0.1, 0.2].into_iter().enumerate() {
        hanging[2 + 2 * joint] = angle;
    }
    let mut reality = joint_friction(2.0);
    reality.friction.cart_friction_n = 5.0;
    let mut stuck = machine(&unequal_rods(links), reality.clone());
    stuck.set_state(&hanging);
    let minute = |plant: &mut dyn Plant| {
        plant.advance(0.0, &vec![0.0; links], 60.0, 60_000);
        state(plant)[2..].iter().copied().step_by(2).collect::<Vec<f64>>()
    };
    let settled = minute(&mut *stuck);
    for _ in 0..3 {
        assert_eq!(minute(&mut *stuck), settled, "to the last bit");
    }
    reality.friction.joint_friction_n_m = PerJoint::all(0.02);
    let mut loose = machine(&unequal_rods(links), reality);
    loose.set_state(&hanging);
    assert!((minute(&mut *loose)[0] - hanging[2]).abs() > 0.01, "with less friction they fall");
}

fn any_reality() -> impl Strategy<Value = Reality> {
    let friction = (0.0..0.3f64, 0.0..3.0f64, 0.0..100.0f64);
    let train = (prop::option::of(1e-4..1e-2f64), prop::option::of(1e-5..1e-3f64));
    (friction, train, -0.1..0.1f64).prop_map(|((joints, cart, breakaway), (backlash, compliance), tilt)| {
        let mut reality = joint_friction(joints);
        reality.friction.cart_friction_n = cart;
        reality.friction.breakaway_percent = breakaway;
        reality.drive_train.backlash_m = backlash.unwrap_or_default();
        reality.drive_train.belt_compliance_m_per_n = compliance.unwrap_or_default();
        reality.sensors.rail_tilt_rad = tilt;
        reality
    })
}

/// Largest gain of energy in 1 ms during 0.3 s, as a share of the energy between upright and hanging.
fn largest_gain(chain: &Chain, reality: &Reality, start: &[f64]) -> f64 {
    let range = 2.0 * chain_plant(chain).unwrap().energy().unwrap().total();
    let mut plant = machine(chain, reality.clone());
    plant.set_state(start);
    let none = vec![0.0; chain.links.len()];
    let (mut before, mut gain) = (plant.energy().unwrap().total(), f64::MIN);
    for _ in 0..300 {
        plant.advance(0.0, &none, 1e-3, 10);
        let after = plant.energy().unwrap().total();
        gain = gain.max(after - before);
        before = after;
    }
    gain / range
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    /// Energy is lost except for the error of the integration, which the plant without friction has as well.
    #[test]
    fn energy_is_only_ever_lost(
        reality in any_reality(), links in 1..5usize, start in prop::collection::vec(-2.0..2.0f64, 10),
    ) {
        let chain = unequal_rods(links);
        let gain = largest_gain(&chain, &reality, &start[..2 * links + 2]);
        prop_assert!(gain < 1e-8, "{gain:e}");
    }
}

/// State of two links with dry friction after 3 s, with steps shorter than the derived ones by the factor `divisor`.
fn end_of_swing(reality: &Reality, divisor: f64) -> Vec<f64> {
    let chain = unequal_rods(2);
    let mut plant = RealChain::<2>::new(&chain, &rig_of(chain.clone(), reality.clone())).unwrap();
    let steps = (3.0 * divisor / plant.longest_step_s()).ceil() as usize;
    plant.set_state(&[0.0, 0.0, PI + 0.5, 0.0, -0.3, 0.0]);
    plant.advance(0.0, &[0.0; 2], 3.0, steps);
    state(&plant)
}

#[test]
fn a_smaller_step_changes_little() {
    let errors = |breakaway_percent: f64| {
        let mut reality = joint_friction(0.05);
        reality.friction.cart_friction_n = 1.0;
        reality.friction.breakaway_percent = breakaway_percent;
        let reference = end_of_swing(&reality, 64.0);
        [1.0, 2.0, 8.0].map(|divisor| {
            let end = end_of_swing(&reality, divisor);
            end.iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        })
    };
    let coulomb = errors(0.0);
    assert!(coulomb[0] < 1e-6 && coulomb[1] < 0.1 * coulomb[0] && coulomb[2] < coulomb[1], "{coulomb:?}");
    // Where the friction falls with the speed it is nearly discontinuous, and the order is lower.
    let stribeck = errors(30.0);
    assert!(stribeck.iter().all(|&error| error < 2e-4), "{stribeck:?}");
}
