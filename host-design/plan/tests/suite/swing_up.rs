//! Swing-up: the stored motions of the rigs in closed loop, and what has to be refused.

use std::path::Path;

use crate::published::{designed, rig, rig_and_table_with_motions, rig_path, stored_motions, table};
use upright_design::motion::RaiseAndLower;
use upright_design::numerics::Matrix;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_plan::{
    Script, SolvedCandidate, Stored, SwingUpError, judge, motions, refined, solved, with_motions,
};

const RIGS: [&str; 4] =
    ["single-quanser-ip02", "double-quanser-dbpen", "triple-glueck-eder-kugi", "quadruple-paper"];

fn rig_and_stored(name: &str) -> (Rig, Stored) {
    (rig(name), Stored::beside(&rig_path(name)).unwrap())
}

/// Whether the firmware with this table gets through a demonstration.
fn arrives(rig: &Rig, table: &TableValues, seed: u64, is_wrong: bool) -> bool {
    Script::draw(rig, table, seed, is_wrong).unwrap().run(table).unwrap().arrived
}

/// The same with these motions, which are not the stored ones.
fn arrives_with(rig: &Rig, motions: &RaiseAndLower) -> bool {
    let table = with_motions(rig, table(rig), motions, &[]).unwrap();
    arrives(rig, &table, 1, false)
}

/// `motions` checks each tick against the adaptive integrator, and each limit.
#[test]
fn every_stored_motion_obeys_the_equations_and_the_limits_and_arrives() {
    for name in RIGS.into_iter().chain(["single-absolute", "double-absolute"]) {
        let (rig, table) = rig_and_table_with_motions(name);
        for seed in 1..=2 {
            assert!(arrives(rig, table, seed, false), "{name}, seed {seed}");
        }
        assert!(arrives(rig, table, 3, true), "{name} with wrong masses and friction");
    }
}

/// A stepper's motion is one of the cart. No sensor corrects where the cart is, and a slower drive cannot follow.
#[test]
fn steppers_raise_and_lower_themselves_unless_the_drive_is_too_slow() {
    for name in ["single-stepper", "double-stepper", "quadruple-stepper"] {
        let (rig, table) = rig_and_table_with_motions(name);
        for (seed, is_wrong) in [(1, false), (2, true), (3, true)] {
            assert!(arrives(rig, table, seed, is_wrong), "{name}, seed {seed}");
        }
        let RaiseAndLower { raise, lower } = stored_motions(name);
        for l in raise.l.iter().chain(&lower.l) {
            let of_cart = |sensor| [l[(0, sensor)], l[(1, sensor)], l[(2, 0)]];
            assert!(
                (0..l.cols()).all(|sensor| of_cart(sensor) == [0.0; 3]) && l[(2, 1)] > 0.0,
                "{name}: {l:?}"
            );
        }
        let mut slow = rig.clone();
        let drive = slow.actuator.pulses_mut().unwrap();
        drive.speed_limit_m_per_s = Some(0.5 * drive.speed_limit_m_per_s.unwrap());
        let error = refined(&slow, &rig_and_stored(name).1).unwrap_err().to_string();
        assert!(error.contains("the limit of the cart speed is exceeded"), "{name}: {error}");
    }
}

#[test]
fn stored_motions_give_the_same_bits_each_time_and_survive_their_file() {
    let (rig, stored) = rig_and_stored("single-quanser-ip02");
    assert_eq!(motions(&rig, &stored).unwrap(), motions(&rig, &stored).unwrap());
    assert_eq!(
        stored.to_json(),
        std::fs::read_to_string(Stored::path_beside(&rig_path("single-quanser-ip02"))).unwrap()
    );
}

/// The last gain of the raising is nearly the gain that balances, so that the hand-over does not change the law.
#[test]
fn the_last_gain_is_the_gain_that_balances() {
    for name in RIGS {
        let raise = &stored_motions(name).raise;
        let balancing = designed(name).double.sampled.lqr.as_ref().unwrap().k.clone();
        let last = &raise.k[raise.steps() - 1];
        let apart = (last - &balancing).largest_entry() / balancing.largest_entry();
        assert!(apart < 0.02, "{name}: {apart}");
        // Negative control: along the motion the gain differs clearly.
        let farthest = raise.k.iter().map(|k| (k - &balancing).largest_entry()).fold(0.0, f64::max);
        assert!(farthest / balancing.largest_entry() > 0.2, "{name}: {farthest}");
    }
}

#[test]
fn a_motion_of_another_rig_is_refused() {
    let (mut heavier, stored) = rig_and_stored("single-quanser-ip02");
    let other = rig("double-quanser-dbpen");
    assert_eq!(motions(&other, &stored), Err(SwingUpError::Outdated));
    assert!(motions(&heavier, &stored).is_ok());
    if let Some(chain) = heavier.chain_mut() {
        chain.links[0].mass_kg *= 1.001;
    }
    assert_eq!(motions(&heavier, &stored), Err(SwingUpError::Outdated));
}

#[test]
fn a_reversed_gain_or_filter_falls() {
    let (rig, good) = (rig("single-quanser-ip02"), stored_motions("single-quanser-ip02"));
    let reversed = |all: &[Matrix<f64>]| all.iter().map(|m| -m).collect::<Vec<_>>();
    let mut bad = good.clone();
    bad.raise.k = reversed(&good.raise.k);
    assert!(!arrives_with(&rig, &bad));
    let mut bad = good.clone();
    bad.raise.l = reversed(&good.raise.l);
    assert!(!arrives_with(&rig, &bad));
}

#[test]
fn a_wrong_knot_spacing_is_refused_and_a_wrong_tick_falls() {
    let (rig, stored) = rig_and_stored("single-quanser-ip02");
    let wrong = stored.to_json().replacen("\"ticks\": 5", "\"ticks\": 4", 1);
    assert_ne!(wrong, stored.to_json());
    let wrong: Stored = serde_json::from_str(&wrong).unwrap();
    assert!(motions(&rig, &wrong).is_err());
    // Without every second entry, the motion runs at twice its speed.
    let good = stored_motions("single-quanser-ip02");
    let mut fast = good.clone();
    let raise = &mut fast.raise;
    raise.x = good.raise.x.iter().step_by(2).cloned().collect();
    let steps = raise.x.len() - 1;
    raise.u = good.raise.u.iter().step_by(2).take(steps).copied().collect();
    raise.k = good.raise.k.iter().step_by(2).take(steps).cloned().collect();
    raise.l = good.raise.l.iter().step_by(2).take(steps).cloned().collect();
    assert!(!arrives_with(&rig, &fast));
}

/// For a motion that does not survive the required errors, the message says which fault ends it and which smaller
/// errors it would survive, and with these it does.
#[test]
fn what_ends_a_fragile_motion_and_the_errors_that_it_would_survive_are_reported() {
    let (rig, stored) = rig_and_stored("single-quanser-ip02");
    let with = |mass: f64, friction: f64| {
        let mut rig = rig.clone();
        let rules = rig.swing_up.as_mut().unwrap();
        (rules.mass_spread_percent, rules.friction_spread_percent) = (mass, friction);
        judge(&rig, &stored, &|_| ()).map(|plan| plan.raise.runs.arrived)
    };
    let Err(SwingUpError::NotRobust { arrived, help, .. }) = with(60.0, 60.0) else { panic!("60 % arrives") };
    println!("{arrived}: {help}");
    let number = |key: &str| -> f64 {
        let (_, rest) = help.split_once(&format!("swing_up.{key}_spread_percent = ")).unwrap();
        rest.split_whitespace().next().unwrap().parse().unwrap()
    };
    let found = with(number("mass"), number("friction")).unwrap();
    assert!(found > arrived && help.contains(&format!("; {found} of 200 arrive with ")), "{found}: {help}");
    assert!(help.starts_with("fault tracking error ended "), "{help}");
}

#[test]
fn candidates_are_the_same_for_a_seed_and_fewer_runs_arrive_with_larger_errors() {
    let (mut rig, _) = rig_and_stored("single-quanser-ip02");
    let all = solved(&rig, 16, 1, &|_| ()).unwrap();
    let [first, second] = [1, 2].map(|seed| solved(&rig, 8, seed, &|_| ()).unwrap());
    println!("{all:?}");
    assert!(!first.is_empty() && all.len() >= 2, "{}", all.len());
    assert_eq!(all[..first.len()], first);
    // Seed 2 continues with the candidates after those of seed 1, and makes other runs.
    let durations = |some: &[SolvedCandidate]| some.iter().map(|one| one.duration_s).collect::<Vec<_>>();
    assert_eq!(durations(&all[first.len()..]), durations(&second));
    let rules = rig.swing_up.as_mut().unwrap();
    (rules.mass_spread_percent, rules.friction_spread_percent) = (60.0, 60.0);
    let wrong = solved(&rig, 8, 1, &|_| ()).unwrap();
    let arrived = |some: &[SolvedCandidate]| some.iter().map(|one| one.runs.arrived).sum::<usize>();
    assert!(arrived(&wrong) < arrived(&first), "{wrong:?}");
}

#[test]
fn a_damaged_file_is_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let rig = folder.path().join("my.toml");
    let error = Stored::beside(&rig).unwrap_err().to_string();
    assert!(error.contains("my.swing-up.json") && error.contains("upright swing-up"), "{error}");
    std::fs::write(Stored::path_beside(&rig), "{}").unwrap();
    let error = Stored::beside(&rig).unwrap_err().to_string();
    assert!(error.contains("my.swing-up.json") && error.contains("missing field"), "{error}");
}

#[test]
fn stored_motions_stay_those_of_a_rig_that_is_stilled_for_another_time_and_of_no_other() {
    let stored = Stored::beside(&rig_path("single-quanser-ip02")).unwrap();
    let text = std::fs::read_to_string(rig_path("single-quanser-ip02")).unwrap();
    let is_of = |text: &str| stored.is_of(&Rig::from_toml(text, Path::new("rig")).unwrap());
    let limited = |limit: &str| text.replace("\n[limits]\n", &format!("\n[limits]\n{limit}\n"));
    for limit in ["", "stilling_s = 0", "stilling_s = 3"] {
        assert!(is_of(&limited(limit)), "{limit}");
    }
    assert!(!is_of(&limited("still_time_s = 0.6")));
    let mut changed = 0;
    for line in text.lines() {
        let given = line.split('#').next().unwrap_or_default().trim_end();
        let is_number = given.contains(" = ") && given.ends_with(|c: char| c.is_ascii_digit() || c == ']');
        let Some(last) = given.rfind(|c: char| c.is_ascii_digit()).filter(|_| is_number) else { continue };
        let digit = if &given[last..=last] == "1" { "2" } else { "1" };
        let other = format!("{}{digit}{}", &given[..last], &given[last + 1..]);
        let Ok(rig) = Rig::from_toml(&text.replacen(given, &other, 1), Path::new("rig")) else { continue };
        assert!(!stored.is_of(&rig), "{other}");
        changed += 1;
    }
    assert!(changed > 25, "{changed}");
}
