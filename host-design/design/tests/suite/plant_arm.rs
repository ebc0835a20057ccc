//! Links on an arm against another program's equations, and an arm against the cart that it becomes.

use serde::Deserialize;
use upright_design::plant::chain_plant;
use upright_design::rig::{Base, CartInput, Chain};

use crate::plant_rigs::{chain, rod, unequal_rods, with_friction};

/// Largest difference of an acceleration, relative to the largest of its machine.
const TOLERANCE: f64 = 1e-10;

#[derive(Deserialize)]
struct Arm {
    inertia: f64,
    friction: f64,
}

#[derive(Deserialize)]
struct ThickLink {
    mass_kg: f64,
    length_m: f64,
    centre_of_mass_m: f64,
    inertia_kg_m2: f64,
    axial_inertia_kg_m2: f64,
    friction_n_m_s_per_rad: f64,
    radius_m: f64,
}

/// A machine in motion, and its accelerations in MuJoCo: what `arm_in_mujoco.py` writes.
#[derive(Deserialize)]
struct Case {
    arm: Arm,
    links: Vec<ThickLink>,
    angles_rad: Vec<f64>,
    rates_rad_per_s: Vec<f64>,
    torques_n_m: Vec<f64>,
    accelerations: Vec<f64>,
    /// Acceleration of the arm that a drive imposes, and those of the joints that follow from it.
    imposed: f64,
    following: Vec<f64>,
}

impl Case {
    fn chain(&self, input: CartInput) -> Chain {
        let links = self.links.iter().map(|link| {
            let mut of = rod(link.mass_kg, link.length_m);
            of.centre_of_mass_m = Some(link.centre_of_mass_m);
            of.inertia_kg_m2 = Some(link.inertia_kg_m2);
            of.axial_inertia_kg_m2 = link.axial_inertia_kg_m2;
            of.friction_n_m_s_per_rad = link.friction_n_m_s_per_rad;
            of.radius_m = link.radius_m;
            of
        });
        let mut chain = chain(self.arm.inertia, links.collect());
        chain.cart.friction_n_s_per_m = self.arm.friction;
        (chain.base, chain.input) = (Base::Arm, input);
        chain
    }

    /// Largest difference from `wanted` of the accelerations of arm and joints, relative to the largest.
    fn difference(&self, chain: &Chain, input: f64, wanted: &[f64]) -> f64 {
        let plant = chain_plant(chain).unwrap();
        let pairs = self.angles_rad.iter().zip(&self.rates_rad_per_s);
        let state: Vec<f64> = pairs.flat_map(|(angle, rate)| [*angle, *rate]).collect();
        let mut rate = vec![0.0; state.len()];
        plant.rate(&state, input, &self.torques_n_m[1..], &mut rate);
        let found = rate.iter().skip(1).step_by(2);
        let largest = wanted.iter().fold(0.0, |most: f64, of| most.max(of.abs()));
        found.zip(wanted).fold(0.0, |most: f64, (found, wanted)| most.max((found - wanted).abs() / largest))
    }
}

#[test]
fn accelerations_are_those_of_mujoco() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("arm_in_mujoco.json")).unwrap();
    assert_eq!(cases.len(), 12);
    for case in &cases {
        let pushed = case.chain(CartInput::Force);
        let difference = |chain: &Chain| case.difference(chain, case.torques_n_m[0], &case.accelerations);
        assert!(difference(&pushed) < TOLERANCE, "{} links: {:e}", case.links.len(), difference(&pushed));
        let moved = case.chain(CartInput::Acceleration);
        let wanted: Vec<f64> = [case.imposed].into_iter().chain(case.following.iter().copied()).collect();
        let imposed = case.difference(&moved, case.imposed, &wanted);
        assert!(imposed < TOLERANCE, "{} links, imposed: {imposed:e}", case.links.len());
        // Negative controls: a link that is thin, one at another distance, and a cart are other machines.
        let mut thin = pushed.clone();
        thin.links[0].axial_inertia_kg_m2 = 0.0;
        let mut farther = pushed.clone();
        farther.links[0].radius_m *= 1.001;
        let cart = Chain { base: Base::Cart, ..pushed.clone() };
        for other in [thin, farther, cart] {
            assert!(difference(&other) > 1e4 * TOLERANCE, "{:e}", difference(&other));
        }
    }
}

/// An arm that is so long that its end moves in a straight line, in metres of arc.
#[test]
fn a_very_long_arm_is_a_cart() {
    let cart = with_friction(unequal_rods(3), 1.0);
    let (radius_m, state) = (1e6, [0.3, -0.8, 2.0, 1.0, -0.7, 3.0, 0.4, -2.0]);
    let on_arm = |radius_m: f64| {
        let mut arm = Chain { base: Base::Arm, ..cart.clone() };
        arm.links.iter_mut().for_each(|link| link.radius_m = radius_m);
        arm
    };
    let mut arm = on_arm(radius_m);
    arm.cart.mass_kg = cart.cart.mass_kg.map(|mass_kg| mass_kg * radius_m * radius_m);
    arm.cart.friction_n_s_per_m *= radius_m * radius_m;
    let rates = |chain: &Chain, scale: f64| {
        let mut state = state;
        (state[0], state[1]) = (state[0] / scale, state[1] / scale);
        let mut rate = [0.0; 8];
        chain_plant(chain).unwrap().rate(&state, 2.0 * scale, &[0.1, -0.1, 0.05], &mut rate);
        rate[1] *= scale;
        [rate[1], rate[3], rate[5], rate[7]]
    };
    let (of_cart, of_arm) = (rates(&cart, 1.0), rates(&arm, radius_m));
    for (cart, arm) in of_cart.iter().zip(&of_arm) {
        assert!((cart - arm).abs() < 1e-8 * (1.0 + cart.abs()), "{cart} {arm}");
    }
    // Negative control: an arm of half a metre is not.
    let mut short = on_arm(0.5);
    short.cart.mass_kg = cart.cart.mass_kg.map(|mass_kg| 0.25 * mass_kg);
    assert!((rates(&short, 0.5)[1] - of_cart[1]).abs() > 1e-2);
}
