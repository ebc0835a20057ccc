//! Simulation of a plant that is given as a linear model.

use crate::plant_rigs::paper;
use upright::table::Equilibrium;
use upright_design::plant::reference::{Tolerance, integrate};
use upright_design::plant::{ChainParameters, LinearSimulation, Plant, chain_plant, linearise};
use upright_design::rig::LinearPlant;

fn model(a: Vec<Vec<f64>>, b: Vec<f64>, noise_input: Option<Vec<Vec<f64>>>) -> LinearPlant {
    LinearPlant { a, b, output: 0, measured: vec![0], measured_steps: vec![1e-3], noise_input }
}

fn end_of(plant: &dyn Plant) -> Vec<f64> {
    let mut state = vec![0.0; plant.states()];
    plant.write_state(&mut state);
    state
}

#[test]
fn an_oscillator_follows_its_closed_form() {
    // ẍ = -ω² x + u + w from rest: x = (u + w)/ω² (1 - cos ω t).
    let omega = 300.0;
    let mut plant = LinearSimulation::of(&model(
        vec![vec![0.0, 1.0], vec![-omega * omega, 0.0]],
        vec![0.0, 1.0],
        Some(vec![vec![0.0, 1.0]]),
    ));
    assert_eq!((plant.links(), plant.states(), plant.disturbances()), (0, 2, 1));
    assert_eq!(plant.energy(), None);
    plant.advance(2.0, &[0.5], 0.01, 1);
    let (angle, size) = (omega * 0.01, 2.5 / (omega * omega));
    let end = end_of(&plant);
    assert!((end[0] - size * (1.0 - angle.cos())).abs() < 1e-12 * size);
    assert!((end[1] - size * omega * angle.sin()).abs() < 1e-12 * size * omega);
}

#[test]
fn the_number_of_substeps_changes_nothing() {
    let chain = linearise(&ChainParameters::<f64>::of(&paper()), Equilibrium::UPRIGHT).unwrap();
    let b = chain.b.entries().to_vec();
    let rig = model(chain.a.to_f64_rows(), b, None);
    let start = [0.1, 0.0, 0.01, 0.0, 0.0, 0.2, 0.0, 0.0, -0.01, 0.0];
    let run = |substeps: usize| {
        let mut plant = LinearSimulation::of(&rig);
        plant.set_state(&start);
        plant.advance(0.3, &[], 0.02, substeps);
        end_of(&plant)
    };
    let tolerance = Tolerance { relative: 1e-13, absolute: 1e-13 };
    let exact = integrate(&LinearSimulation::of(&rig), &start, |_, _| 0.3, &[], 0.02, tolerance).unwrap();
    for (one, (many, exact)) in run(1).iter().zip(run(50).iter().zip(exact)) {
        assert!((one - many).abs() < 1e-11 * (1.0 + one.abs()));
        assert!((one - exact).abs() < 1e-10 * (1.0 + one.abs()));
    }
}

#[test]
fn near_upright_the_chain_moves_as_its_linear_model() {
    let chain = linearise(&ChainParameters::<f64>::of(&paper()), Equilibrium::UPRIGHT).unwrap();
    let mut linear = LinearSimulation::of(&model(chain.a.to_f64_rows(), chain.b.entries().to_vec(), None));
    let mut nonlinear = chain_plant(&paper()).unwrap();
    // The difference is of third order in the amplitude of the motion.
    let mut difference = |size: f64| {
        let start: Vec<f64> = (0..10).map(|i| size * (1.0 - 0.2 * f64::from(i))).collect();
        linear.set_state(&start);
        nonlinear.set_state(&start);
        linear.advance(size, &[], 0.02, 1);
        nonlinear.advance(size, &[0.0; 4], 0.02, 400);
        let pairs = end_of(&linear).into_iter().zip(end_of(&*nonlinear));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let order = (difference(2e-3) / difference(1e-3)).log2();
    assert!((order - 3.0).abs() < 0.05, "order {order}");
}
