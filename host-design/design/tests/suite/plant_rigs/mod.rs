//! Chains shared by the tests of the plant.

// Each test program uses only some of these.
#![allow(dead_code)]

use proptest::prelude::*;
use upright_design::rig::{Base, Cart, Chain, Link, TurnErrors};

/// A uniform rod without friction.
pub(crate) fn rod(mass_kg: f64, length_m: f64) -> Link {
    Link {
        sensor_delay_s: 0.0,
        radius_m: 0.0,
        axial_inertia_kg_m2: 0.0,
        part: None,
        errors: TurnErrors::default(),
        mass_kg,
        length_m,
        centre_of_mass_m: None,
        inertia_kg_m2: None,
        friction_n_m_s_per_rad: 0.0,
        encoder: None,
    }
}

/// Links on a cart without friction.
pub(crate) fn chain(cart_mass_kg: f64, links: Vec<Link>) -> Chain {
    Chain {
        cart: Cart {
            mass_kg: Some(cart_mass_kg),
            friction_n_s_per_m: 0.0,
            travel_m: [-2.0, 2.0],
            encoder_step_m: None,
            sensor_bits: None,
            sensor_noise_m: 0.0,
        },
        base: Base::Cart,
        links,
        gravity_m_per_s2: 9.81,
        input: Default::default(),
    }
}

/// The rig of F. J. Ticona Coaquira's paper.
pub(crate) fn paper() -> Chain {
    chain(0.1, [0.03, 0.04, 0.07, 0.10].map(|length| rod(0.1, length)).to_vec())
}

/// A chain of `n` unequal rods without friction, the size of a classroom rig.
pub(crate) fn unequal_rods(n: usize) -> Chain {
    chain(0.8, (0..n).map(|i| rod(0.3 - 0.03 * i as f64, 0.2 + 0.05 * ((7 * i) % 3) as f64)).collect())
}

/// `chain` with friction in every bearing; a negative factor accelerates instead of braking.
pub(crate) fn with_friction(mut chain: Chain, factor: f64) -> Chain {
    chain.cart.friction_n_s_per_m = 0.5 * factor;
    for link in &mut chain.links {
        link.friction_n_m_s_per_rad = 2e-3 * factor;
    }
    chain
}

/// Any link that a workshop would make: 10 g to 1 kg, 5 cm to 1 m, its mass anywhere along it.
pub(crate) fn any_link() -> impl Strategy<Value = Link> {
    let given = prop::option::of((0.1..1.0f64, 0.01..0.3f64));
    let on_arm = (0.05..0.5f64, 0.0..1e-3f64);
    (0.01..1.0f64, 0.05..1.0f64, given, 0.0..0.01f64, on_arm).prop_map(
        |(mass, length, given, friction, on_arm)| Link {
            radius_m: on_arm.0,
            axial_inertia_kg_m2: on_arm.1 * mass * length * length,
            sensor_delay_s: 0.0,
            centre_of_mass_m: given.map(|(where_on_it, _)| where_on_it * length),
            inertia_kg_m2: given.map(|(_, share)| share * mass * length * length),
            friction_n_m_s_per_rad: friction,
            ..rod(mass, length)
        },
    )
}

/// Any chain of `links` such links on a cart of 50 g to 5 kg, or on an arm with such an inertia.
pub(crate) fn any_chain(links: core::ops::RangeInclusive<usize>) -> impl Strategy<Value = Chain> {
    let base = prop::sample::select(vec![Base::Cart, Base::Arm]);
    (base, 0.05..5.0f64, 0.0..5.0f64, prop::collection::vec(any_link(), links), 1.0..25.0f64).prop_map(
        |(base, cart_mass, friction, links, gravity)| {
            let mut any = Chain { base, ..chain(cart_mass, links) };
            any.cart.friction_n_s_per_m = friction;
            any.gravity_m_per_s2 = gravity;
            any
        },
    )
}

/// A chain and a random state in motion: `x, ẋ, θ_1, θ̇_1, …`.
pub(crate) fn any_chain_in_motion(
    links: core::ops::RangeInclusive<usize>,
) -> impl Strategy<Value = (Chain, Vec<f64>)> {
    any_chain(links).prop_flat_map(|chain| {
        let states = 2 * chain.links.len() + 2;
        (Just(chain), prop::collection::vec(-4.0..4.0f64, states))
    })
}
