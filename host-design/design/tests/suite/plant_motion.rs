//! Motion over time: energy, natural frequencies and the agreement of the two integrators.

use crate::plant_rigs::{chain, paper, rod, unequal_rods, with_friction};
use upright::table::Equilibrium;
use upright_design::numerics::{Matrix, Real, Wide};
use upright_design::plant::reference::{ReferenceError, Tolerance, integrate};
use upright_design::plant::{
    ChainParameters, ChainPlant, Plant, PlantError, WideChainState, chain_plant, linearise,
};
use upright_design::rig::{Chain, Link, MAX_LINKS};

const TIGHT: Tolerance = Tolerance { relative: 1e-13, absolute: 1e-13 };

/// A state with every link at another angle and in motion.
fn tangled(n: usize) -> Vec<f64> {
    let mut state = vec![0.1, -0.4];
    for i in 0..n {
        state.extend([1.2 - 0.9 * i as f64, 1.5 - 0.7 * i as f64]);
    }
    state
}

fn total_energy(chain: &Chain, state: &[f64]) -> f64 {
    let mut plant = chain_plant(chain).unwrap();
    plant.set_state(state);
    plant.energy().unwrap().total()
}

/// Energy difference between all links upright and all hanging (J).
fn energy_range(chain: &Chain) -> f64 {
    2.0 * total_energy(chain, &vec![0.0; 2 * chain.links.len() + 2])
}

#[test]
fn energy_is_conserved_without_friction() {
    for n in 1..=6 {
        let rig = unequal_rods(n);
        let plant = chain_plant(&rig).unwrap();
        let mut heavier = rig.clone();
        heavier.links[n - 1].mass_kg *= 1.0 + 1e-6;
        let mut state = tangled(n);
        let start = total_energy(&rig, &state);
        let start_if_heavier = total_energy(&heavier, &state);
        let (mut worst, mut worst_if_heavier) = (0.0f64, 0.0f64);
        for _second in 0..10 {
            state = integrate(&*plant, &state, |_, _| 0.0, &vec![0.0; n], 1.0, TIGHT).unwrap();
            worst = worst.max((total_energy(&rig, &state) - start).abs());
            worst_if_heavier =
                worst_if_heavier.max((total_energy(&heavier, &state) - start_if_heavier).abs());
        }
        let range = energy_range(&rig);
        assert!(worst < 1e-10 * range, "{n} links: {:e}", worst / range);
        assert!(worst_if_heavier > 1e-10 * range, "a mass wrong by 1e-6 is noticed for {n} links");
    }
}

/// Largest energy gain in one step of 0.1 ms during 2 s, as a share of the energy range.
fn largest_gain(rig: &Chain) -> f64 {
    let n = rig.links.len();
    let mut plant = chain_plant(rig).unwrap();
    plant.set_state(&tangled(n));
    let mut before = plant.energy().unwrap().total();
    let mut gain = f64::MIN;
    for _ in 0..20_000 {
        plant.advance(0.0, &vec![0.0; n], 1e-4, 1);
        let after = plant.energy().unwrap().total();
        gain = gain.max(after - before);
        before = after;
    }
    gain / energy_range(rig)
}

#[test]
fn energy_never_increases_with_friction() {
    for n in 1..=6 {
        let braked = with_friction(unequal_rods(n), 1.0);
        // Margin for rounding only: at a turning point nothing is dissipated.
        assert!(largest_gain(&braked) < 1e-14, "{n} links: {:e}", largest_gain(&braked));
        assert!(largest_gain(&with_friction(unequal_rods(n), -1e-3)) > 1e-14, "driving is noticed");
    }
}

#[test]
fn a_hanging_link_on_a_cart_swings_with_the_textbook_period() {
    let rig = chain(0.7, vec![rod(0.4, 0.5)]);
    // ω² = (M + m) m g c / ((M + m) J - m² c²) with J = m l²/3, c = l/2.
    let (total, m, l, g) = (1.1, 0.4, 0.5, 9.81);
    let mc: f64 = m * l / 2.0;
    let omega = (total * mc * g / (total * m * l * l / 3.0 - mc * mc)).sqrt();
    let model = linearise(&ChainParameters::<f64>::of(&rig), Equilibrium::HANGING).unwrap();
    assert!((model.a[(3, 2)] + omega * omega).abs() < 1e-13 * omega * omega);

    // A small swing of the nonlinear plant, cart included, returns after that period. The true period is longer by an
    // amount of the order of the amplitude squared.
    let amplitude = 1e-4;
    let start = [0.2, 0.0, core::f64::consts::PI + amplitude, 0.0];
    let plant = chain_plant(&rig).unwrap();
    let after = |time: f64| integrate(&*plant, &start, |_, _| 0.0, &[0.0], time, TIGHT).unwrap();
    let period = core::f64::consts::TAU / omega;
    let missed = |end: Vec<f64>| end.iter().zip(start).map(|(e, s)| (e - s).abs()).fold(0.0, f64::max);
    assert!(missed(after(period)) < 1e-6 * amplitude);
    assert!(missed(after(1.001 * period)) > 1e-6 * amplitude, "a period 0.1 % off is noticed");
}

/// Determinant by elimination with row exchanges.
fn determinant<R: Real>(mut m: Matrix<R>) -> R {
    let mut det = R::one();
    for k in 0..m.rows() {
        let largest = |&i: &usize, &j: &usize| m[(i, k)].abs().partial_cmp(&m[(j, k)].abs()).expect("finite");
        let pivot = (k..m.rows()).max_by(|i, j| largest(i, j)).expect("a row");
        for j in 0..m.cols() {
            let upper = m[(k, j)].clone();
            m[(k, j)] = m[(pivot, j)].clone();
            m[(pivot, j)] = upper;
        }
        det = if pivot == k { det } else { -det } * &m[(k, k)];
        for i in k + 1..m.rows() {
            let factor = m[(i, k)].clone() / &m[(k, k)];
            for j in k..m.cols() {
                m[(i, j)] = m[(i, j)].clone() - &(factor.clone() * &m[(k, j)]);
            }
        }
    }
    det
}

/// n equal point masses on equal strings swing with `ω² = (g/l) r` at the roots r of the Laguerre polynomial `L_n`
/// (the discrete hanging chain; D. Bernoulli 1733). Two monic polynomials of degree n that agree at n + 1 points are
/// equal, so the roots need not be computed.
fn differs_from_laguerre(links: &[Link]) -> f64 {
    type W = Wide;
    let n = links.len();
    let rig = chain(1e60, links.to_vec()); // a cart that does not move
    let model = linearise(&ChainParameters::<W>::of(&rig), Equilibrium::HANGING).unwrap();
    let l_over_g = W::from_f64(0.25) / &W::from_f64(rig.gravity_m_per_s2);
    let mut worst = 0.0f64;
    for point in 0..=n {
        // At negative arguments all terms have the same sign, so nothing cancels.
        let r = W::from_f64(-0.5 - 3.0 * point as f64);
        let characteristic = determinant(Matrix::from_fn(n, n, |i, j| {
            let stiffness = -model.a[(2 * i + 3, 2 * j + 2)].clone() * &l_over_g;
            if i == j { r.clone() - &stiffness } else { -stiffness }
        }));
        // p_k = (-1)^k k! L_k:  p_{k+1} = (r - 2k - 1) p_k - k² p_{k-1}.
        let (mut before, mut laguerre) = (W::zero(), W::one());
        for k in 0..n {
            let k = k as f64;
            let next =
                (r.clone() - &W::from_f64(2.0 * k + 1.0)) * &laguerre - &(W::from_f64(k * k) * &before);
            before = laguerre;
            laguerre = next;
        }
        worst = worst.max((characteristic / &laguerre - &W::one()).abs().to_f64());
    }
    worst
}

#[test]
fn point_masses_on_a_fixed_point_swing_at_the_roots_of_laguerre_polynomials() {
    let point_mass = || Link { centre_of_mass_m: Some(0.25), inertia_kg_m2: Some(0.0), ..rod(0.125, 0.25) };
    for n in 1..=14 {
        let mut links = vec![point_mass(); n];
        let error = differs_from_laguerre(&links);
        assert!(error < 1e-50, "{n} links: {error:e}");
        links[n / 2].length_m *= 1.0 + 1e-9;
        links[n / 2].centre_of_mass_m = Some(links[n / 2].length_m);
        assert!(differs_from_laguerre(&links) > 1e-11, "a length wrong by 1e-9 is noticed for {n} links");
    }
}

/// Distance from the reference after 0.1 s of a push on the nearly upright paper rig, in `steps` steps.
fn rk4_error(steps: u32) -> f64 {
    let plant = chain_plant(&paper()).unwrap();
    let duration = 0.1; // the fastest instability grows 1300-fold in this time: long, but not yet chaotic
    let start = [0.0, 0.1, 0.02, 0.1, -0.03, 0.0, 0.01, -0.2, 0.02, 0.0];
    let torques = [1e-4, 0.0, -1e-4, 0.0];
    let exact = integrate(&*plant, &start, |_, _| 0.05, &torques, duration, TIGHT).unwrap();
    let mut stepped = chain_plant(&paper()).unwrap();
    stepped.set_state(&start);
    stepped.advance(0.05, &torques, duration, steps as usize);
    let mut end = vec![0.0; stepped.states()];
    stepped.write_state(&mut end);
    end.iter().zip(exact).map(|(a, b)| (a - b).abs() / (1.0 + b.abs())).fold(0.0, f64::max)
}

#[test]
fn the_fixed_step_integrator_converges_with_order_four() {
    let errors = [400, 800, 1600].map(rk4_error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 4.0).abs() < 0.15, "order {order}, errors {errors:?}");
    }
}

#[test]
fn both_integrators_agree_while_motion_is_predictable() {
    assert!(rk4_error(4000) < 1e-8, "{:e}", rk4_error(4000));
    for n in 1..=MAX_LINKS {
        let rig = with_friction(unequal_rods(n.min(9)), 1.0);
        let rig = Chain { links: (0..n).map(|i| rig.links[i % 9].clone()).collect(), ..rig };
        let mut plant = chain_plant(&rig).unwrap();
        let (start, torques) = (tangled(n), vec![1e-3; n]);
        let exact = integrate(&*plant, &start, |_, _| 2.0, &torques, 0.05, TIGHT).unwrap();
        plant.set_state(&start);
        plant.advance(2.0, &torques, 0.05, 1000);
        let mut end = vec![0.0; plant.states()];
        plant.write_state(&mut end);
        for (a, b) in end.iter().zip(&exact) {
            assert!((a - b).abs() < 1e-8 * (1.0 + b.abs()), "{n} links: {a} {b}");
        }
    }
}

#[test]
fn the_reference_follows_a_force_that_depends_on_time_and_state() {
    // A cart that hardly feels its link: ẍ = cos t - 4 x - 2 ẋ, started on its steady oscillation
    // x = (3 cos t + 2 sin t) / 13.
    let plant = chain_plant(&chain(1.0, vec![rod(1e-12, 0.5)])).unwrap();
    let start = [3.0 / 13.0, 2.0 / 13.0, core::f64::consts::PI, 0.0];
    let force = |t: f64, s: &[f64]| t.cos() - 4.0 * s[0] - 2.0 * s[1];
    let end = integrate(&*plant, &start, force, &[0.0], 25.0, TIGHT).unwrap();
    let (t, expected) = (25.0f64, |t: f64| (3.0 * t.cos() + 2.0 * t.sin()) / 13.0);
    assert!((end[0] - expected(t)).abs() < 1e-10);
    assert!((end[0] - expected(t + 1e-6)).abs() > 1e-10, "the run ends where it was asked to");
}

#[test]
fn the_reference_refuses_what_it_cannot_do() {
    let plant = chain_plant(&paper()).unwrap();
    let start = vec![0.0; plant.states()];
    let run = |duration, tolerance| integrate(&*plant, &start, |_, _| 0.0, &[0.0; 4], duration, tolerance);
    assert_eq!(run(0.0, TIGHT), Err(ReferenceError::BadRequest));
    assert_eq!(run(f64::NAN, TIGHT), Err(ReferenceError::BadRequest));
    assert_eq!(run(1.0, Tolerance { relative: 0.0, ..TIGHT }), Err(ReferenceError::BadRequest));
    let broken = |t: f64, _: &[f64]| if t > 0.5 { f64::NAN } else { 0.0 };
    let stopped = integrate(&*plant, &start, broken, &[0.0; 4], 1.0, TIGHT);
    assert!(
        matches!(stopped, Err(ReferenceError::Stopped { time_s, .. }) if (time_s - 0.5).abs() < 1e-9),
        "{stopped:?}"
    );
}

#[test]
fn chains_of_an_unsupported_size_are_refused() {
    for links in [0, MAX_LINKS + 1] {
        let rig = chain(1.0, vec![rod(0.1, 0.1); links]);
        assert_eq!(chain_plant(&rig).err(), Some(PlantError::UnsupportedLinks { links }));
    }
    assert_eq!(ChainPlant::<3>::of(&paper()), Err(PlantError::WrongLinks { links: 4, compiled: 3 }));
}

#[test]
fn every_size_of_chain_rests_upright_and_falls_when_disturbed() {
    for n in 1..=MAX_LINKS {
        let rig = chain(1.0, vec![rod(0.1, 0.2); n]);
        let mut plant: Box<dyn Plant> = chain_plant(&rig).unwrap();
        let mut state = vec![1.0; plant.states()];
        plant.advance(0.0, &vec![0.0; n], 0.1, 10);
        plant.write_state(&mut state);
        assert_eq!((plant.links(), state), (n, vec![0.0; 2 * n + 2]));
        let mut start = WideChainState::<1>::upright();
        start.phi[0] = 1e-3;
        let mut tilted = vec![0.0; 2 * n + 2];
        start.write_relative(&mut tilted[..4]);
        plant.set_state(&tilted);
        plant.advance(0.0, &vec![0.0; n], 0.3, 300);
        plant.write_state(&mut tilted);
        assert!(tilted[2] > 1e-3);
    }
}
