//! Kalman gain and integral action: compared with closed forms, and properties of every design.

use crate::published::{designed, rig, rig_of};
use upright_design::design::{Certified, DesignError, Feedback, design, is_stable_sampled};
use upright_design::numerics::{Matrix, Real, Wide, spectral_radius, with_precision};
use upright_design::rig::{Integral, Rig};
use upright_test_support::limits::output;

const WITH_ENCODERS: [&str; 4] =
    ["single-quanser-ip02", "double-quanser-dbpen", "triple-glueck-eder-kugi", "quadruple-paper"];

/// Ad - L C for the predictor gain l.
fn observer_loop(rig: &Rig, certified: &Certified, l: &Matrix<f64>) -> Matrix<f64> {
    let ad = &certified.double.ad;
    let sensors = rig.sensors();
    let c = Matrix::from_fn(sensors.len(), ad.rows(), |i, j| if sensors[i].state == j { 1.0 } else { 0.0 });
    ad - &(l * &c)
}

#[test]
fn the_predictor_gain_is_the_filter_gain_carried_over_one_tick() {
    for name in WITH_ENCODERS {
        let certified = designed(name);
        let (ad, kalman) = (&certified.double.ad, certified.double.kalman.as_ref().unwrap());
        let product = ad * &kalman.l_filter;
        let sizes = &ad.map(|entry| entry.abs()) * &kalman.l_filter.map(|entry| entry.abs());
        let close = |wanted: &Matrix<f64>| {
            let pairs = kalman.l_predictor.entries().iter().zip(wanted.entries());
            pairs.zip(sizes.entries()).all(|((found, wanted), size)| (found - wanted).abs() <= 1e-14 * size)
        };
        assert!(close(&product), "{name}");
        assert!(!close(&kalman.l_filter), "the two forms differ");
    }
}

#[test]
fn the_observer_of_every_rig_is_stable() {
    for name in WITH_ENCODERS {
        let rig = rig(name);
        let certified = designed(name);
        let l = &certified.double.kalman.as_ref().unwrap().l_predictor;
        let radius = spectral_radius(&observer_loop(&rig, certified, l)).unwrap();
        assert!(radius < 1.0, "{name}: {radius}");
        // Negative controls: the pendulum without correction, and corrected the wrong way.
        for wrong in [l.scaled(&0.0), l.scaled(&-1.0)] {
            let radius = spectral_radius(&observer_loop(&rig, certified, &wrong)).unwrap();
            assert!(radius > 1.0, "{name}: {radius}");
        }
    }
}

/// `ẋ = u`, measured in steps of `step`, with force noise of intensity `q`, and a tick of `period` (s).
fn integrator(step: f64, q: f64, period: f64) -> Rig {
    rig_of(&format!(
        "name = \"integrator\"\n[model]\na = [[0]]\nb = [1]\nmeasured = [0]\nmeasured_steps = [{step:e}]\n\
         [tick]\nperiod_s = {period:e}\n[lqr]\nstate_weights = [1]\nforce_weight = 1\n\
         [kalman]\nforce_noise_n2_s = {q:e}\njoint_noise = []\n"
    ))
}

/// `P² - Q P - Q R = 0` and `L = P / (P + R)` with `Q = q T`, `R = step²/12`, in 512 bits, rounded.
fn scalar_gain(step: f64, q: f64, period: f64) -> (f64, f32) {
    with_precision(512, || {
        let w = Wide::from_f64;
        let q = w(q) * &w(period);
        let r = w(step) * &w(step) / &w(12.0);
        let root = (q.clone() * &q + &(w(4.0) * &q * &r)).sqrt();
        let p = (q + &root) / &w(2.0);
        let l = p.clone() / &(p + &r);
        (l.round_to_f64(), l.round_to_f32())
    })
}

#[test]
fn the_gain_of_a_scalar_plant_is_the_closed_form_correctly_rounded() {
    for (step, q, period) in
        [(1e-3, 1e-4, 1e-3), (2.275e-5, 2e-4, 2e-3), (0.7, 3.3, 0.01), (1e-6, 0.25, 5e-4), (0.1, 1e-9, 1e-3)]
    {
        let certified = design(&integrator(step, q, period)).unwrap();
        let (wanted_double, wanted_single) = scalar_gain(step, q, period);
        let (double, single) =
            (certified.double.kalman.as_ref().unwrap(), certified.single.kalman.as_ref().unwrap());
        assert_eq!(double.l_filter[(0, 0)], wanted_double, "{step} {q} {period}");
        assert_eq!(single.l_filter[(0, 0)], wanted_single, "{step} {q} {period}");
        // Ad = 1.
        assert_eq!(double.l_predictor, double.l_filter);
        // Negative control: different noise gives a different gain.
        assert_ne!(double.l_filter[(0, 0)], scalar_gain(step, 1.0001 * q, period).0);
    }
}

/// With `Q = R/2` the scalar solution is `P = R`, so `L = 1/2`, exactly.
#[test]
fn a_rational_closed_form_comes_out_exactly() {
    // R = (3/1024)²/12 = 3/2²², Q = 3/2²³ = q/1024.
    let certified = design(&integrator(3.0 / 1024.0, 3.0 / 8192.0, 1.0 / 1024.0)).unwrap();
    assert_eq!(certified.double.kalman.unwrap().l_filter.entries(), [0.5]);
    assert_eq!(certified.single.kalman.unwrap().l_filter.entries(), [0.5]);
}

#[test]
fn a_finer_encoder_is_trusted_more() {
    let gain =
        |step: f64| design(&integrator(step, 1e-4, 1e-3)).unwrap().double.kalman.unwrap().l_filter[(0, 0)];
    let gains = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5].map(gain);
    assert!(gains.windows(2).all(|pair| pair[0] < pair[1]), "{gains:?}");
    assert!(gains[0] < 0.02 && gains[4] > 0.98 && gains[4] < 1.0, "{gains:?}");
}

fn double_integrator(measured: usize) -> Rig {
    rig_of(&format!(
        "name = \"cart\"\n[model]\na = [[0, 1], [0, 0]]\nb = [0, 1]\nmeasured = [{measured}]\n\
         measured_steps = [1e-3]\n[tick]\nperiod_s = 1e-3\n[lqr]\nstate_weights = [1, 1]\nforce_weight = 1\n\
         [kalman]\nforce_noise_n2_s = 1e-4\njoint_noise = []\n"
    ))
}

#[test]
fn a_mode_that_no_sensor_shows_is_named() {
    let error = design(&double_integrator(1)).unwrap_err();
    let DesignError::Undetectable { modes } = &error else { panic!("{error}") };
    // The position: a mode of the sampled plant at 1, in whatever unit it is given.
    assert_eq!(modes.len(), 1);
    assert!(error.to_string().contains("the sensors do not show the mode at"), "{error}");
    assert!(design(&double_integrator(0)).is_ok(), "the position shows everything");
}

#[test]
fn a_rig_without_stable_observer_ends_with_status_3_and_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let status = |measured: usize| {
        let file = folder.path().join(format!("measured-{measured}.toml"));
        let text = format!(
            "name = \"cart\"\n[model]\na = [[0, 1], [0, 0]]\nb = [0, 1]\nmeasured = [{measured}]\n\
             measured_steps = [1e-3]\n[lqr]\nstate_weights = [1, 1]\nforce_weight = 1\n\
             [kalman]\nforce_noise_n2_s = 1e-4\njoint_noise = []\n"
        );
        std::fs::write(&file, text).unwrap();
        let out = folder.path().join(format!("gains-{measured}.rs"));
        let output = output(std::process::Command::new(env!("CARGO_BIN_EXE_upright")).args([
            std::ffi::OsStr::new("design"),
            file.as_os_str(),
            "--out".as_ref(),
            out.as_os_str(),
        ]));
        (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap(), out.exists())
    };
    let (code, stderr, written) = status(1);
    assert!(code == 3 && stderr.contains("the sensors do not show") && !written, "{code} {stderr}");
    let (code, stderr, written) = status(0);
    assert!(code == 0 && written, "{code} {stderr}");
}

/// `ẋ = u` with `ż = x`, cost `q x² + w z² + u²`: `Kz = √w` and `Kx = √(q + 2 √w)`.
fn integrator_with_integral(q: f64, weight: f64) -> Rig {
    rig_of(&format!(
        "name = \"integrator\"\n[model]\na = [[0]]\nb = [1]\n[tick]\nperiod_s = 1e-3\n\
         [lqr]\nstate_weights = [{q:e}]\nforce_weight = 1\n[integral]\nposition_weight = {weight:e}\n"
    ))
}

#[test]
fn integral_action_of_a_scalar_plant_is_the_closed_form_correctly_rounded() {
    let exact = design(&integrator_with_integral(5.0, 4.0)).unwrap().double;
    assert_eq!(exact.continuous.integral.unwrap().k.entries(), [3.0, 2.0]);
    for (q, weight) in [(1.0, 2.0), (0.3, 7.0), (100.0, 0.01)] {
        let certified = design(&integrator_with_integral(q, weight)).unwrap();
        let wanted = with_precision(512, || {
            let k_z = Wide::from_f64(weight).sqrt();
            let k_x = (Wide::from_f64(q) + &(Wide::from_f64(2.0) * &k_z)).sqrt();
            [k_x, k_z].map(|gain| gain.round_to_f64())
        });
        let found = certified.double.continuous.integral.unwrap();
        assert_eq!(found.k.entries(), wanted, "{q} {weight}");
        // At a tick of 1 ms the sampled gains agree with it to a few tenths of a percent.
        let sampled = certified.double.sampled.integral.unwrap();
        for (sampled, continuous) in sampled.k.entries().iter().zip(found.k.entries()) {
            assert!((sampled / continuous - 1.0).abs() < 0.02 && sampled != continuous, "{q} {weight}");
        }
    }
}

/// The LQR with integral action, without pole placement and observer, which do not depend on it.
fn with_weight(name: &str, position_weight: f64, delay_ticks: u8) -> Rig {
    let integral = Some(Integral { position_weight, setpoint_weight: 1.0 });
    let mut rig = Rig { integral, pole_placement: None, kalman: None, ..rig(name) };
    rig.tick.delay_ticks = delay_ticks;
    rig
}

#[test]
fn the_loop_with_integral_action_is_stable_and_not_without_its_integral_gain() {
    for name in WITH_ENCODERS {
        for delay_ticks in [0, 1] {
            let rig = with_weight(name, 10.0, delay_ticks);
            let certified = design(&rig).unwrap();
            let law = certified.double.sampled.integral.as_ref().unwrap();
            let states = rig.states();
            assert_eq!(law.k.cols(), states + 1 + usize::from(delay_ticks), "{name}");
            assert!(law.integral && is_stable_sampled(&certified.double.sampled_loop(&rig, law)), "{name}");
            // Negative control: with the wrong sign of Ki, z diverges.
            let mut k = law.k.clone();
            k[(0, states)] = -k[(0, states)];
            let wrong = Feedback { k, ..law.clone() };
            let radius = spectral_radius(&certified.double.sampled_loop(&rig, &wrong)).unwrap();
            assert!(radius > 1.0, "{name}: {radius}");
        }
    }
}

#[test]
fn the_integral_gain_vanishes_with_its_weight_and_the_rest_becomes_the_plain_law() {
    for name in ["single-quanser-ip02", "quadruple-paper"] {
        let of = |weight: f64| {
            let rig = with_weight(name, weight, 0);
            let sampled = design(&rig).unwrap().double.sampled;
            let (plain, law) = (sampled.lqr.unwrap().k, sampled.integral.unwrap().k);
            let states = rig.states();
            let apart = (0..states).map(|j| (law[(0, j)] / plain[(0, j)] - 1.0).abs()).fold(0.0, f64::max);
            (law[(0, states)].abs(), apart)
        };
        let found = [1.0, 1e-4, 1e-8, 1e-12].map(of);
        for pair in found.windows(2) {
            // Ki is proportional to the square root of the weight.
            let ratio = pair[0].0 / pair[1].0;
            assert!((80.0..120.0).contains(&ratio), "{name}: {found:?}");
            assert!(pair[1].1 < pair[0].1, "{name}: {found:?}");
        }
        assert!(found[3].1 < 1e-5 && found[0].1 > 1e-3, "{name}: {found:?}");
    }
}

#[test]
fn a_rig_without_integral_has_none() {
    let certified = designed("quadruple-paper");
    assert!(certified.double.sampled.integral.is_none() && certified.double.continuous.integral.is_none());
}
