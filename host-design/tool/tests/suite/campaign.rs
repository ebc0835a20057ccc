//! A short campaign: every defect is found in time, nothing else is, and without detection they are missed.

use std::path::Path;

use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_tool::campaign::{Campaign, Kind, Place, campaign, kinds, one};

fn rig(name: &str) -> (Rig, TableValues) {
    let rig = Rig::from_path(&Path::new("../rigs").join(name)).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    (rig, table)
}

fn run(rig: &Rig, table: &TableValues, kinds: &[Kind], runs: u64, place: Place<'_>) -> Campaign {
    campaign(rig, table, kinds, 3, runs, place, &|| ()).unwrap()
}

#[test]
fn every_defect_is_found_and_nothing_else() {
    for name in ["quadruple-paper.toml", "single-quanser-ip02.toml"] {
        let (rig, table) = rig(name);
        let kinds = kinds(&table, Place::Host);
        let result = run(&rig, &table, &kinds, 5 * kinds.len() as u64, Place::Host);
        for row in &result.rows {
            assert!(row.wrong.is_empty() && row.runs == 5, "{name}: {row:?}");
        }
    }
}

#[test]
fn without_detection_every_defect_that_needs_it_is_missed() {
    let (rig, table) = rig("quadruple-paper.toml");
    let kinds: Vec<Kind> =
        kinds(&table, Place::Host).into_iter().filter(|kind| kind.needs_detection()).collect();
    let result = run(&rig, &table, &kinds, 4 * kinds.len() as u64, Place::Blind);
    for row in &result.rows {
        assert!(row.missed > 0, "{row:?}");
    }
}

#[test]
fn a_run_is_the_same_every_time_and_does_not_depend_on_the_others() {
    let (rig, table) = rig("quadruple-paper.toml");
    let kinds = kinds(&table, Place::Host);
    let again = |number| one(&rig, &table, &kinds, 5, number, Place::Host).unwrap();
    assert_eq!(again(8), again(8));
    assert_ne!(again(8).number, again(8 + kinds.len() as u64).number);
}
