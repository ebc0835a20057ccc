//! The linear half of the trust report: compared with the firmware, and checked for consistency.

use std::path::Path;

use crate::published::{certified, table};
use rand::{RngExt, SeedableRng};
use upright::table::{DriveMap, Law};
use upright_design::design::Certified;
use upright_design::numerics::{Matrix, spectral_radius};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, simulate};
use upright_design::table::{Gains, TableValues};
use upright_trust::verify::{LinearReport, LoopModel, linear};

/// A pendulum of 0.3 m on a cart, as a `[model]`. Its encoder steps are so fine that their rounding hardly matters.
const MODEL: &str = r#"
name = "pendulum-model"
[model]
a = [[0, 1, 0, 0], [0, -5, 0.7, 0.01], [0, 0, 0, 1], [0, 16, 33, -0.5]]
b = [0, 0.9, 0, -2.9]
output = 0
measured = [0, 2]
measured_steps = [1e-8, 1e-8]
noise_input = [[0, 0.9, 0, -2.9], [0, 0.1, 0, 5]]
[tick]
period_s = 0.005
delay_ticks = DELAY
[lqr]
state_weights = [100, 1, 100, 1]
force_weight = 0.1
[pole_placement]
poles = [[-3, 1], [-3, -1], [-8, 0], [-9, 0]]
[kalman]
force_noise_n2_s = 1e-4
joint_noise = [1e-6]
"#;

/// A motor so strong that its back-EMF takes a third of a jump of the speed within the tick.
const MOTOR: &str = r#"
[actuator]
torque_constant_n_m_per_a = 0.0114
resistance_ohm = 2.2
gear_ratio = 10
pulley_radius_m = 0.006366
supply_v = 12
"#;

fn rig(name: &str) -> Rig {
    Rig::from_path(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs").join(name)).unwrap()
}

fn model_rig(delay: &str, further: &str) -> Rig {
    let text = MODEL.replace("DELAY", delay) + further;
    Rig::from_toml(&text, Path::new("model.toml")).unwrap_or_else(|error| panic!("{error}"))
}

fn designed(rig: &Rig) -> (&'static Certified, TableValues) {
    (certified(rig), table(rig))
}

fn report(rig: &Rig) -> Vec<LinearReport> {
    let (certified, table) = designed(rig);
    linear(rig, certified, &table).unwrap()
}

fn law(report: &LinearReport) -> Law {
    report.law
}

/// Spectral radius with what the drive holds multiplied by `re + j im`: `M + (factor - 1) E C`, as a real matrix of
/// twice the size.
fn radius_with_factor(model: &LoopModel<f64>, re: f64, im: f64) -> f64 {
    let change = &model.force_input * &model.held_output;
    let real = &model.matrix + &change.scaled(&(re - 1.0));
    let imaginary = change.scaled(&im);
    spectral_radius(&real.beside(&-&imaginary).above(&imaginary.beside(&real))).unwrap()
}

/// Spectral radius with what the drive holds delayed by `ticks` whole ticks.
fn radius_with_delay(model: &LoopModel<f64>, ticks: usize) -> f64 {
    let (n, e, c) = (model.matrix.rows(), &model.force_input, &model.held_output);
    if ticks == 0 {
        return spectral_radius(&model.matrix).unwrap();
    }
    let undriven = &model.matrix - &(e * c);
    let mut late = Matrix::zeros(n + ticks, n + ticks).with_block(0, 0, &undriven);
    late = late.with_block(0, n + ticks - 1, e).with_block(n, 0, c);
    for i in 1..ticks {
        late[(n + i, n + i - 1)] = 1.0;
    }
    spectral_radius(&late).unwrap()
}

/// Predicted RMS of the force caused by all encoders (N).
fn encoder_force_n(rig: &Rig, certified: &Certified, table: &TableValues, of: Law) -> f64 {
    let reports = linear(rig, certified, table).unwrap();
    let report = reports.iter().find(|report| law(report) == of).unwrap();
    let shares = report.noise.as_ref().unwrap().iter();
    let squares =
        shares.filter(|share| share.source.starts_with("encoder")).map(|share| share.force_n.powi(2));
    squares.sum::<f64>().sqrt()
}

/// Largest difference between the force of `model` and that of the firmware, and largest force (N), from 4 mm on.
fn difference(model: &LoopModel<f64>, rig: &Rig, table: &TableValues, law: Law) -> [f64; 2] {
    let mut scenario = Scenario::at_rest(rig, law);
    // The counters of the links have 16 bits: with a link that leans at the start, they would wrap at once.
    scenario.start = vec![0.004, 0.0, 0.0, 0.0];
    scenario.duration_s = 3.0;
    let (trace, _) = simulate(rig, table, &scenario).unwrap();
    let mut state = Matrix::zeros(model.matrix.rows(), 1);
    let observer = 4 + usize::from(rig.tick.delay_ticks);
    (state[(0, 0)], state[(observer, 0)]) = (0.004, 0.004);
    let (mut worst, mut peak) = (0.0f64, 0.0f64);
    for sample in trace.samples() {
        let force = (&model.force_output * &state)[(0, 0)];
        worst = worst.max((force - sample.requested).abs());
        peak = peak.max(force.abs());
        state = &model.matrix * &state;
    }
    [worst, peak]
}

#[test]
fn the_model_of_the_loop_moves_as_the_firmware_does() {
    for (delay, further) in [("0", ""), ("1", ""), ("1", "[integral]\nposition_weight = 50\n"), ("0", MOTOR)]
    {
        let rig = model_rig(delay, further);
        let (certified, table) = designed(&rig);
        for law in [Law::Lqr, Law::PolePlacement] {
            let model = LoopModel::<f64>::as_it_runs(certified, &table, law).unwrap();
            let [worst, peak] = difference(&model, &rig, &table, law);
            // Only the rounding of the encoders is left, with the RMS that the noise model predicts (f32 is finer).
            // A wrong tick of delay or a lost term would be a hundred times larger.
            let rounding = encoder_force_n(&rig, certified, &table, law);
            assert!(
                worst < 8.0 * rounding,
                "{law:?} {delay} {further}: {worst:e}, rounding {rounding:e} rms"
            );
            assert!(8.0 * rounding < 0.02 * peak, "{law:?} {delay} {further}: {rounding:e} of {peak}");
            assert!(peak > 0.01);
        }
    }
}

/// The negative control, and what follows: a motor brakes within the tick, so that a stronger gear takes margins.
#[test]
fn a_motor_that_holds_its_voltage_is_not_a_force_that_is_held() {
    let rig = model_rig("0", MOTOR);
    let (certified, table) = designed(&rig);
    let mut held = table.clone();
    held.drive = DriveMap::Force(*table.drive.force().unwrap());
    let model = LoopModel::<f64>::as_it_runs(certified, &held, Law::Lqr).unwrap();
    let [worst, peak] = difference(&model, &rig, &table, Law::Lqr);
    assert!(worst > 0.02 * peak, "{worst} of {peak}");
    let phase_rad = |gear: &str| {
        let report = report(&model_rig("0", &MOTOR.replace("gear_ratio = 10", gear)));
        report[0].margins.as_ref().unwrap().phase_margin_rad.unwrap()
    };
    let [weak, strong] = [phase_rad("gear_ratio = 0.1"), phase_rad("gear_ratio = 10")];
    assert!(strong < 0.95 * weak, "{strong} {weak}");
}

#[test]
fn a_delay_margin_of_many_ticks_is_that_of_the_eigenvalues() {
    for period_s in [0.015, 0.011] {
        let text = format!(
            "name = \"slow\"\n[model]\na = [[0, 1], [0, 0]]\nb = [0, 1]\n[tick]\nperiod_s = {period_s}\n\
             [lqr]\nstate_weights = [1, 1]\nforce_weight = 1\n"
        );
        let rig = Rig::from_toml(&text, Path::new("slow.toml")).unwrap();
        let (certified, table) = designed(&rig);
        let report = linear(&rig, certified, &table).unwrap().remove(0);
        let model = LoopModel::<f64>::as_it_runs(certified, &table, report.law).unwrap();
        let ticks = report.margins.unwrap().delay_margin_ticks.unwrap();
        assert!(ticks > 40.0, "{ticks}");
        assert!(radius_with_delay(&model, ticks.floor() as usize) < 1.0, "{ticks}");
        assert!(radius_with_delay(&model, ticks.ceil() as usize) > 1.0, "{ticks}");
    }
}

#[test]
fn the_loop_is_on_the_edge_at_its_margins_and_nowhere_before() {
    for rig in [rig("quadruple-paper.toml"), rig("single-quanser-ip02.toml"), model_rig("1", "")] {
        let (certified, table) = designed(&rig);
        for report in linear(&rig, certified, &table).unwrap() {
            let model = LoopModel::<f64>::as_it_runs(certified, &table, law(&report)).unwrap();
            let margins = report.margins.unwrap();
            let edge = |name: &str, at: &dyn Fn(f64) -> f64, margin: f64, beyond: f64| {
                let name = format!("{} {} {name} {margin}", rig.name, report.law);
                assert!((at(margin) - 1.0).abs() < 1e-7, "{name}: {}", at(margin));
                assert!(at(margin * beyond) > 1.0 + 1e-8, "{name}: beyond {}", at(margin * beyond));
                assert!(at(margin / beyond) < 1.0 - 1e-8, "{name}: inside {}", at(margin / beyond));
            };
            let gain = |g: f64| radius_with_factor(&model, g, 0.0);
            edge("gain", &gain, margins.highest_gain.unwrap(), 1.001);
            edge("gain", &gain, margins.lowest_gain, 0.999);
            let phase = |phi: f64| radius_with_factor(&model, phi.cos(), phi.sin());
            edge("phase", &phase, margins.phase_margin_rad.unwrap(), 1.001);
            // Between the margins the loop is stable.
            let (low, high) = (margins.lowest_gain, margins.highest_gain.unwrap());
            for i in 1..40 {
                assert!(gain(low * (high / low).powf(f64::from(i) / 40.0)) < 1.0);
            }
            let delay = margins.delay_margin_ticks.unwrap();
            assert!(radius_with_delay(&model, delay.floor() as usize) < 1.0, "{delay}");
            assert!(radius_with_delay(&model, delay.ceil() as usize) > 1.0, "{delay}");
            // Every corner of the disk's gain and phase ranges lies inside the exact ones.
            let alpha = margins.disk_margin;
            assert!((2.0 + alpha) / (2.0 - alpha) <= high && (2.0 - alpha) / (2.0 + alpha) >= low);
            assert!(2.0 * (alpha / 2.0).atan() <= margins.phase_margin_rad.unwrap());
            assert!(margins.peak_sensitivity >= 1.0 && margins.peak_sensitivity.is_finite());
        }
    }
}

#[test]
fn the_largest_disk_touches_the_edge() {
    let rig = rig("quadruple-paper.toml");
    let (certified, table) = designed(&rig);
    let report = &linear(&rig, certified, &table).unwrap()[0];
    let margins = report.margins.clone().unwrap();
    let model = LoopModel::<f64>::as_it_runs(certified, &table, Law::Lqr).unwrap();
    // The factor (1 + δ/2) / (1 - δ/2) with δ = -2 / (S - T) at the worst frequency puts a pole on the circle.
    let response = model.response(margins.disk_margin_rad_per_s * rig.tick.period_s).unwrap();
    let half = (response.s - response.t).inv();
    let factor = (half + 1.0) / (-half + 1.0);
    let other = (-half + 1.0) / (half + 1.0);
    let nearest = [factor, other].map(|f| (radius_with_factor(&model, f.re, f.im) - 1.0).abs());
    assert!(nearest[0].min(nearest[1]) < 1e-6, "{nearest:?}");
}

#[test]
fn the_paper_rig_is_reported_stable_with_finite_margins() {
    for report in report(&rig("quadruple-paper.toml")) {
        assert!(report.stable && report.spectral_radius < 1.0);
        let (margins, tick) = (report.margins.unwrap(), report.tick.unwrap());
        assert!(margins.peak_sensitivity.is_finite() && margins.disk_margin > 0.0);
        assert!(tick.longest_stable_s.unwrap() > 0.001);
        assert!(tick.shortest_unstable_s.unwrap() >= tick.longest_stable_s.unwrap());
        // The sufficient criterion never promises more than the exact margin for constant delay.
        assert!(tick.jitter_ticks > 0.0 && tick.jitter_ticks <= margins.delay_margin_ticks.unwrap());
        assert!(tick.varying_delay_ticks <= margins.delay_margin_ticks.unwrap().ceil());
    }
}

#[test]
fn continuous_gains_held_for_three_milliseconds_are_reported_unstable() {
    let mut rig = rig("quadruple-paper.toml");
    rig.tick.period_s = 0.003;
    rig.kalman = None;
    rig.pole_placement = None;
    let certified = certified(&rig);
    let held = TableValues::of(&rig, certified, Gains::Continuous).unwrap();
    let report = &linear(&rig, certified, &held).unwrap()[0];
    assert!(!report.stable && (report.spectral_radius - 1.08).abs() < 0.005, "{}", report.spectral_radius);
    assert!(report.margins.is_none() && report.tick.is_none() && report.certificates.is_empty());
    // With the gains designed for that tick, the loop is stable.
    let sampled = TableValues::of(&rig, certified, Gains::Sampled).unwrap();
    assert!(linear(&rig, certified, &sampled).unwrap()[0].stable);
}

#[test]
fn every_gain_is_correctly_rounded_and_a_changed_one_is_noticed() {
    let rig = rig("single-quanser-ip02.toml");
    let (certified, mut table) = designed(&rig);
    for report in linear(&rig, certified, &table).unwrap() {
        let rounding = report.rounding.unwrap();
        assert!(rounding.gain_ulp <= 0.5 && rounding.observer_ulp.unwrap() <= 0.5, "{rounding:?}");
        assert!(rounding.spectral_radius_change.abs() < 1e-6);
        assert!(rounding.force_difference_relative.unwrap() < 1e-3, "{rounding:?}");
    }
    let observer = table.observer.as_mut().unwrap();
    observer.l[(1, 0)] = observer.l[(1, 0)].next_up();
    let ulp = linear(&rig, certified, &table).unwrap()[0].rounding.clone().unwrap().observer_ulp.unwrap();
    assert!(ulp > 0.5 && ulp < 1.6, "{ulp}");
}

#[test]
fn certificates_show_small_residuals() {
    for report in report(&rig("quadruple-paper.toml")) {
        assert_eq!(report.certificates.len(), 2);
        for certificate in report.certificates {
            assert!(certificate.residual < 1e-30, "{certificate:?}");
            assert!(certificate.condition > 0.01 && certificate.condition < 1e12, "{certificate:?}");
        }
    }
}

#[test]
fn the_predicted_rms_is_that_of_a_long_run() {
    let rig = rig("single-quanser-ip02.toml");
    let (certified, table) = designed(&rig);
    let report = &linear(&rig, certified, &table).unwrap()[0];
    let model = LoopModel::<f64>::as_it_runs(certified, &table, Law::Lqr).unwrap();
    let shares = report.noise.as_ref().unwrap();
    let of_encoders = |value: &dyn Fn(&upright_trust::verify::NoiseShare) -> f64| {
        shares.iter().filter(|s| s.source.starts_with("encoder")).map(|s| value(s).powi(2)).sum::<f64>()
    };
    // Predicted variances of u, cart position and angle; then batches of a run with uniform rounding errors.
    let predicted =
        [of_encoders(&|s| s.force_n), of_encoders(&|s| s.states[0]), of_encoders(&|s| s.states[2])];
    let steps = certified.double.kalman.as_ref().unwrap().steps.entries().to_vec();
    let mut random = rand_pcg::Pcg64::seed_from_u64(3);
    let mut state = Matrix::zeros(model.matrix.rows(), 1);
    let (batches, length) = (30, 20_000);
    let mut means = vec![[0.0; 3]; batches];
    for batch in 0..=batches {
        for _ in 0..length {
            let v = Matrix::from_fn(steps.len(), 1, |i, _| steps[i] * random.random_range(-0.5..0.5));
            let u = (&(&model.force_output * &state) + &(&model.sensor_to_force * &v))[(0, 0)];
            // The first batch lets the run settle.
            if let Some(mean) = batch.checked_sub(1).map(|b| &mut means[b]) {
                for (mean, value) in mean.iter_mut().zip([u, state[(0, 0)], state[(2, 0)]]) {
                    *mean += value * value / f64::from(length);
                }
            }
            state = &(&model.matrix * &state) + &(&model.sensor_input * &v);
        }
    }
    for (i, &predicted) in predicted.iter().enumerate() {
        let mean = means.iter().map(|m| m[i]).sum::<f64>() / batches as f64;
        let variance = means.iter().map(|m| (m[i] - mean).powi(2)).sum::<f64>() / (batches - 1) as f64;
        let error = (variance / batches as f64).sqrt();
        assert!(error < 0.05 * mean, "the run is long enough to say something");
        assert!((mean - predicted).abs() < 4.0 * error, "{i}: {mean:e} ± {error:e}, predicted {predicted:e}");
    }
}
