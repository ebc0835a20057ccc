//! A run in lockstep with others gives the same bits as the run alone.

use upright::table::{DriveMap, ForceMap, Law};
use upright_design::plant::{LANES, Plant, chain_lanes, chain_plant};
use upright_design::rig::{PerJoint, Rig};
use upright_design::simulate::{Fall, Job, Sample, Scenario, run, run_all};
use upright_design::table::TableValues;
use upright_trust::verify::{Spread, sample};

use crate::published::table;
use crate::supervised::rig;

/// Everything that is seen of a run: the bits of each tick, and its end.
type Seen = (Vec<u64>, Option<Fall>);

fn record(bits: &mut Vec<u64>, sample: &Sample<&[f64]>) {
    let tick = [sample.t, sample.target, sample.setpoint, sample.requested, sample.force];
    bits.extend(tick.iter().chain(sample.state).chain(sample.estimate).map(|value| value.to_bits()));
}

fn alone(table: &TableValues, cases: &[(Rig, Scenario)]) -> Vec<Seen> {
    let one = |(rig, scenario): &(Rig, Scenario)| {
        let mut bits = Vec::new();
        let fall = run(rig, table, scenario, &mut |sample| record(&mut bits, sample)).unwrap();
        (bits, fall)
    };
    cases.iter().map(one).collect()
}

fn in_lockstep(table: &TableValues, cases: &[(Rig, Scenario)]) -> Vec<Seen> {
    let mut bits = vec![Vec::new(); cases.len()];
    let mut observers: Vec<_> =
        bits.iter_mut().map(|bits| move |seen: &Sample<&[f64]>| record(bits, seen)).collect();
    let mut jobs: Vec<Job<'_>> = observers
        .iter_mut()
        .zip(cases)
        .map(|(observe, (rig, scenario))| Job { table, rig, scenario, observe })
        .collect();
    let falls = run_all(&mut jobs).unwrap();
    bits.into_iter().zip(falls).collect()
}

/// Random plants with disturbances; every third starts so far off that it falls.
fn random_plants(rig: &Rig, count: u64, duration_s: f64) -> Vec<(Rig, Scenario)> {
    let spread = Spread { other_delay: 0.5, duration_s, ..Spread::of(rig) };
    let thrown = Spread { tilt_rad: 0.5, ..spread };
    let one = |seed: u64| sample(rig, Law::Lqr, if seed.is_multiple_of(3) { &thrown } else { &spread }, seed);
    (0..count).map(one).collect()
}

#[test]
fn every_lane_has_the_bits_of_the_run_alone_and_one_that_falls_makes_room() {
    for name in ["quadruple-paper", "triple-glueck-eder-kugi"] {
        let rig = rig(name);
        let table = table(&rig);
        for count in [2, 3 * LANES as u64 + 1] {
            let cases = random_plants(&rig, count, 0.5);
            let expected = alone(&table, &cases);
            assert!(expected.iter().any(|(_, fall)| fall.is_some()), "{name}: some fall");
            assert!(expected.iter().any(|(_, fall)| fall.is_none()), "{name}: some survive");
            assert!(in_lockstep(&table, &cases) == expected, "{name}, {count} runs");
        }
    }
}

#[test]
fn another_disturbance_in_one_lane_changes_that_lane_only() {
    // Negative control: a difference is noticed, in its own lane only.
    let rig = rig("quadruple-paper");
    let table = table(&rig);
    let mut cases = random_plants(&rig, LANES as u64, 0.05);
    let before = in_lockstep(&table, &cases);
    cases[5].1.force_offset_n = 1e-9;
    let after = in_lockstep(&table, &cases);
    let differ: Vec<usize> = (0..LANES).filter(|&lane| before[lane] != after[lane]).collect();
    assert_eq!(differ, [5]);
}

#[test]
fn runs_with_different_tables_are_in_one_lockstep() {
    let rig = rig("quadruple-paper");
    let table = table(&rig);
    let mut weaker = table.clone();
    weaker.drive = DriveMap::Force(ForceMap { limit_n: 0.1, late: weaker.drive.late() });
    let cases = random_plants(&rig, 4, 0.1);
    let tables = [&table, &weaker, &weaker, &table];
    let expected: Vec<Seen> = cases
        .iter()
        .zip(tables)
        .map(|(case, table)| alone(table, core::slice::from_ref(case)).remove(0))
        .collect();
    assert!(expected[1] != alone(&table, &cases[1..2])[0], "the tables differ");
    let mut bits = vec![Vec::new(); cases.len()];
    let mut observers: Vec<_> =
        bits.iter_mut().map(|bits| move |seen: &Sample<&[f64]>| record(bits, seen)).collect();
    let mut jobs: Vec<Job<'_>> = observers
        .iter_mut()
        .zip(cases.iter().zip(tables))
        .map(|(observe, ((rig, scenario), table))| Job { table, rig, scenario, observe })
        .collect();
    let falls = run_all(&mut jobs).unwrap();
    assert!(bits.into_iter().zip(falls).collect::<Vec<Seen>>() == expected);
}

#[test]
fn what_cannot_be_in_lockstep_runs_alone_with_the_same_bits() {
    let quadruple = rig("quadruple-paper");
    let mut cases = random_plants(&quadruple, 5, 0.1);
    cases[1].0.reality.friction.joint_friction_n_m = PerJoint::all(5e-5);
    cases[2].0.reality.driver.driver_lag_s = Some(1e-3);
    cases[3].1.substeps = 3;
    cases[4].0.reality.driver.latency_s = 1e-4;
    assert!(in_lockstep(&table(&quadruple), &cases) == alone(&table(&quadruple), &cases));
    // Imperfections of sensors and parameters alone run in lockstep.
    let mut cases = random_plants(&quadruple, 5, 0.1);
    cases[1].0.reality.sensors.homing_error_rad = PerJoint::all(1e-3);
    cases[2].0.reality.parameters.link_mass_percent = PerJoint::all(3.0);
    assert!(in_lockstep(&table(&quadruple), &cases) == alone(&table(&quadruple), &cases));
    // With a motor.
    let single = rig("single-quanser-ip02");
    let cases = random_plants(&single, 3, 0.1);
    assert!(in_lockstep(&table(&single), &cases) == alone(&table(&single), &cases));
}

#[test]
fn lanes_have_the_bits_of_a_plant_beyond_the_range_of_the_fast_sine_and_with_nan() {
    let rig = rig("quadruple-paper");
    let chain = rig.chain().unwrap();
    let mut lanes = chain_lanes(4).unwrap();
    let mut plants: Vec<Box<dyn Plant>> = Vec::new();
    let angles = [0.0, 1.0, -2.5, 999_999.0, 1_000_001.0, -3e7, f64::NAN, 1e300];
    for (lane, angle) in angles.into_iter().enumerate() {
        let start = [0.1, -0.2, angle, 3.0, -0.3, 1e-3, 2.0, -9.0, 0.0, 0.5];
        let mut plant = chain_plant(chain).unwrap();
        plant.set_state(&start);
        plants.push(plant);
        lanes.place(lane, chain, &start).unwrap();
    }
    for step in 0..20 {
        let torques = [1e-3, -2e-3, 0.0, f64::from(step) * 1e-4];
        for (lane, plant) in plants.iter_mut().enumerate() {
            lanes.push(lane, lane as f64 - 3.0, &torques);
            plant.advance(lane as f64 - 3.0, &torques, 1e-3, 2);
        }
        lanes.advance(1e-3, 2);
    }
    for (lane, plant) in plants.iter().enumerate() {
        let (mut expected, mut found) = ([0.0; 10], [0.0; 10]);
        plant.write_state(&mut expected);
        lanes.write_state(lane, &mut found);
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        assert!(expected.iter().zip(&found).all(same), "lane {lane}: {expected:?} {found:?}");
    }
}
