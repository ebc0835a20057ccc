//! Gains for stated tolerances: what is written is what was chosen, and it survives what makes the file's own gains
//! fall.

use std::path::Path;

use upright::table::Law;
use upright_design::design::design;
use upright_design::rig::{Rig, Tolerances};
use upright_design::study::Study;
use upright_design::table::{Gains, TableValues};
use upright_trust::robust::{JudgeSettings, Judgement, RobustError, choose, judge, rewritten};

fn text(name: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{name}.toml"));
    std::fs::read_to_string(file).unwrap()
}

fn rig(text: &str) -> Rig {
    Rig::from_toml(text, Path::new("test.toml")).unwrap()
}

/// Two short runs of each share.
fn short(rig: &Rig) -> JudgeSettings {
    JudgeSettings { runs: 2, duration_s: 10.0, ..JudgeSettings::of(rig) }
}

fn judged(rig: &Rig, tolerances: &Tolerances, settings: &JudgeSettings) -> Vec<Judgement> {
    let table = TableValues::of(rig, &design(rig).unwrap(), Gains::Sampled).unwrap();
    let judged = |(law, _)| judge(rig, &table, law, tolerances, settings, &Study::whole()).unwrap();
    table.laws.present().map(judged).collect()
}

#[test]
fn the_robust_quadruple_survives_what_makes_the_papers_fall() {
    let (robust, paper) = (rig(&text("quadruple-robust")), rig(&text("quadruple-paper")));
    // The largest share that is tried is 1.5e-4 N·m.
    let stated = robust.robust.clone().unwrap();
    assert_eq!((stated.mass_percent, stated.joint_friction_n_m), (10.0, 1.2e-4));
    for judgement in judged(&robust, &stated, &short(&robust)) {
        assert!(judgement.survives() && judgement.corners == Some([32, 32]), "{judgement:?}");
    }
    // Negative control: the paper's weights.
    for judgement in judged(&paper, &stated, &short(&paper)) {
        assert!(judgement.machines[0].survived == 2 && judgement.machines[3].survived == 0, "{judgement:?}");
        assert!(judgement.corners.is_some_and(|[_, survived]| survived < 32), "{judgement:?}");
    }
}

#[test]
fn all_else_of_the_robust_quadruple_is_of_the_papers_file() {
    let (robust, paper) = (rig(&text("quadruple-robust")), rig(&text("quadruple-paper")));
    let same = Rig {
        name: paper.name.clone(),
        lqr: paper.lqr.clone(),
        pole_placement: paper.pole_placement.clone(),
        kalman: paper.kalman.clone(),
        robust: None,
        ..robust
    };
    assert_eq!(same, paper);
}

#[test]
fn what_is_written_is_what_was_judged() {
    let own = text("single-quanser-ip02");
    let single = rig(&own);
    let tolerances = Tolerances { mass_percent: 20.0, joint_friction_n_m: 2e-2, ..Tolerances::default() };
    let settings = short(&single);
    let (choice, front) = choose(&single, &tolerances, &settings, false, &|_| ()).unwrap();
    assert!(front.is_none() && choice.laws.len() == 2);
    let written =
        rewritten(&own, "single-quanser-ip02.toml", "chosen", &single, &tolerances, &choice).unwrap();
    let chosen = rig(&written);
    assert_eq!((chosen.name.as_str(), chosen.robust.as_ref()), ("chosen", Some(&tolerances)));
    assert!(own.lines().filter(|line| line.starts_with('#')).all(|comment| written.contains(comment)));
    // Designed again from the text, the loops run as those that were judged, in every bit of every figure.
    let again = judged(&chosen, &tolerances, &settings);
    let before: Vec<Judgement> = choice.laws.iter().map(|chosen| chosen.judgement.clone()).collect();
    assert_eq!(again, before);
    assert!(before.iter().all(Judgement::survives));
    // Negative control: another joint noise leads to other runs.
    let mut other = chosen;
    other.kalman.as_mut().unwrap().joint_noise[0] *= 2.0;
    assert_ne!(judged(&other, &tolerances, &settings), before);
}

#[test]
fn a_stepper_gets_weights_that_survive_what_its_own_do_not() {
    let own = text("single-stepper");
    let single = rig(&own);
    let tolerances = Tolerances { mass_percent: 15.0, joint_friction_n_m: 8e-3, ..Tolerances::default() };
    let settings = short(&single);
    let (choice, _) = choose(&single, &tolerances, &settings, false, &|_| ()).unwrap();
    let written = rewritten(&own, "single-stepper.toml", "chosen", &single, &tolerances, &choice).unwrap();
    assert!(written.contains("; predicted ripple ") && written.contains(" m/s²\n"), "{written}");
    assert!(written.contains("acceleration_weight") && !written.contains("force_rms_n"), "{written}");
    let again = judged(&rig(&written), &tolerances, &settings);
    assert_eq!(again, [choice.laws[0].judgement.clone()]);
    // A cart whose acceleration is imposed has no mass that could be wrong.
    assert!(again[0].survives() && again[0].corners == Some([2, 2]), "{again:?}");
    // Negative control: its own numbers.
    assert!(!judged(&single, &tolerances, &settings)[0].survives());
}

/// Joints that stick hold links that lean by less than a count, whatever the controller does.
#[test]
fn friction_that_holds_the_links_of_a_stepper_up_is_not_survived() {
    let quadruple = rig(&text("quadruple-stepper"));
    let tolerances = Tolerances { joint_friction_n_m: 1e-2, ..Tolerances::default() };
    let machines = judged(&quadruple, &tolerances, &short(&quadruple)).remove(0).machines;
    let survived: Vec<_> = machines.iter().map(|runs| runs.survived).collect();
    // With the largest friction, one of the two stays where it is.
    assert_eq!(survived[..3], [2, 0, 0]);
    assert!(survived[3] < 2, "{survived:?}");
}

#[test]
fn where_nothing_helps_the_reason_is_reported() {
    let single = rig(&text("single-quanser-ip02"));
    let reason = |tolerances: Tolerances| match choose(&single, &tolerances, &short(&single), false, &|_| ())
    {
        Err(RobustError::Unhelped(reason)) => reason,
        other => panic!("{other:?}"),
    };
    let friction = reason(Tolerances { joint_friction_n_m: 10.0, ..Tolerances::default() });
    assert!(
        friction.contains("loops survives friction") && friction.contains("smaller bearings"),
        "{friction}"
    );
    assert!(friction.contains("not even an eighth"), "{friction}");
    let none = choose(&single, &Tolerances::default(), &short(&single), false, &|_| ());
    assert!(matches!(none, Err(RobustError::NoTolerance)));
}

#[test]
fn tolerances_that_no_run_can_have_are_refused() {
    let own = text("single-quanser-ip02");
    let refused = |line: &str| {
        let text = format!("{own}\n[robust]\n{line}\n");
        Rig::from_toml(&text, Path::new("test.toml")).unwrap_err().to_string()
    };
    for (line, accepted) in [("mass_percent = 50", "<= 45"), ("latency_s = 0.001", "0.3 period_s")] {
        assert!(refused(line).contains(accepted), "{}", refused(line));
    }
    let single = rig(&own);
    let table = TableValues::of(&single, &design(&single).unwrap(), Gains::Sampled).unwrap();
    let wrong = Tolerances { mass_percent: 50.0, ..Tolerances::default() };
    assert!(judge(&single, &table, Law::Lqr, &wrong, &short(&single), &Study::whole()).is_err());
}
