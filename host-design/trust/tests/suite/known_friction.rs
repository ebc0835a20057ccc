//! Known friction in `[friction]`: what is compensated, what stays unchanged, and what is refused.

use std::path::Path;

use upright::table::Law;
use upright_design::design::design;
use upright_design::rig::{Rig, RigError, Tolerances};
use upright_design::study::Study;
use upright_design::table::{Gains, TableValues, gains_source};
use upright_trust::robust::{JudgeSettings, judge};

fn text(name: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{name}.toml"));
    std::fs::read_to_string(file).unwrap()
}

fn with(name: &str, friction: &str) -> Result<Rig, RigError> {
    Rig::from_toml(&format!("{}\n[friction]\n{friction}\n", text(name)), Path::new("test.toml"))
}

fn table(rig: &Rig) -> TableValues {
    TableValues::of(rig, &design(rig).unwrap(), Gains::Sampled).unwrap()
}

/// How many of 2 runs of 10 s survive with none, half, all and 125 % of this joint friction.
fn survived(rig: &Rig, law: Law, joint_friction_n_m: f64) -> Vec<u64> {
    let tolerances = Tolerances { joint_friction_n_m, ..Tolerances::default() };
    let settings = JudgeSettings { runs: 2, duration_s: 10.0, ..JudgeSettings::of(rig) };
    let found = judge(rig, &table(rig), law, &tolerances, &settings, &Study::whole()).unwrap();
    found.machines.iter().map(|machine| machine.survived).collect()
}

#[test]
fn the_quadruple_survives_a_known_friction_that_makes_it_fall_without_compensation() {
    let known = with("quadruple-robust", "joint_n_m = 3e-4").unwrap();
    assert_eq!(survived(&known, Law::Lqr, 3e-4)[..3], [2, 2, 2]);
    let unknown = Rig { friction: None, ..known.clone() };
    assert_eq!(survived(&unknown, Law::Lqr, 3e-4)[2..], [0, 0]);
    // Negative control: nearly all of the static effect fed forward makes it fall.
    let too_much = with("quadruple-robust", "joint_n_m = 3e-4\nfed_forward_percent = 90").unwrap();
    assert_eq!(survived(&too_much, Law::Lqr, 3e-4)[2..], [0, 0]);
}

#[test]
fn friction_changes_the_hash_and_the_table_by_nothing_but_itself() {
    let known = with("quadruple-paper", "joint_n_m = [1e-4, 1e-4, 2e-4, 2e-4]\ncart_n = 0.2").unwrap();
    let unknown = Rig { friction: None, ..known.clone() };
    assert_ne!(known.hash(), unknown.hash());
    let (with, without) = (table(&known), table(&unknown));
    assert!(without.friction.is_none());
    assert_eq!((&with.laws, &with.observer), (&without.laws, &without.observer));
    let map = with.friction.as_ref().unwrap();
    let coulomb: Vec<f32> = map.axes.row(0).iter().copied().take(5).collect();
    assert_eq!(coulomb, [0.18, 1e-4, 1e-4, 2e-4, 2e-4]);
    assert_eq!(map.axes[(2, 0)], -1.0);
    // The cart's friction acts as the force does.
    let bd = &with.observer.as_ref().unwrap().bd;
    assert!((0..10).all(|state| (map.effect[(state, 0)] - bd[state]).abs() <= 1e-6 * bd[state].abs()));
    let source = gains_source(&known, &with);
    assert!(source.contains("FrictionMap {"));
    assert!(!gains_source(&unknown, &without).contains("FrictionMap"));
}

#[test]
fn friction_that_cannot_be_compensated_is_refused() {
    let refused = |found: Result<Rig, RigError>, why: &str| {
        let error = found.unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    };
    refused(with("quadruple-paper", "joint_n_m = [1e-4, 1e-4]"), "joint_n_m");
    refused(with("quadruple-paper", "joint_n_m = -1e-4"), "a number >= 0, or one per joint");
    refused(with("quadruple-paper", "stribeck = 1"), "stribeck");
    let model = "name = \"model\"\n[model]\na = [[0, 1], [0, 0]]\nb = [0, 1]\n[friction]\ncart_n = 1\n";
    refused(Rig::from_toml(model, Path::new("test.toml")), "only a chain of links");
    let blind = "name = \"blind\"\n[cart]\nmass_kg = 1\n[[link]]\nmass_kg = 0.1\nlength_m = 0.3\n[friction]\ncart_n = 1\n";
    refused(Rig::from_toml(blind, Path::new("test.toml")), "only with [kalman]");
}
