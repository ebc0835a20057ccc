//! The equations of motion at one instant: compared with their definition, with energy and power, and checked for
//! signs.

use crate::plant_rigs::{any_chain_in_motion, paper, unequal_rods};
use proptest::prelude::*;
use upright_design::numerics::Matrix;
use upright_design::plant::{ChainParameters, ChainPlant, Plant, WideChainState, chain_plant};
use upright_design::rig::Chain;

fn rate_of(plant: &dyn Plant, state: &[f64], force: f64, torques: &[f64]) -> Vec<f64> {
    let mut rate = vec![0.0; state.len()];
    plant.rate(state, force, torques, &mut rate);
    rate
}

/// Absolute angles and their rates.
fn absolute(state: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let sums = |offset: usize| {
        let each = state[2..].iter().skip(offset).step_by(2);
        each.scan(0.0, |sum, relative| {
            *sum += relative;
            Some(*sum)
        })
        .collect()
    };
    (sums(0), sums(1))
}

/// Mechanical energy from the motion of each centre of mass, directly from the geometry of the rig.
fn energy_of_masses(chain: &Chain, state: &[f64]) -> f64 {
    let (phi, rate) = absolute(state);
    let mut energy = 0.5 * chain.cart.mass_kg.unwrap() * state[1] * state[1];
    let (mut joint_height, mut joint_offset, mut joint_velocity) = (0.0, 0.0, (0.0, 0.0));
    for (i, link) in chain.links.iter().enumerate() {
        let (m, l) = (link.mass_kg, link.length_m);
        let base_speed = state[1] * chain.radius_m(i).unwrap_or(1.0);
        let c = link.centre_of_mass_m.unwrap_or(l / 2.0);
        let inertia = link.inertia_kg_m2.unwrap_or(m * l * l / 12.0);
        // A point at distance r along the link is at (-r sin φ, r cos φ) from its joint.
        let velocity = |r: f64| {
            (joint_velocity.0 - r * phi[i].cos() * rate[i], joint_velocity.1 - r * phi[i].sin() * rate[i])
        };
        let v = velocity(c);
        let along = base_speed + v.0;
        energy += 0.5 * m * (along * along + v.1 * v.1) + 0.5 * inertia * rate[i] * rate[i];
        if chain.radius_m(i).is_some() {
            // The arm turns the centre of mass about its axis at the distance that it has left the links' plane by,
            // and the link about its length and across it.
            let (across, axial) = (joint_offset - c * phi[i].sin(), link.axial_inertia_kg_m2);
            let (about_length, about_side) = (state[1] * phi[i].cos(), state[1] * phi[i].sin());
            energy += 0.5 * m * (state[1] * across).powi(2);
            energy += 0.5 * axial * about_length * about_length + 0.5 * inertia * about_side * about_side;
        }
        energy += m * chain.gravity_m_per_s2 * (joint_height + c * phi[i].cos());
        joint_height += l * phi[i].cos();
        joint_offset -= l * phi[i].sin();
        joint_velocity = velocity(l);
    }
    energy
}

fn energy_at(plant: &mut dyn Plant, state: &[f64]) -> f64 {
    plant.set_state(state);
    plant.energy().expect("a chain has energy").total()
}

/// The sum of the magnitudes of all terms of the energy: its rounding is relative to them, as terms of both signs
/// may cancel.
fn largest_energy(chain: &Chain, state: &[f64]) -> f64 {
    let p = ChainParameters::<f64>::of(chain);
    let (phi, w) = absolute(state);
    let m = p.mass_matrix(&phi);
    let speeds: Vec<f64> = std::iter::once(state[1]).chain(w).collect();
    let kinetic: f64 = (0..speeds.len())
        .flat_map(|i| (0..speeds.len()).map(move |j| (i, j)))
        .map(|(i, j)| 0.5 * (m[(i, j)] * speeds[i] * speeds[j]).abs())
        .sum();
    kinetic + p.weight.iter().sum::<f64>()
}

fn is_positive_definite(m: &Matrix<f64>) -> bool {
    // Cholesky (Golub & Van Loan, algorithm 4.2.1): every pivot positive.
    let mut l = Matrix::<f64>::zeros(m.rows(), m.rows());
    for j in 0..m.rows() {
        for i in j..m.rows() {
            let rest = m[(i, j)] - (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>();
            if i == j && rest <= 0.0 {
                return false;
            }
            l[(i, j)] = if i == j { rest.sqrt() } else { rest / l[(j, j)] };
        }
    }
    true
}

proptest! {
    #[test]
    fn the_mass_matrix_is_symmetric_and_positive_definite((chain, state) in any_chain_in_motion(1..=14)) {
        let parameters = ChainParameters::<f64>::of(&chain);
        let mut m = parameters.mass_matrix(&absolute(&state).0);
        prop_assert_eq!(&m.transpose(), &m);
        prop_assert!(is_positive_definite(&m));
        // Negative control: the total mass on the rail cannot be 0.
        m[(0, 0)] = 0.0;
        prop_assert!(!is_positive_definite(&m));
    }

    #[test]
    fn energy_is_that_of_the_moving_masses((chain, state) in any_chain_in_motion(1..=14)) {
        let mut plant = chain_plant(&chain).unwrap();
        let expected = energy_of_masses(&chain, &state);
        plant.set_state(&state);
        let energy = plant.energy().unwrap();
        let size = energy.kinetic + energy.potential.abs() + 1.0;
        prop_assert!((energy.total() - expected).abs() < 1e-12 * size);
        let mut longer = chain.clone();
        longer.links[0].mass_kg *= 1.001;
        prop_assert!((energy_of_masses(&longer, &state) - expected).abs() > 1e-12 * size);
    }

    /// The energy changes by the power of force and torques minus the power lost to friction:
    /// `Ė = u ẋ + Σ τ_i θ̇_i - d_0 ẋ² - Σ d_i θ̇_i²`.
    #[test]
    fn energy_changes_by_the_power_of_forces_and_frictions((chain, state) in any_chain_in_motion(1..=8), force in -20.0..20.0f64) {
        let mut plant = chain_plant(&chain).unwrap();
        let torques: Vec<f64> = (0..plant.links()).map(|i| 0.3 - 0.2 * i as f64).collect();
        let rate = rate_of(&*plant, &state, force, &torques);
        let mut power = force * state[1] - chain.cart.friction_n_s_per_m * state[1] * state[1];
        for (i, link) in chain.links.iter().enumerate() {
            let w = state[2 * i + 3];
            power += torques[i] * w - link.friction_n_m_s_per_rad * w * w;
        }
        // Energy along the direction of motion, by a central difference scaled to the speed of the motion.
        let speed = rate.iter().fold(1.0, |most: f64, r| most.max(r.abs()));
        let h = 1e-4 / speed;
        let mut energy_after = |t: f64| {
            let moved: Vec<f64> = state.iter().zip(&rate).map(|(x, r)| x + t * r).collect();
            energy_at(&mut *plant, &moved)
        };
        // Richardson: two central differences leave an error of order h⁴.
        let mut slope = |h: f64| (energy_after(h) - energy_after(-h)) / (2.0 * h);
        let measured = (4.0 * slope(h) - slope(2.0 * h)) / 3.0;
        let size = power.abs() + speed * (largest_energy(&chain, &state) + 1.0);
        prop_assert!((measured - power).abs() < 1e-10 * size, "{measured} {power} {size}");
    }

    /// The fast algorithm agrees with the equations as written: `M [ẍ; φ̈] = right-hand side`.
    #[test]
    fn accelerations_satisfy_lagranges_equations((chain, state) in any_chain_in_motion(1..=14), force in -20.0..20.0f64) {
        let p = ChainParameters::<f64>::of(&chain);
        let n = p.links();
        let plant = chain_plant(&chain).unwrap();
        let torques: Vec<f64> = (0..n).map(|i| 0.1 * i as f64 - 0.2).collect();
        let rate = rate_of(&*plant, &state, force, &torques);
        let (phi, w) = absolute(&state);
        let accelerations = absolute(&rate).1;
        let m = p.mass_matrix(&phi);
        let turning = |j: usize| -> f64 {
            p.turning.as_ref().map_or(0.0, |beta| (0..n).map(|k| beta[(j, k)] * phi[k].sin()).sum())
        };
        let tau = |i: usize| if i < n { torques[i] - p.joint_frictions[i] * state[2 * i + 3] } else { 0.0 };
        for row in 0..=n {
            let mut terms: Vec<f64> = (0..n).map(|k| m[(row, k + 1)] * accelerations[k]).collect();
            terms.push(m[(row, 0)] * rate[1]);
            match row.checked_sub(1) {
                None => {
                    terms.extend((0..n).map(|k| p.a[k] * phi[k].sin() * w[k] * w[k]));
                    terms.extend((0..n).map(|k| 2.0 * state[1] * turning(k) * phi[k].cos() * w[k]));
                    terms.extend([-force, p.cart_friction * state[1]]);
                }
                Some(j) => {
                    terms.push(-state[1] * state[1] * turning(j) * phi[j].cos());
                    terms.extend((0..n).map(|k| p.b[(j, k)] * (phi[j] - phi[k]).sin() * w[k] * w[k]));
                    terms.extend([-p.weight[j] * phi[j].sin(), -tau(j), tau(j + 1)]);
                }
            }
            let (residual, size) = terms.iter().fold((0.0, 0.0), |(sum, size), t| (sum + t, size + t.abs()));
            // Elimination is backward stable; in the cart's row the errors of all links add up.
            prop_assert!(f64::abs(residual) < 1e-11 * (size + 1.0), "row {row}: {residual} of {size}");
        }
    }
}

#[test]
fn a_tilted_link_falls_further_the_same_way() {
    for n in 1..=8 {
        let plant = chain_plant(&unequal_rods(n)).unwrap();
        let mut state = vec![0.0; plant.states()];
        state[2] = 0.1; // every link, relative to the vertical
        let rate = rate_of(&*plant, &state, 0.0, &vec![0.0; n]);
        assert!(rate[3] > 0.0, "counter-clockwise for {n} links");
        // Falling to the left (-x) pushes the cart to the right.
        assert!(rate[1] > 0.0);
        state[2] = core::f64::consts::PI + 0.1;
        assert!(rate_of(&*plant, &state, 0.0, &vec![0.0; n])[3] < 0.0, "a hanging link swings back");
    }
}

#[test]
fn a_push_along_x_moves_the_cart_along_x_and_leaves_the_links_behind() {
    for n in 1..=8 {
        let plant = chain_plant(&unequal_rods(n)).unwrap();
        let rate = rate_of(&*plant, &vec![0.0; plant.states()], 1.0, &vec![0.0; n]);
        // A link left behind tilts to -x, which is counter-clockwise.
        assert!(rate[1] > 0.0 && rate[3] > 0.0);
    }
}

#[test]
fn a_joint_torque_turns_its_link_counter_clockwise() {
    for n in 1..=8 {
        let plant = chain_plant(&unequal_rods(n)).unwrap();
        for joint in 0..n {
            let mut torques = vec![0.0; n];
            torques[joint] = 1e-3;
            let rate = rate_of(&*plant, &vec![0.0; plant.states()], 0.0, &torques);
            assert!(rate[2 * joint + 3] > 0.0);
        }
    }
}

#[test]
fn a_mirrored_start_and_force_give_exactly_the_mirrored_motion() {
    let plant = ChainPlant::<4>::of(&crate::plant_rigs::with_friction(paper(), 1e-3)).unwrap();
    let mut right =
        WideChainState { x: 0.3, xdot: -0.2, phi: [0.1, -0.4, 2.0, 0.3], phidot: [3.0, -1.0, 0.5, 7.0] };
    let mirror = |state: &WideChainState<4>| WideChainState {
        x: -state.x,
        xdot: -state.xdot,
        phi: state.phi.map(|angle| -angle),
        phidot: state.phidot.map(|rate| -rate),
    };
    let mut left = mirror(&right);
    for step in 0..20_000 {
        let force = 3.0 * (0.01 * f64::from(step)).sin();
        right = plant.rk4(&right, force, &[1e-3, -2e-3, 0.0, 1e-4], 1e-4);
        left = plant.rk4(&left, -force, &[-1e-3, 2e-3, 0.0, -1e-4], 1e-4);
    }
    assert_eq!(left, mirror(&right));
    assert!(right.phi[3].abs() > 1.0, "the chain has been moving");
}

#[test]
fn relative_and_absolute_angles_convert_both_ways() {
    let relative = [0.5, -1.0, 0.25, 1.0, -0.5, 2.0, 0.125, -4.0];
    let absolute = WideChainState::<3>::from_relative(&relative);
    assert_eq!(absolute.phi, [0.25, -0.25, -0.125]);
    assert_eq!(absolute.phidot, [1.0, 3.0, -1.0]);
    let mut back = [0.0; 8];
    absolute.write_relative(&mut back);
    assert_eq!(back, relative);
}
