//! Machines that others have published, with gains computed elsewhere (SciPy): those that docs/coming-from-matlab.md
//! prints, and the weights that papers use.

use std::path::Path;

use upright_design::design::{Cost, Design, dare, design, zero_order_hold};
use upright_design::numerics::Matrix;
use upright_design::rig::{PlantDescription, Rig};

const PAGE: &str = include_str!("../../../../docs/coming-from-matlab.md");

/// Two links on a cart.
const DOUBLE: &str = "name = \"double\"\n[cart]\nmass_kg = 0.6\n[[link]]\nmass_kg = 0.2\nlength_m = 0.3\n\
    [[link]]\nmass_kg = 0.1\nlength_m = 0.4\n[tick]\nperiod_s = 0.005\n[lqr]\nforce_weight = 1\n";

/// Relative error of a number that is printed with six digits.
const SIX_DIGITS: f64 = 5e-6;

fn designed(text: &str) -> Design<f64> {
    design(&Rig::from_toml(text, Path::new("test.toml")).unwrap()).unwrap().double
}

/// Gains of the LQR: continuous, and of the tick.
fn gains(text: &str) -> [Vec<f64>; 2] {
    let Design { continuous, sampled, .. } = designed(text);
    [continuous, sampled].map(|laws| laws.lqr.unwrap().k.entries().to_vec())
}

#[track_caller]
fn assert_close(found: &[f64], wanted: &[f64], digits: f64) {
    let close = |(x, y): (&f64, &f64)| (x - y).abs() <= digits * y.abs();
    assert!(found.len() == wanted.len() && found.iter().zip(wanted).all(close), "{found:?} {wanted:?}");
}

/// The rows of the page's gains whose label is `label`, from the top.
fn rows_of_the_page(label: &str) -> Vec<Vec<f64>> {
    let rows = PAGE.lines().filter_map(|line| line.strip_prefix(&format!("| {label} |")));
    let numbers = rows.map(|row| row.split('|').filter_map(|cell| cell.trim().parse().ok()).collect());
    numbers.filter(|numbers: &Vec<f64>| !numbers.is_empty()).collect()
}

/// The example of a rig file on the page: the cart of the Control Tutorials for MATLAB and Simulink.
fn ctms() -> String {
    PAGE.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap().to_owned()
}

fn rig_file(name: &str) -> String {
    file("rigs", name)
}

fn file(folder: &str, name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder).join(name))
        .unwrap()
}

/// The text with these lines more in `[lqr]`.
fn with_lqr(text: &str, lines: &str) -> String {
    assert!(text.contains("[lqr]\n"));
    text.replace("[lqr]\n", &format!("[lqr]\n{lines}\n"))
}

#[test]
fn gains_that_the_page_for_users_of_matlab_prints_are_those_of_the_design() {
    let machines = [ctms(), rig_file("single-quanser-ip02.toml"), rig_file("double-quanser-dbpen.toml")];
    let sum = "cost = \"sum\"";
    let of_lqr = |suffix: &str, text: &str, row: usize| {
        let [lqr, lqrd] = gains(text);
        let [_, dlqr] = gains(&with_lqr(text, sum));
        for (name, found) in [("lqr", lqr), ("lqrd", lqrd), ("dlqr", dlqr)] {
            assert_close(&found, &rows_of_the_page(&format!("`{name}`{suffix}"))[row], SIX_DIGITS);
        }
    };
    for (row, text) in machines.iter().enumerate() {
        of_lqr("", text, row);
    }
    of_lqr(", absolute", &with_lqr(&machines[2], "angles = \"absolute\""), 0);
    for (row, text) in machines[..2].iter().enumerate() {
        let Design { continuous, sampled, .. } = designed(text);
        for (laws, label) in [(continuous, "`acker`"), (sampled, "`acker`, sampled")] {
            assert_close(laws.pole_placement.unwrap().k.entries(), &rows_of_the_page(label)[row], SIX_DIGITS);
        }
    }
    let l = designed(&machines[1]).kalman.unwrap().l_filter;
    for (column, sensor) in ["cart", "link"].iter().enumerate() {
        let found: Vec<f64> = (0..4).map(|state| l[(state, column)]).collect();
        assert_close(&found, &rows_of_the_page(&format!("`kalmd`, {sensor}"))[0], SIX_DIGITS);
    }
}

/// The page says so: pulses are a constant speed in a tick, which is no acceleration that is held.
#[test]
fn a_stepper_has_other_gains_than_its_plant_with_a_held_acceleration() {
    assert!(PAGE.contains("Those of a stepper, and its gains, differ: it holds its speed"));
    let text = with_lqr(&rig_file("single-stepper.toml"), "cost = \"sum\"");
    let text = text.replace("period_s = 0.01", "period_s = 0.03");
    let [_, sampled] = gains(&text);
    // A rod of 0.1 kg and 0.5 m, on a cart whose acceleration is the input.
    let (mass, centre, friction) = (0.1, 0.25, 1e-4);
    let inertia = mass * 0.25 / 3.0;
    let fall = mass * 9.81 * centre / inertia;
    let rows = [
        vec![0.0, 1.0, 0.0, 0.0],
        vec![0.0; 4],
        vec![0.0, 0.0, 0.0, 1.0],
        vec![0.0, 0.0, fall, -friction / inertia],
    ];
    let push = [0.0, 1.0, 0.0, mass * centre / inertia];
    let b = Matrix::from_fn(4, 1, |i, _| push[i]);
    let (a, b) = zero_order_hold(&Matrix::<f64>::from_f64_rows(&rows), &b, &0.03);
    let weights = [100.0, 10.0, 100.0, 1.0];
    let q = Matrix::from_fn(4, 4, |i, j| if i == j { weights[i] } else { 0.0 });
    let held = dare(&a, &b, &Cost::new(q, Matrix::from_fn(1, 1, |_, _| 0.2))).unwrap().k;
    let differences = sampled.iter().zip(held.entries()).map(|(found, held)| (found / held - 1.0).abs());
    let largest = differences.fold(0.0, f64::max);
    assert!((1e-5..2e-2).contains(&largest), "{sampled:?} {held:?}: {largest}");
}

#[test]
fn a_sum_over_the_ticks_is_another_cost_than_the_integral() {
    let [continuous, integral] = gains(&ctms());
    let [same, sum] = gains(&with_lqr(&ctms(), "cost = \"sum\""));
    assert_eq!(continuous, same);
    assert!(integral.iter().zip(&sum).all(|(x, y)| x != y));
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

#[test]
fn a_two_wheeled_robot_has_the_gains_of_its_program() {
    let text = file("examples", "two-wheeler.toml");
    let model = |rig: &Rig| match &rig.plant {
        PlantDescription::Model(model) => (model.a.clone(), model.b.clone()),
        PlantDescription::Chain(_) => panic!("a chain"),
    };
    let (a, b) = model(&Rig::from_toml(&text, Path::new("test.toml")).unwrap());
    // Inertias e, damping and torques of motors and wheels, as the file's first lines give them.
    let (wheel, radius, body, height, rotor) = (0.03, 0.04, 0.6, 0.072, 1e-5);
    let (torque, back_emf, resistance) = (0.317, 0.468, 6.69);
    let [e11, e12, e22] = [
        (2.0 * wheel + body) * radius * radius + wheel * radius * radius + 2.0 * rotor,
        body * height * radius - 2.0 * rotor,
        4.0 / 3.0 * body * height * height + 2.0 * rotor,
    ];
    let determinant = e11 * e22 - e12 * e12;
    let solved = |[x, y]: [f64; 2]| [(e22 * x - e12 * y) / determinant, (e11 * y - e12 * x) / determinant];
    let drive = 2.0 * torque / resistance;
    let drag = 2.0 * (torque * back_emf / resistance + 0.0022);
    let columns = [[-drag, drag], [0.0, body * 9.81 * height], [drag, -drag], [drive, -drive]].map(solved);
    for (row, from) in [1, 3].into_iter().enumerate() {
        let found = [a[from][1], a[from][2], a[from][3], b[from]];
        assert_close(&found, &columns.map(|column| column[row]), 1e-8);
    }
    let with_integral = designed(&text).continuous.integral.unwrap();
    // The second one before its author multiplied it by 0.85.
    assert_close(with_integral.k.entries(), &[-0.8351, -1.0995 / 0.85, -34.1896, -2.8141, -0.4472], 6e-5);
}

#[test]
fn a_pendulum_with_a_reaction_wheel_has_the_gains_of_its_program() {
    let text = file("examples", "reaction-wheel.toml");
    let program = [-440.8258, -56.9627, -0.21268];
    let [continuous, sum] = gains(&text);
    assert_close(&sum, &program, 3e-5);
    assert!(continuous.iter().zip(&program).all(|(x, y)| (x / y - 1.0).abs() > 0.3), "{continuous:?}");
}
