//! Sweeps over a rig file, and comparisons of the resulting designs.

use std::path::Path;

use crate::published::{rig, rig_path};
use upright::table::Law;
use upright_design::rig::{PolePlacement, Rig, RigError};
use upright_tool::compare::{
    ComparedConditions, ComparedRig, ComparedRow, Fate, Sweep, compare, csv, figure, jobs, notes, table,
};

const PAPER: &str = "quadruple-paper";

fn text_of(name: &str) -> String {
    std::fs::read_to_string(rig_path(name)).unwrap()
}

fn changed(text: &str, key: &str, value: f64) -> Result<Rig, RigError> {
    let sweep = Sweep { key: key.to_owned(), values: vec![value], log: false };
    sweep.rig(text, Path::new("my.toml"), value)
}

#[test]
fn a_swept_value_is_the_only_thing_that_changes() {
    let text = text_of(PAPER);
    let mut wanted = rig(PAPER);
    wanted.tick.period_s = 0.0025;
    assert_eq!(changed(&text, "tick.period_s", 0.0025).unwrap(), wanted);

    let mut wanted = rig(PAPER);
    wanted.lqr.as_mut().unwrap().state_weights[2] = 17.0;
    assert_eq!(changed(&text, "lqr.state_weights[3]", 17.0).unwrap(), wanted);

    let wanted_mass = changed(&text, "link[3].mass_kg", 0.125).unwrap();
    let chain = wanted_mass.chain().unwrap();
    let masses: Vec<f64> = chain.links.iter().map(|link| link.mass_kg).collect();
    assert_eq!(masses, [0.1, 0.1, 0.125, 0.1]);
}

#[test]
fn a_key_that_the_file_leaves_out_is_added_where_it_belongs() {
    let text = text_of(PAPER);
    let with_friction = changed(&text, "link[2].friction_n_m_s_per_rad", 1e-7).unwrap();
    let chain = with_friction.chain().unwrap();
    let frictions: Vec<f64> = chain.links.iter().map(|link| link.friction_n_m_s_per_rad).collect();
    assert_eq!(frictions, [0.0, 1e-7, 0.0, 0.0]);
    // A table that does not exist in the file, and integers.
    assert_eq!(
        changed(&text, "integral.position_weight", 3.0).unwrap().integral.unwrap().position_weight,
        3.0
    );
    let short = "name = \"a\"\n[cart]\nmass_kg = 1\n[[link]]\nmass_kg = 1\nlength_m = 1\n";
    assert_eq!(changed(short, "tick.delay_ticks", 1.0).unwrap().tick.delay_ticks, 1);
    assert_eq!(changed(short.trim_end(), "link[1].centre_of_mass_m", 0.25).unwrap().states(), 4);
}

#[test]
fn what_the_file_could_not_say_is_refused_as_in_a_file() {
    let text = text_of(PAPER);
    let message = |key: &str, value: f64| changed(&text, key, value).unwrap_err().to_string();
    let line = 1 + text.lines().position(|line| line.starts_with("period_s")).unwrap();
    let negative = message("tick.period_s", -1.0);
    assert!(negative.starts_with(&format!("my.toml:{line}:12: tick.period_s: found -1")), "{negative}");
    assert!(negative.contains("accepted: a number from 1e-6 to 10"), "{negative}");
    for (key, value, parts) in [
        ("tick.perod_s", 1.0, ["my.toml: tick.perod_s: unknown", "did you mean `period_s`?"]),
        ("tik.period_s", 1.0, ["my.toml: tik: unknown", "did you mean `tick`?"]),
        ("nam", 1.0, ["nam: unknown", "did you mean `name`?"]),
        ("tick.delay_ticks", 0.5, ["tick.delay_ticks", "0 or 1"]),
        ("pole_placement.far_poles", 1.0, ["pole_placement.far_poles: found 1", "a list"]),
        ("link[5].mass_kg", 1.0, ["link[5].mass_kg: missing", "then it can be changed"]),
        ("lqr.state_weights[11]", 1.0, ["lqr.state_weights[11]: missing", "then it can be changed"]),
        ("link.mass_kg", 1.0, ["link.mass_kg: missing", "then it can be changed"]),
    ] {
        let message = message(key, value);
        assert!(parts.iter().all(|part| message.contains(part)), "{key}: {message}");
    }
}

fn sweep_of(name: &str, sweep: &str) -> (Vec<ComparedRig>, Sweep) {
    let (text, sweep): (String, Sweep) = (text_of(name), sweep.parse().unwrap());
    let candidate = |&value: &f64| ComparedRig {
        label: name.to_owned(),
        rig: sweep.rig(&text, Path::new("rig.toml"), value).unwrap(),
        value: Some(value),
    };
    (sweep.values.iter().map(candidate).collect(), sweep)
}

fn fates(rows: &[ComparedRow]) -> String {
    let letter = |row: &ComparedRow| match row.fate {
        Fate::Settled => 'y',
        Fate::Survived => 'n',
        Fate::Fallen(_) => 'f',
        Fate::NoDesign(_) => '-',
    };
    rows.iter().map(letter).collect()
}

#[test]
fn table_2_of_the_paper_is_a_sweep() {
    let (candidates, sweep) = sweep_of(PAPER, "pole_placement.settling_time_s=3..9");
    let conditions = ComparedConditions {
        step_m: 1.0,
        duration_s: 6.5,
        full_state: true,
        raw_step: true,
        law: Some(Law::PolePlacement),
        ..ComparedConditions::default()
    };
    let rows = compare(&candidates, &conditions, &|| ()).unwrap();
    assert_eq!(fates(&rows), "ffyyynn");
    let settled: Vec<String> = rows
        .iter()
        .filter_map(|row| row.figures.as_ref()?.settling_time_s.map(|time| format!("{time:.2}")))
        .collect();
    assert_eq!(settled, ["4.27", "5.09", "5.91"]);
    // The far poles stay, so the fastest pole stays too.
    assert!(rows.iter().all(|row| row.figures.as_ref().unwrap().fastest_pole_per_s == -47.0));
    assert!(figure(&rows, &candidates, Some(&sweep)).svg().unwrap().contains("settling_time_s"));
}

#[test]
fn continuous_gains_end_where_the_tick_gets_long_and_sampled_ones_do_not() {
    let (candidates, _) = sweep_of(PAPER, "tick.period_s=0.001..0.005:3");
    let run = |continuous_gains: bool| {
        let conditions = ComparedConditions {
            full_state: true,
            continuous_gains,
            duration_s: 5.0,
            law: Some(Law::Lqr),
            ..ComparedConditions::default()
        };
        compare(&candidates, &conditions, &|| ()).unwrap()
    };
    // At 3 ms the loop is unstable, but the force limit keeps it swinging.
    let (held, redesigned) = (run(true), run(false));
    assert_eq!((fates(&held).as_str(), fates(&redesigned).as_str()), ("ynf", "yyy"));
    let phase = |row: &ComparedRow| row.figures.as_ref().unwrap().phase_margin_rad;
    assert!(phase(&held[0]).is_some() && phase(&held[1]).is_none() && phase(&held[2]).is_none());
    assert!(redesigned.iter().all(|row| phase(row).is_some()));
    assert!(table(&held, Some("tick.period_s")).lines().last().unwrap().contains("unstable"));
}

#[test]
fn what_has_no_design_is_a_row_with_its_reason() {
    let mut hopeless = rig("single-quanser-ip02");
    hopeless.tick.period_s = 9.0; // no law can balance at this tick
    let bad_weight = {
        let mut rig = rig("single-quanser-ip02");
        rig.lqr.as_mut().unwrap().state_weights = vec![0.0; 4];
        rig
    };
    let candidates = [("good", rig("single-quanser-ip02")), ("slow", hopeless), ("weightless", bad_weight)]
        .map(|(label, rig)| ComparedRig { label: label.to_owned(), rig, value: None });
    let rows = compare(&candidates, &ComparedConditions::default(), &|| ()).unwrap();
    // The pole placement of the third candidate does not depend on its weights.
    assert_eq!(fates(&rows), "y--y-y");
    let notes = notes(&rows, None);
    assert_eq!(notes.len(), 3);
    assert!(notes[0].starts_with("slow: tick.period_s = 9 s is too long"), "{}", notes[0]);
    assert!(notes[1].contains("weightless: LQR"), "{}", notes[1]);
    let table = table(&rows, None);
    assert_eq!(table.lines().count(), 2 + 6);
    assert!(figure(&rows, &candidates, None).svg().is_ok());

    let csv = String::from_utf8(csv(&rows, None).unwrap()).unwrap();
    let mut lines = csv.lines();
    let columns = lines.next().unwrap().split(',').count();
    assert_eq!((columns, lines.count()), (15, 6));
}

#[test]
fn every_row_says_when_it_is_done() {
    let (candidates, _) = sweep_of("single-quanser-ip02", "lqr.force_weight=0.01..1:3:log");
    let done = std::sync::atomic::AtomicUsize::new(0);
    let conditions = ComparedConditions { duration_s: 3.0, ..ComparedConditions::default() };
    let count = || {
        done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    };
    let rows = compare(&candidates, &conditions, &count).unwrap();
    assert_eq!((rows.len(), done.into_inner()), (6, 6));
    assert_eq!(jobs(&candidates, &conditions).len(), 6);
    // A higher weight on the force reduces the force.
    let force: Vec<f64> = rows[..3].iter().map(|row| row.figures.as_ref().unwrap().peak_force_n).collect();
    assert!(force[0] > force[1] && force[1] > force[2], "{force:?}");
}

#[test]
fn a_sweep_of_one_law_leaves_the_other_as_it_is() {
    let (candidates, _) = sweep_of(PAPER, "pole_placement.overshoot_percent=1..5:2");
    let of = |candidate: &ComparedRig| match candidate.rig.pole_placement.clone().unwrap() {
        PolePlacement::Response { overshoot_percent, .. } => overshoot_percent,
        PolePlacement::Poles(_) => panic!("a response"),
    };
    assert_eq!([of(&candidates[0]), of(&candidates[1])], [1.0, 5.0]);
    assert_eq!(candidates[0].rig.lqr, candidates[1].rig.lqr);
}
