//! A drive that takes pulses: every pulse of the chip is counted, with its direction, and those of each tick are the
//! host's.

use super::chip::{Answer, Chip, Train, uf2_with_motions};
use super::recorded::{Recorded, recorded};
use super::{assert_equal, by_hand, no_defect};
use crate::published::rig_and_table;
use upright::supervision::supervisor::State;
use upright_closed_loop::harness::Pins;
use upright_design::simulate::Scenario;
use upright_tool::image::PICO_BALANCING_CYCLES;

/// Cycles of 2.5 µs.
const LEAST: u32 = 312;

/// The first tick whose pulses are not those of the host. The last tick with the motor on may have lost some: the motor
/// goes off before they are over.
fn first_difference(run: &Recorded, trains: &[Train]) -> Option<usize> {
    let last = run.last_on();
    (0..run.outputs.len()).find(|&tick| {
        let wanted = run.outputs[tick].pulses();
        let given: Vec<i32> =
            trains.iter().filter(|train| train.tick == tick).map(|train| train.pulses).collect();
        match given[..] {
            [] => wanted != 0 && tick != last,
            [pulses] if tick == last => pulses.abs() > wanted.abs() || pulses * wanted < 0,
            [pulses] => pulses != wanted,
            _ => true,
        }
    })
}

/// Checks outputs, telemetry and pulses; returns those of each tick, and the cycles of the longest one.
fn assert_even(run: &Recorded, answers: &[Answer], tick: u32) -> (Vec<Train>, u32) {
    let most = assert_equal(run, answers);
    let trains: Vec<Train> = answers.iter().flat_map(|answer| answer.trains.iter().copied()).collect();
    assert_eq!(first_difference(run, &trains), None, "first tick with other pulses");
    let sum: i32 = trains.iter().map(|train| train.pulses.abs()).sum();
    println!("{sum} pulses in {} ticks", trains.len());
    for train in trains.iter().filter(|train| train.tick != run.last_on()) {
        assert!(train.width >= LEAST && train.setup >= LEAST, "{train:?}");
        let number = train.pulses.unsigned_abs();
        let interval = if number > 1 { train.longest } else { 2 * train.first };
        assert!(number == 1 || train.shortest == train.longest, "{train:?}");
        assert!((tick / 100 * 99..=tick).contains(&(number * interval)), "{train:?}");
        assert!(train.first.abs_diff(interval / 2) < 20, "{train:?}");
    }
    (trains, most)
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn a_stepper_gets_the_pulses_of_the_host_until_the_emergency_stop() {
    let (rig, table) = rig_and_table("single-stepper");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let press = |pins: &mut Pins| pins.contacts.emergency_stop = true;
    // While the cart moves to another setpoint.
    let scenario = Scenario { step_m: 0.05, step_at_s: 6.0, ..by_hand(rig, 7.0) };
    let mut run = recorded(rig, table, &scenario, Some((State::Balancing, 610, press)));
    run.cut_after_stop();
    let answers = Chip::start(&uf2, table.sensors()).replay(&run);
    let (mut trains, most) = assert_even(&run, &answers, TICK);
    assert!(most <= PICO_BALANCING_CYCLES[0], "{most} cycles");
    // Negative control: a pulse is dropped.
    trains[20].pulses -= trains[20].pulses.signum();
    assert_eq!(first_difference(&run, &trains), Some(trains[20].tick));
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn a_stepper_balances_four_links_at_1_khz() {
    let (rig, table) = rig_and_table("quadruple-stepper");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let run = recorded(rig, table, &by_hand(rig, 0.5), no_defect());
    let answers = Chip::start(&uf2, table.sensors()).replay(&run);
    let (trains, most) = assert_even(&run, &answers, 125_000);
    assert!(trains.len() > 300 && most <= PICO_BALANCING_CYCLES[3], "{} ticks, {most} cycles", trains.len());
}

/// Cycles of a tick of `single-stepper`.
const TICK: u32 = 1_250_000;

#[test]
#[ignore = "runs an emulator of the chip"]
fn pulses_end_when_ticks_stop() {
    let (rig, table) = rig_and_table("single-stepper");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let mut run = recorded(rig, table, &by_hand(rig, 3.0), no_defect());
    // During the jog, while the cart moves.
    let moving = run.outputs.iter().position(|output| output.pulses().abs() > 5).unwrap();
    run.truncate(moving + 8);
    assert!(run.outputs.iter().rev().take(8).all(|output| output.pulses().abs() > 5));
    let mut chip = Chip::start(&uf2, table.sensors());
    chip.replay(&run);
    let ([disabled, reset], pulse) = chip.stop_ticks(5 * TICK);
    println!(
        "ticks stopped: last pulse after {pulse} cycles, disabled after {disabled}, reset after {reset}"
    );
    assert!((1..i64::from(TICK)).contains(&pulse) && (TICK..=3 * TICK).contains(&disabled));
    assert!((2 * TICK..=4 * TICK).contains(&reset));
}
