//! A rig file with an arm: its keys, its words, and who refuses it.

use std::path::Path;

use upright::table::Equilibrium;
use upright_design::design::{Cost, dare, design};
use upright_design::numerics::Matrix;
use upright_design::plant::{ChainParameters, linearise};
use upright_design::rig::{Base, CartOnly, IMPERFECTIONS, Imperfection, Rig, RigText};
use upright_design::table::{Gains, TableValues, gains_source};

const QUBE: &str = include_str!("../../../../rigs/single-qube-servo-2.toml");
const SRV02: &str = include_str!("../../../../rigs/single-srv02-rotary.toml");

fn parse(text: &str) -> Result<Rig, String> {
    Rig::from_toml(text, Path::new("rig.toml")).map_err(|error| error.to_string())
}

fn with(text: &str, changes: &[(&str, &str)]) -> String {
    let mut text = RigText::parse(text, Path::new("rig.toml")).unwrap();
    changes.iter().for_each(|(key, value)| text.set(key, value).unwrap());
    text.to_string()
}

#[track_caller]
fn assert_close(found: &[f64], wanted: &[f64], relative: f64) {
    let close = |(x, y): (&f64, &f64)| (x - y).abs() <= relative * y.abs();
    assert!(found.len() == wanted.len() && found.iter().zip(wanted).all(close), "{found:?} {wanted:?}");
}

#[test]
fn an_arm_is_read_in_its_own_units() {
    let rig = parse(QUBE).unwrap();
    let chain = rig.chain().unwrap();
    assert_eq!(
        (chain.base, chain.cart.mass_kg, chain.cart.travel_m),
        (Base::Arm, Some(2.334e-4), [-1.4, 1.4])
    );
    assert_eq!(chain.cart.encoder_step_m, Some(std::f64::consts::TAU / 2048.0));
    assert_eq!((chain.links[0].radius_m, rig.limits.speed_m_per_s), (0.085, Some(12.0)));
    assert_eq!(rig.lqr.as_ref().unwrap().force_weight, 1400.0);
    assert_eq!(rig.actuator.motor().unwrap().pulley_radius_m, 1.0);
    // The torque of the motor, without a pulley.
    assert!((rig.actuator.largest_force_n().unwrap() - 0.042 * 18.0 / 8.4).abs() < 1e-12);
    let farther = parse(&with(QUBE, &[("link[1].radius_m", "0.1")])).unwrap();
    assert_eq!(farther.chain().unwrap().links[0].radius_m, 0.1);
    assert_ne!(farther.hash(), rig.hash());
}

#[test]
fn keys_of_a_cart_are_refused_for_an_arm_and_the_other_way_round() {
    let refused = |text: &str, change: [&str; 2], says: &str| {
        let error = parse(&text.replacen(change[0], change[1], 1)).unwrap_err();
        assert!(error.contains(says), "{error}");
        error
    };
    refused(QUBE, ["inertia_kg_m2 =", "mass_kg ="], "arm.mass_kg: unknown");
    refused(
        QUBE,
        ["resistance_ohm", "pulley_radius_m = 0.1\nresistance_ohm"],
        "actuator.pulley_radius_m: unknown",
    );
    refused(QUBE, ["torque_weight", "force_weight"], "did you mean `torque_weight`?");
    refused(QUBE, ["speed_rad_per_s", "speed_m_per_s"], "did you mean `speed_rad_per_s`?");
    refused(
        QUBE,
        ["[swing_up]", "[reality]\nrail_tilt_rad = 0.1\n[swing_up]"],
        "reality.rail_tilt_rad: unknown",
    );
    refused(QUBE, ["radius_m = 0.085\n", ""], "arm.radius_m: missing; add");
    refused(
        QUBE,
        ["encoder_counts_per_rev", "sensor_bits = 14\nencoder_counts_per_rev"],
        "given together with",
    );
    let cart = include_str!("../../../../rigs/single-quanser-ip02.toml");
    refused(cart, ["[[link]]", "[[link]]\nradius_m = 0.1"], "link[1].radius_m: unknown");
    refused(cart, ["[[link]]", "[arm]\nradius_m = 0.1\n[[link]]"], "cart: unknown");
}

/// What is said about an arm names no cart, no rail and no metre per second.
#[test]
fn errors_and_description_speak_of_an_arm() {
    let words = ["cart", "rail", "pulley", " m/s ", "_m_per_s", " N "];
    let speaks_of_a_cart = |text: &str| words.iter().any(|word| text.contains(word));
    for change in [
        ("arm.inertia_kg_m2", "-1"),
        ("arm.travel_rad", "[1, 2]"),
        ("limits.speed_rad_per_s", "0"),
        ("limits.travel_margin_rad", "7"),
        ("actuator.torque_limit_n_m", "\"much\""),
        ("actuator.acceleration_limit_rad_per_s2", "3"),
        ("kalman.torque_noise_n2_m2_s", "-1"),
        ("swing_up.acceleration_rad_per_s2", "3"),
        ("reality.holding_torque_n_m", "3"),
    ] {
        let error = parse(&with(QUBE, &[change])).unwrap_err();
        assert!(!speaks_of_a_cart(&error), "{error}");
        assert!(error.contains(change.0), "{error}");
    }
    for text in [QUBE, SRV02] {
        let description = parse(text).unwrap().describe();
        assert!(!speaks_of_a_cart(&description), "{description}");
    }
    // Negative control.
    assert!(speaks_of_a_cart(
        &parse(include_str!("../../../../rigs/single-stepper.toml")).unwrap().describe()
    ));
}

#[test]
fn a_program_that_changes_a_key_writes_the_arms() {
    let mut text = RigText::parse(QUBE, Path::new("rig.toml")).unwrap();
    text.set("limits.speed_m_per_s", "11.5").unwrap();
    text.set("cart.mass_kg", "3e-4").unwrap();
    assert!(text.has("kalman.force_noise_n2_s") && !text.has("actuator.force_limit_n"));
    let text = text.to_string();
    assert!(text.contains("speed_rad_per_s = 11.5") && text.contains("inertia_kg_m2 = 3e-4"), "{text}");
    let line = parse(&text.replace("3e-4", "30")).unwrap().unusual_values().remove(0);
    assert_eq!(line.key, "arm.inertia_kg_m2");
    assert!(line.line(&text).is_some() && line.to_string().contains("kg·m²"), "{line}");
    assert!(parse(QUBE).unwrap().unusual_values().is_empty());
}

#[test]
fn what_is_made_for_a_cart_refuses_an_arm() {
    let file = Path::new("rig.toml");
    let error = parse(QUBE).unwrap().needs_cart(CartOnly::Identification, file).unwrap_err().to_string();
    assert!(error.starts_with("rig.toml: arm: identification takes [cart] alone"), "{error}");
    let cart = parse(include_str!("../../../../rigs/single-quanser-ip02.toml")).unwrap();
    cart.needs_cart(CartOnly::Identification, file).unwrap();
}

/// A and B of a rig with its motor's voltage as the input: rows of the arm's and the link's acceleration, each by the
/// link's angle, the arm's speed and the link's rate, and by the voltage.
fn by_voltage(rig: &Rig) -> [[f64; 4]; 2] {
    let model = linearise(&ChainParameters::<f64>::of(rig.chain().unwrap()), Equilibrium::UPRIGHT).unwrap();
    let motor = rig.actuator.motor().unwrap();
    let (per_volt, braking) = (motor.newtons_per_volt(), motor.braking_n_s_per_m());
    [1, 3].map(|row| {
        let a = |column: usize| model.a[(row, column)];
        let b = model.b[(row, 0)];
        [a(2), a(1) - braking * b, a(3), per_volt * b]
    })
}

/// Quanser's workbooks: the QUBE-Servo 2 without damping, with the arm's inertia as m r²/12, and the SRV02's module
/// without the inertia of its gear train.
#[test]
fn published_linear_models_come_out() {
    let mut qube = parse(&with(QUBE, &[("arm.inertia_kg_m2", "5.7198e-5")])).unwrap();
    let [arm, link] = by_voltage(&qube);
    assert_close(&[arm[0], arm[3], link[0], link[3]], &[149.2751, 49.7275, 261.6091, 49.1493], 2e-4);
    let srv02 = parse(&with(SRV02, &[("arm.inertia_kg_m2", "9.98e-4")])).unwrap();
    let [arm, link] = by_voltage(&srv02);
    assert_close(&arm, &[81.4, -45.8, -0.930, 83.4], 5e-3);
    assert_close(&link, &[122.0, -44.1, -1.40, 80.3], 5e-3);
    // Negative control: a link in another plane.
    qube.chain_mut().unwrap().links[0].radius_m = 0.09;
    assert!((by_voltage(&qube)[0][0] / 149.2751 - 1.0).abs() > 1e-3);
}

/// K of Quanser's SRV02 experiment (V/rad, V·s/rad), of the poles that its workbook asks for.
#[test]
fn published_gains_of_placed_poles_come_out() {
    let srv02 = parse(&with(SRV02, &[("arm.inertia_kg_m2", "9.98e-4")])).unwrap();
    let motor = srv02.actuator.motor().unwrap();
    let design = design(&srv02).unwrap().double;
    let k = design.continuous.pole_placement.unwrap().k;
    let mut in_volts: Vec<f64> = k.entries().iter().map(|gain| gain / motor.newtons_per_volt()).collect();
    // A voltage also makes up for the back-EMF.
    in_volts[1] -= motor.volts_per_speed();
    // Arm, its speed, link, its rate.
    assert_close(&in_volts, &[-5.26, -2.76, 28.16, 3.22], 0.01);
}

/// K of the LQR in the tests of the project quanser-openai-driver (V): Q and R are unit matrices, a step of 1/300 s is
/// one of the semi-implicit Euler method, and the back-EMF has the sign of a motor that accelerates.
#[test]
fn published_gains_of_a_regulator_come_out() {
    let (dt, braking) = (1.0 / 300.0, 0.042 * 0.042 / 8.4);
    let gains = |braking: f64| {
        let text = with(
            QUBE,
            &[
                ("arm.inertia_kg_m2", &(0.095 * 0.085f64.powi(2) / 12.0).to_string()),
                ("arm.friction_n_m_s_per_rad", &(0.0015 + braking).to_string()),
                ("link[1].friction_n_m_s_per_rad", "0.0005"),
            ],
        );
        let rig = parse(&text).unwrap();
        let parameters = ChainParameters::<f64>::of(rig.chain().unwrap());
        let model = linearise(&parameters, Equilibrium::UPRIGHT).unwrap();
        let per_volt = rig.actuator.motor().unwrap().newtons_per_volt();
        // The new rates move the angles.
        let rate =
            |row: usize, column: usize| dt * model.a[(row, column)] + if row == column { 1.0 } else { 0.0 };
        let a = Matrix::from_fn(4, 4, |row, column| match row % 2 {
            0 => dt * rate(row + 1, column) + if row == column { 1.0 } else { 0.0 },
            _ => rate(row, column),
        });
        let b = Matrix::from_fn(4, 1, |row, _| {
            let rate = dt * per_volt * model.b[(row | 1, 0)];
            if row % 2 == 0 { dt * rate } else { rate }
        });
        let unit = |n: usize| Matrix::from_fn(n, n, |i, j| if i == j { 1.0 } else { 0.0 });
        dare(&a, &b, &Cost::new(unit(4), unit(1))).unwrap().k.entries().to_vec()
    };
    assert_close(&gains(-braking), &[-0.88533, -1.40181, 36.32828, 2.62652], 1e-5);
    // Negative control: a motor that brakes.
    assert_close(&gains(braking), &[-0.889, -1.512, 36.98, 2.678], 5e-4);
}

/// The firmware's words are f32 of the values of the file, in the arm's own units.
#[test]
fn the_table_of_an_arm_is_in_radians() {
    let rig = parse(QUBE).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let source = gains_source(&rig, &table);
    assert!(source.contains("arm position (rad), arm speed (rad/s)"), "{source}");
    assert!(source.contains("speed_m_per_s: 12.0"), "{source}");
}

#[test]
fn imperfections_of_an_arm_have_its_keys_and_units_and_sizes() {
    let rig = parse(QUBE).unwrap();
    let of_arm = Imperfection::all_of(&rig);
    assert_eq!(of_arm.len() + 1, IMPERFECTIONS.len(), "a rail alone has a slope");
    for row in &of_arm {
        let required = format!("{QUBE}\n[verify]\n{} = {}\n", row.key, row.typical[0]);
        assert_eq!(parse(&required).unwrap().must_survive[0].1, row.typical[0], "{}", row.key);
    }
    let of = |rows: &[Imperfection], key: &str| rows.iter().find(|row| row.key == key).copied().unwrap();
    let backlash = of(Imperfection::of_base(Base::Arm), "backlash_rad");
    assert_eq!((backlash.unit, backlash.typical), ("rad", [5e-3, 3.5e-2]));
    // Negative control: a cart's row and its key are not those of an arm.
    assert_eq!(of(Imperfection::of_base(Base::Cart), "backlash_m").typical, [2e-5, 2e-4]);
    assert!(parse(&format!("{QUBE}\n[verify]\nbacklash_m = 2e-5\n")).is_err());
}
