//! The linear model, compared with closed forms and the nonlinear plant.

use crate::plant_rigs::{any_chain, any_link, chain, paper};
use proptest::prelude::*;
use upright::table::Equilibrium;
use upright_design::numerics::{Matrix, Wide, solve};
use upright_design::plant::{ChainParameters, LinearModel, chain_plant, linearise};
use upright_design::rig::Chain;

type W = Wide;

fn model(chain: &Chain, about: Equilibrium) -> LinearModel<f64> {
    linearise(&ChainParameters::of(chain), about).expect("a mass matrix with an inverse")
}

/// Largest difference of two matrices, relative to the largest entry of the same column in the first one. A column is
/// the solution of the equations of motion for one cause, and the error of a solution scales with its size.
fn difference(a: &Matrix<f64>, b: &Matrix<f64>) -> f64 {
    (0..a.cols())
        .map(|j| {
            let column = |f: &dyn Fn(usize) -> f64| (0..a.rows()).map(|i| f(i).abs()).fold(0.0, f64::max);
            column(&|i| a[(i, j)] - b[(i, j)]) / column(&|i| a[(i, j)]).max(f64::MIN_POSITIVE)
        })
        .fold(0.0, f64::max)
}

/// `A`, `B` and `G` by central differences of the nonlinear plant.
fn differences(chain: &Chain, about: Equilibrium) -> LinearModel<f64> {
    let plant = chain_plant(chain).expect("a size that is compiled");
    let (s, n) = (plant.states(), plant.links());
    let mut rest = vec![0.0; s];
    for joint in 0..n {
        rest[2 + 2 * joint] = core::f64::consts::PI * f64::from(about.half_turns(joint));
    }
    // One column out of s + 1 + n: a step in a state, in the force or in a torque.
    let column = |index: usize| {
        let h = 1e-5;
        let rate = |step: f64| {
            let (mut state, mut inputs, mut rate) = (rest.clone(), vec![0.0; 1 + n], vec![0.0; s]);
            match index.checked_sub(s) {
                None => state[index] += step,
                Some(input) => inputs[input] += step,
            }
            plant.rate(&state, inputs[0], &inputs[1..], &mut rate);
            rate
        };
        rate(h).iter().zip(rate(-h)).map(|(up, down)| (up - down) / (2.0 * h)).collect::<Vec<_>>()
    };
    let columns: Vec<_> = (0..s + 1 + n).map(column).collect();
    LinearModel {
        a: Matrix::from_fn(s, s, |i, j| columns[j][i]),
        b: Matrix::from_fn(s, 1, |i, _| columns[s][i]),
        torque_inputs: Matrix::from_fn(s, n, |i, j| columns[s + 1 + j][i]),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    // Central differences at 1e-5 are accurate to about 1e-9; a wrong term would be of order 1.
    #[test]
    fn the_linear_model_is_the_derivative_of_the_nonlinear_plant(chain in any_chain(1..=8), down: u8) {
        let about = Equilibrium::of_bits(down.into()).of_links(chain.links.len());
        let (exact, measured) = (model(&chain, about), differences(&chain, about));
        prop_assert!(difference(&exact.a, &measured.a) < 1e-7);
        prop_assert!(difference(&exact.b, &measured.b) < 1e-7);
        prop_assert!(difference(&exact.torque_inputs, &measured.torque_inputs) < 1e-7);

        // Negative control: the comparison sees one joint whose friction is 1 % off.
        let mut wrong = chain.clone();
        wrong.links[0].friction_n_m_s_per_rad = 1.01 * chain.links[0].friction_n_m_s_per_rad + 1e-3;
        prop_assert!(difference(&model(&wrong, about).a, &measured.a) > 1e-7);
    }

    #[test]
    fn one_link_has_the_textbook_linear_model(cart_mass in 0.05..5.0f64, link in any_link(), friction in 0.0..3.0f64, hanging: bool) {
        let mut rig = chain(cart_mass, vec![link.clone()]);
        rig.cart.friction_n_s_per_m = friction;
        let (about, sign) = if hanging { (Equilibrium::HANGING, -1.0) } else { (Equilibrium::UPRIGHT, 1.0) };
        // M ẍ - s m c θ̈ = u - d_0 ẋ,  -s m c ẍ + J θ̈ = s m g c θ - d_1 θ̇ + τ, by Cramer's rule; s = ±1.
        let (m, l) = (link.mass_kg, link.length_m);
        let c = link.centre_of_mass_m.unwrap_or(l / 2.0);
        let j = link.inertia_kg_m2.unwrap_or(m * l * l / 12.0) + m * c * c;
        let (total, mc, d1, g) = (cart_mass + m, m * c, link.friction_n_m_s_per_rad, rig.gravity_m_per_s2);
        let det = total * j - mc * mc;
        let row = |force: f64, torque: f64| [-force * friction, sign * mc * g * torque, -d1 * torque, force, torque];
        let cart = row(j / det, sign * mc / det);
        let joint = row(sign * mc / det, total / det);
        let ours = model(&rig, about);
        for (i, expected) in [(1, cart), (3, joint)] {
            let found = [ours.a[(i, 1)], ours.a[(i, 2)], ours.a[(i, 3)], ours.b[(i, 0)], ours.torque_inputs[(i, 0)]];
            for (expected, found) in expected.into_iter().zip(found) {
                // The determinant loses a few digits if the cart's mass and the inertia are small.
                prop_assert!((expected - found).abs() <= 1e-12 * expected.abs(), "{expected} {found}");
            }
        }
    }

    #[test]
    fn double_and_extended_precision_agree(chain in any_chain(1..=8), down: u8) {
        let about = Equilibrium::of_bits(down.into());
        let wide = linearise(&ChainParameters::<W>::of(&chain), about).unwrap();
        let double = model(&chain, about);
        // A few rounding errors, times the condition number of the solved equations.
        let upright = ChainParameters::<f64>::of(&chain).mass_matrix(&vec![0.0; chain.links.len()]);
        let inverse = solve(&upright, &Matrix::identity(upright.rows())).unwrap();
        let tolerance = 4.0 * f64::EPSILON * upright.norm() * inverse.norm();
        prop_assert!(tolerance < 1e-6);
        prop_assert!(difference(&wide.a.map(W::round_to_f64), &double.a) < tolerance);
        prop_assert!(difference(&wide.b.map(W::round_to_f64), &double.b) < tolerance);
        prop_assert!(difference(&wide.torque_inputs.map(W::round_to_f64), &double.torque_inputs) < tolerance);
    }
}

#[test]
fn a_chain_that_moves_no_mass_has_no_linear_model() {
    let mut nothing = paper();
    nothing.links[3].mass_kg = 0.0;
    assert!(linearise(&ChainParameters::<f64>::of(&nothing), Equilibrium::UPRIGHT).is_err());
    assert!(linearise(&ChainParameters::<W>::of(&nothing), Equilibrium::UPRIGHT).is_err());
}
