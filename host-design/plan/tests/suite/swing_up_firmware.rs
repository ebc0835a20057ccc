//! The whole firmware raises and lowers the rigs with encoders, and refuses what it must not do.

use crate::published::{rig, rig_and_table_with_motions, stored_motions};
use upright::control::actuator::Drive;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::table::{Equilibrium, TableError};
use upright_closed_loop::harness::{HarnessError, Pins, Recording, World, record, with_firmware};
use upright_design::motion::Transition;
use upright_design::plant::absolute_angles;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::study::Study;
use upright_design::table::TableValues;
use upright_plan::{Condition, RandomRuns, firmware_runs, hangs, margins, up_and_down};

const RIGS: [&str; 5] = [
    "single-quanser-ip02",
    "double-quanser-dbpen",
    "triple-glueck-eder-kugi",
    "quadruple-paper",
    "single-absolute",
];

/// The rig and its table with the stored motions.
fn with_stored_motions(name: &'static str) -> (Rig, TableValues) {
    rig_and_table_with_motions(name).clone()
}

/// Up, one second upright, down, and half a second of hanging, with the rig's disturbances.
fn scenario(rig: &Rig, table: &TableValues, seed: u64) -> Scenario {
    let mut scenario = up_and_down(rig, table, 1.0).unwrap();
    scenario.start[0] = 0.001;
    scenario.start[2] += 0.017;
    Scenario { seed, counter_start: 65_000, ..scenario }
}

fn run(rig: &Rig, table: &TableValues, scenario: &Scenario) -> Result<Recording, HarnessError> {
    with_firmware(table, |target| record(rig, table, scenario, target))?
}

#[test]
fn every_rig_is_raised_balanced_and_lowered_from_encoders() {
    for name in RIGS.into_iter().chain(["double-absolute"]) {
        let (rig, table) = with_stored_motions(name);
        let recording = run(&rig, &table, &scenario(&rig, &table, 1)).unwrap();
        assert!(hangs(&recording), "{name}: {:?}, {:?}", recording.fault, recording.ticks.last());
    }
}

/// Reverses the gains of the raising: all columns after state and force.
fn reverse_gains(table: &mut TableValues) {
    let states = table.states();
    let raise = &mut table.swing_up.as_mut().unwrap().raise;
    let knots = raise.reference.len() / raise.reference_units.len();
    raise.reference[(states + 1) * knots..].iter_mut().for_each(|gain| *gain = -*gain);
}

/// The motions fit into the flash that is left for them.
#[test]
fn the_motions_of_four_links_take_at_most_45_kb() {
    let (_, table) = with_stored_motions("quadruple-paper");
    let motions = table.swing_up.as_ref().unwrap();
    println!("{} bytes", motions.bytes());
    assert!(motions.bytes() <= 45_000, "{}", motions.bytes());
    // Negative control: with a knot of the filter in every tick it would not fit.
    let dense = 2 * motions.raise.ticks as usize * motions.raise.filter_units.len();
    assert!(dense > 45_000, "{dense}");
}

#[test]
fn a_motion_with_a_defect_is_refused_or_ends_with_the_motor_off() {
    let (rig, table) = with_stored_motions("single-quanser-ip02");
    let scenario = scenario(&rig, &table, 1);
    let with = |change: &dyn Fn(&mut TableValues)| {
        let mut table = table.clone();
        change(&mut table);
        run(&rig, &table, &scenario)
    };
    let reversed = with(&reverse_gains);
    assert!(reversed.unwrap().fault.is_some(), "gains of the wrong sign");
    let spacing = with(&|table| table.swing_up.as_mut().unwrap().raise.reference_ticks /= 2);
    assert!(matches!(spacing, Err(HarnessError::Table(TableError::Dimensions))), "{spacing:?}");
    let spacing = with(&|table| table.swing_up.as_mut().unwrap().raise.reference_ticks *= 2);
    assert!(spacing.unwrap().fault.is_some(), "knots twice as far apart");
    let (_, other) = with_stored_motions("double-quanser-dbpen");
    let swapped = with(&|table| {
        let rig_hash = other.rig_hash;
        table.rig_hash = rig_hash;
    });
    assert!(matches!(swapped, Err(HarnessError::Table(TableError::RigHash))), "{swapped:?}");
}

/// A defect that is present from the first tick of the motion on.
#[derive(Debug, Clone, Copy)]
enum Wrong {
    Nothing,
    MotorDead,
    MotorReversed,
    MotorHalf,
    EncoderReversed(usize),
    EncodersSwapped(usize),
}

/// Raises the rig with the defect `wrong`; returns the latched fault, and the largest angle of any link from hanging
/// while the motor was on (rad).
fn raised_with(rig: &Rig, table: &TableValues, wrong: Wrong) -> (Option<Fault>, f64) {
    let mut scenario = scenario(rig, table, 3);
    scenario.counter_start = 0;
    with_firmware(table, |target| {
        let mut world = World::new(rig, table, &scenario, target).unwrap();
        let mut output = world.raise(None).unwrap();
        let zero = world.inputs().raw_counts;
        let mut largest = 0.0f64;
        for _ in 0..table.swing_up.as_ref().unwrap().raise.ticks {
            if !output.enable {
                break;
            }
            let hanging = |angle: f64| core::f64::consts::PI - angle.abs();
            largest = absolute_angles(world.bench.state()).map(hanging).map(f64::abs).fold(largest, f64::max);
            let factor = match wrong {
                Wrong::MotorDead => 0.0,
                Wrong::MotorReversed => -1.0,
                Wrong::MotorHalf => 0.5,
                _ => 1.0,
            };
            world.bench.tick(match output.drive {
                Drive::Force(force) => Drive::Force(factor * force),
                Drive::Duty(duty) => Drive::Duty(factor * duty),
                Drive::Steps(_) => panic!("pulses for a motor"),
            });
            let mut inputs = world.inputs();
            disturb(&mut inputs, &zero, wrong);
            output = world.session.tick(&inputs).unwrap();
        }
        // Continue until the fault is reported. The links must keep moving, or every encoder would count as frozen.
        for _ in 0..2 {
            world.bench.tick(output.drive);
            let inputs = world.inputs();
            output = world.session.tick(&inputs).unwrap();
        }
        (world.session.fault(), largest)
    })
    .unwrap()
}

/// Falsifies the counters relative to their readings `zero` at the start.
fn disturb(inputs: &mut Pins, zero: &[u32], wrong: Wrong) {
    let width = |sensor: usize, raw: u32| if sensor == 0 { raw } else { raw & 0xffff };
    let moved = |inputs: &Pins, sensor: usize| inputs.raw_counts[sensor].wrapping_sub(zero[sensor]);
    match wrong {
        Wrong::EncoderReversed(sensor) => {
            let back = zero[sensor].wrapping_sub(moved(inputs, sensor));
            inputs.raw_counts[sensor] = width(sensor, back);
        }
        Wrong::EncodersSwapped(sensor) => {
            let (a, b) = (moved(inputs, sensor), moved(inputs, sensor + 1));
            inputs.raw_counts[sensor] = width(sensor, zero[sensor].wrapping_add(b));
            inputs.raw_counts[sensor + 1] = width(sensor + 1, zero[sensor + 1].wrapping_add(a));
        }
        _ => (),
    }
}

#[test]
fn a_wrong_motor_or_encoder_is_found_before_the_links_have_left_the_lower_half() {
    for name in RIGS {
        let (rig, table) = with_stored_motions(name);
        let sensors = table.sensors();
        let mut wrongs = vec![Wrong::MotorDead, Wrong::MotorReversed, Wrong::MotorHalf];
        wrongs.extend((0..sensors).map(Wrong::EncoderReversed));
        wrongs.extend((1..sensors - 1).map(Wrong::EncodersSwapped));
        for wrong in wrongs {
            let (fault, largest) = raised_with(&rig, &table, wrong);
            println!("{name}, {wrong:?}: {fault:?} at {largest:.2} rad from hanging");
            assert!(fault.is_some() && largest < core::f64::consts::FRAC_PI_2, "{name}, {wrong:?}");
        }
        // Negative control: a healthy rig leaves the lower half, without a fault.
        let (fault, largest) = raised_with(&rig, &table, Wrong::Nothing);
        assert!(fault.is_none() && largest > 3.0, "{name}: {fault:?}, {largest}");
    }
}

/// How many of three runs of the firmware of `table` are raised, and how many are lowered, with masses ±5 %, friction
/// ±30 % and seeds from `base_seed` on.
fn random_runs(name: &'static str, table: &TableValues, base_seed: u64) -> [usize; 2] {
    let condition = &Condition::all()[2];
    let found = firmware_runs(
        &rig(name),
        table,
        stored_motions(name),
        condition,
        base_seed..base_seed + 3,
        &Study::whole(),
    )
    .unwrap();
    println!("{name}, {}: {found:?}", condition.name);
    [found.raise.arrived, found.lower.arrived]
}

#[test]
fn machines_that_the_law_brings_up_are_not_switched_off() {
    // One of these machines leaves the usual limits of the rail while it is lowered (triple), or is far from its
    // set-point before that (quadruple).
    let (triple, quadruple) = ("triple-glueck-eder-kugi", "quadruple-paper");
    assert_eq!(random_runs(quadruple, &with_stored_motions(quadruple).1, 4), [3, 3]);
    let mut table = with_stored_motions(triple).1;
    assert_eq!(random_runs(triple, &table, 13), [3, 3]);
    // Negative control: with the limits for balancing it is switched off.
    let usual = table.limits;
    let limits = &mut table.swing_up.as_mut().unwrap().limits;
    (limits.rail_m, limits.speed_m_per_s) = (usual.rail_m, usual.speed_m_per_s);
    assert_eq!(random_runs(triple, &table, 13), [1, 1]);
}

/// A motion does not count as arrived if the law would bring it up but the table's limits end it.
#[test]
fn a_motion_that_the_supervisor_ends_has_not_arrived() {
    const RUNS: usize = 200;
    let name = "single-quanser-ip02";
    let (rig, mut table) = with_stored_motions(name);
    let arriving = |table: &TableValues| {
        let (motions, condition) = (stored_motions(name), Condition::asked(&rig));
        let found =
            firmware_runs(&rig, table, motions, &condition, 1..1 + RUNS as u64, &Study::whole()).unwrap();
        [found.raise_in_all(), found.lower]
    };
    let is_enough =
        |runs: &RandomRuns| 100.0 * runs.interval[0] >= rig.swing_up.as_ref().unwrap().success_percent;
    let [raise, lower] = arriving(&table);
    assert!(is_enough(&raise) && is_enough(&lower), "{raise:?}, {lower:?}");
    let limits = &mut table.swing_up.as_mut().unwrap().limits;
    limits.speed_m_per_s *= 0.5;
    let [raise, _] = arriving(&table);
    assert!(!is_enough(&raise), "{raise:?}");
    // On this rail the firmware refuses to begin.
    table.limits.rail_m = [-0.2, 0.2];
    let [raise, _] = arriving(&table);
    assert_eq!((raise.arrived, raise.runs), (0, RUNS));
}

#[test]
fn a_motion_that_does_not_begin_has_the_reason_of_the_firmware() {
    let name = "single-quanser-ip02";
    let (mut rig, table) = with_stored_motions(name);
    let reasons = |rig: &Rig, condition: &Condition| {
        let found =
            firmware_runs(rig, &table, stored_motions(name), condition, 1..3, &Study::whole()).unwrap();
        found.refused.into_iter().collect::<Vec<_>>()
    };
    let condition = Condition::asked(&rig);
    assert_eq!(reasons(&rig, &condition), []);
    // The motor's small push does not move the cart.
    rig.reality.friction.cart_friction_n = 3.0;
    let reason = "the motor's sign is not checked since power-up".to_owned();
    assert_eq!(reasons(&rig, &condition), [(reason, 2)]);
}

#[test]
fn with_reversed_gains_no_random_run_arrives() {
    let name = "single-quanser-ip02";
    let (_, mut table) = with_stored_motions(name);
    assert_eq!(random_runs(name, &table, 1), [3, 3]);
    reverse_gains(&mut table);
    assert_eq!(random_runs(name, &table, 1), [0, 0]);
}

#[test]
fn up_and_down_are_refused_with_their_reasons() {
    let (rig, table) = with_stored_motions("single-quanser-ip02");
    let scenario = scenario(&rig, &table, 1);
    let refused = |table: &TableValues, request: Request| {
        with_firmware(table, |target| {
            let mut world = World::new(&rig, table, &scenario, target).unwrap();
            let inputs = world.inputs();
            match world.session.ask(request, &inputs) {
                Err(HarnessError::Refused { answer: Answer::NotNow(inhibits), .. }) => inhibits,
                answer => panic!("{answer:?}"),
            }
        })
        .unwrap()
    };
    let up = refused(&table, Request::Goto(Equilibrium::UPRIGHT));
    assert!(up.contains(Inhibits::NOT_HOMED.union(Inhibits::SIGNS)), "{up}");
    assert_eq!(refused(&table, Request::Goto(Equilibrium::HANGING)), Inhibits::NOT_BALANCING);
    let mut without = table.clone();
    without.swing_up = None;
    assert_eq!(refused(&without, Request::Goto(Equilibrium::UPRIGHT)), Inhibits::NO_SWING_UP);
    assert_eq!(refused(&without, Request::Goto(Equilibrium::HANGING)), Inhibits::NO_SWING_UP);
    let mut wide = table.clone();
    wide.swing_up.as_mut().unwrap().raise.travel_m = [-1.0, 1.0];
    let up = refused(&wide, Request::Goto(Equilibrium::UPRIGHT));
    assert!(up.contains(Inhibits::NO_ROOM), "{up}");
}

#[test]
fn a_hanging_link_may_be_pushed_hard_and_with_reversed_gains_not_at_all() {
    let (rig, mut table) = with_stored_motions("single-quanser-ip02");
    let of = |table: &TableValues, transition: Transition| -> Vec<[f64; 2]> {
        let all = margins(&rig, table, transition, 3, &|| ()).unwrap();
        all.iter().map(|margin| margin.links_n[0]).collect()
    };
    let (up, down) = (of(&table, Transition::Up), of(&table, Transition::Down));
    println!("{up:?}, {down:?}");
    assert!(up.iter().chain(&down).flatten().all(|&push| push > 0.1), "{up:?}, {down:?}");
    // A hanging link survives a stronger push than an upright one.
    let is_less =
        |upright: [f64; 2], hanging: [f64; 2]| (0..2).all(|side| 1.5 * upright[side] < hanging[side]);
    assert!(is_less(up[2], up[0]) && is_less(down[0], down[2]), "{up:?}, {down:?}");
    reverse_gains(&mut table);
    assert_eq!(of(&table, Transition::Up), [[0.0; 2]; 3]);
}
