//! The decay of a real pendulum to rest, predicted from its first second with numbers from large swings.

use std::path::{Path, PathBuf};

use upright_design::rig::Rig;

use crate::cart_force::CartForce;
use crate::free::{self, fit};
use crate::model::Model;
use crate::parameters::{Layout, priors};
use crate::record::Record;
use crate::shooting::Shooting;
use crate::step::Step;
use crate::{AngleReference, AngleZero, Reading, Recordings};

/// The first second of the decay, in which the initial state is fitted.
const FIRST_S: f64 = 1.0;
/// Integration steps from one sample to the next.
const SUBSTEPS: usize = 16;

/// Recordings `names` of the single pendulum with a row every `period_s`.
fn record(rig: &Rig, names: &[&str], period_s: f64) -> Record {
    let path = |name: &&str| PathBuf::from(format!("../tool/tests/recordings/{name}.csv"));
    let reading = Reading {
        period_s: Some(period_s),
        angles: Some(AngleReference::Absolute),
        zero: Some(AngleZero::Upright),
        is_clamped: true,
        ..Reading::default()
    };
    let files: Vec<PathBuf> = names.iter().map(path).collect();
    Recordings::from_paths(rig, &files, &reading).unwrap().recorded(rig).unwrap().record
}

/// Errors (rad) of the prediction with `p` after the first second: rms, and at the end.
fn errors(model: &Model, decay: &Record, rig: &Rig, p: &[f64]) -> [f64; 2] {
    let priors = priors(rig, rig.chain().unwrap(), false);
    let first = decay.part(0.0, FIRST_S);
    let shooting = Shooting { model, record: &first, priors: &priors, free: false };
    let known = shooting.predictions(&shooting.fit(p, FIRST_S, 10, 3));
    // The state at the last sample but one of the first second, from what the fit predicts around it.
    let at = known.len() - 2;
    let angle = |sample: usize| known[sample].2[1];
    let rate = (angle(at + 1) - angle(at - 1)) / (2.0 * decay.dt_s);
    let hanging = core::f64::consts::PI - p[model.layout.zero(0)];
    let mut state = vec![0.0, hanging + angle(at), 0.0, rate, 0.0, 1f64.copysign(rate)];
    let mut step = Step::new(model, false);
    let (mut squares, mut last) = (0.0, 0.0);
    let rest = at + 1..decay.samples(0);
    for sample in rest.clone() {
        for _ in 0..SUBSTEPS {
            step.take(model, p, &state, &CartForce::default(), decay.dt_s / SUBSTEPS as f64);
            state.copy_from_slice(&step.end);
        }
        last = decay.pieces[0].y[2 * sample + 1] - model.measure(p, &state, 1).value;
        squares += last * last;
    }
    [(squares / rest.len() as f64).sqrt(), last.abs()]
}

#[test]
fn a_decay_to_rest_is_predicted_from_its_first_second() {
    let rig = Rig::from_path(Path::new("../../rigs/single-multiarm.toml")).unwrap();
    let swings = record(&rig, &["single-1", "single-2", "single-3", "single-4"], 0.004);
    let decay = record(&rig, &["decay-1"], 0.008);
    let layout = Layout { links: 1 };
    let mut priors = priors(&rig, rig.chain().unwrap(), false);
    free::known(&rig, layout, &mut priors, true);
    let model = Model { has_bristles: true, ..swings.model(9.81) };
    let found = fit(&model, &swings, &priors, &|_| false, &|| ()).unwrap();
    let [rms, last] = errors(&model, &decay, &rig, &found.p);
    assert!(rms < 3e-3 && last < 1e-3, "{rms} {last}");
    // The negative control: the viscous friction that fits the large swings best does not bring it to rest in time.
    let mut viscous = found.p.clone();
    (viscous[layout.dry(1)], viscous[layout.drag(0)]) = (0.0, 0.0);
    viscous[layout.viscous(1)] = 1.85e-4;
    let [rms, last] = errors(&model, &decay, &rig, &viscous);
    assert!(rms > 0.015 && last > 0.01, "{rms} {last}");
}
