//! Machines that others have published, with gains computed elsewhere (SciPy), and the weights that their papers use.

use std::path::Path;

use upright_design::design::{Laws, design};
use upright_design::rig::Rig;

/// The cart of the Control Tutorials for MATLAB and Simulink (University of Michigan), with weights 5000 and 100.
const CTMS: &str = "name = \"ctms\"\n[cart]\nmass_kg = 0.5\nfriction_n_s_per_m = 0.1\n\
    [[link]]\nmass_kg = 0.2\nlength_m = 0.6\ncentre_of_mass_m = 0.3\ninertia_kg_m2 = 0.006\n\
    [gravity]\nm_per_s2 = 9.8\n[tick]\nperiod_s = 0.01\n[lqr]\nforce_weight = 1\nstate_weights = [5000, 0, 100, 0]\n";

/// Two links on a cart.
const DOUBLE: &str = "name = \"double\"\n[cart]\nmass_kg = 0.6\n[[link]]\nmass_kg = 0.2\nlength_m = 0.3\n\
    [[link]]\nmass_kg = 0.1\nlength_m = 0.4\n[tick]\nperiod_s = 0.005\n[lqr]\nforce_weight = 1\n";

/// Relative error of a number that is printed with six digits.
const SIX_DIGITS: f64 = 5e-6;

fn gains(text: &str) -> [Vec<f64>; 2] {
    let rig = Rig::from_toml(text, Path::new("test.toml")).unwrap();
    let designed = design(&rig).unwrap().double;
    let k = |laws: Laws<f64>| laws.lqr.unwrap().k.entries().to_vec();
    [k(designed.continuous), k(designed.sampled)]
}

#[track_caller]
fn assert_close(found: &[f64], wanted: &[f64], digits: f64) {
    let close = |(x, y): (&f64, &f64)| (x - y).abs() <= digits * y.abs();
    assert!(found.len() == wanted.len() && found.iter().zip(wanted).all(close), "{found:?} {wanted:?}");
}

#[test]
fn gains_of_the_tick_are_those_of_lqrd_or_dlqr_as_the_rig_file_says() {
    let [continuous, sampled] = gains(CTMS);
    assert_close(&continuous, &[-70.7107, -37.8345, 105.53, 20.9238], SIX_DIGITS);
    assert_close(&sampled, &[-61.9933, -33.5039, 95.0597, 18.83], SIX_DIGITS);
    let [continuous, sum] = gains(&format!("{CTMS}cost = \"sum\"\n"));
    assert_close(&continuous, &[-70.7107, -37.8345, 105.53, 20.9238], SIX_DIGITS);
    assert_close(&sum, &[-61.9933, -33.5040, 95.0597, 18.8300], SIX_DIGITS);
    assert_ne!(sum, sampled);
}

#[test]
fn weights_of_absolute_angles_are_a_full_matrix_for_relative_ones() {
    let absolute = "state_weights = [50, 1, 50, 2, 700, 3]\nangles = \"absolute\"\n";
    let relative = "state_weights = [[50, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 750, 0, 700, 0], \
        [0, 0, 0, 5, 0, 3], [0, 0, 700, 0, 700, 0], [0, 0, 0, 3, 0, 3]]\n";
    let diagonal = "state_weights = [50, 1, 750, 5, 700, 3]\n";
    let [with_angles, with_matrix, without] =
        [absolute, relative, diagonal].map(|weights| gains(&format!("{DOUBLE}{weights}")));
    assert_eq!(with_angles, with_matrix);
    assert_ne!(with_angles, without);
}

#[test]
fn a_cross_weight_enters_as_in_the_closed_form_of_a_scalar_plant() {
    // 2 x - (x + s)² + q = 0 for x' = x + u and r = 1, so that K = x + s = 1 + √(1 + q - 2 s).
    let [k, _] = gains(
        "name = \"scalar\"\n[model]\na = [[1]]\nb = [1]\n[lqr]\nstate_weights = [3]\nforce_weight = 1\n\
         cross_weights = [0.5]\n",
    );
    assert_close(&k, &[1.0 + 3f64.sqrt()], 1e-15);
}
