//! A bit of memory that nobody writes changes: the background task of the flashed image finds it.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright::boards::DEFAULT_BOARD;
use upright::flash_image::REFERENCE;
use upright::protocol::message::{Answer, Reply, Request};
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;
use upright_board::{Conditions, Image, Input};
use upright_closed_loop::conversation::words;
use upright_tool::in_the_loop::RULES;

use crate::equipment::built_for;
use crate::powered::{Powered, image};
use crate::published::rig_and_table_with_motions;

/// The time until the table is found to have changed, and the watchdog's longest time after it.
const TABLE_S: f64 = 0.02;
/// Two passes over the image, and the watchdog.
const IMAGE_S: f64 = 0.25;

/// The image between two ticks, motor off.
fn running(image: &Image) -> Powered {
    let mut run = Powered::with(image, &Conditions::f405(1), RULES);
    run.run(0.055);
    run
}

/// Whether the image has stopped itself, and the watchdog has reset the chip, `time_s` after these bits flip.
fn restarts(run: &Powered, flips: &[(u32, u8)], time_s: f64) -> bool {
    let mut board = run.board.clone();
    flips.iter().for_each(|&(address, bit)| board.apply(Input::FlipBit { address, bit }));
    // An instruction that has changed may do what the hardware does not allow, which ends the run, too.
    let end = board.run_until(board.now() + upright_board::seconds(time_s));
    end.is_err() || board.resets() > 0
}

#[test]
fn every_bit_of_the_gain_table_is_compared_within_a_hundredth_of_a_second() {
    let Some(image) = image() else { return };
    let run = running(&image);
    let table = image.object("local_init_table").unwrap();
    let mut random = Pcg64::seed_from_u64(1);
    for _ in 0..500 {
        let flip = (random.random_range(table.clone()), random.random_range(0..8));
        assert!(restarts(&run, &[flip], TABLE_S), "{flip:x?}");
    }
    // Negative control: the copy of the table has changed, too, so that nothing differs.
    let copy = image.object("local_init_copy").unwrap();
    assert!(!restarts(&run, &[(table.start + 5, 3), (copy.start + 5, 3)], TABLE_S));
}

#[test]
fn the_record_of_the_crash_names_the_word_that_has_changed() {
    let Some(image) = image() else { return };
    let mut run = running(&image);
    let address = image.object("local_init_table").unwrap().start + 8;
    run.board.apply(Input::FlipBit { address: address + 1, bit: 4 });
    run.run(0.2);
    run.ask(1, Request::Crash);
    run.run(0.25);
    let [Reply { answer: Answer::Crash(Some(record)), .. }] = run.replies[..] else {
        panic!("{:?}", run.replies)
    };
    assert!(
        words::crash(&record).starts_with(&format!("memory has changed at {address:#010x}")),
        "{record:?}"
    );
}

/// The image with stored motions, which are half of it.
fn image_with_motions() -> Option<Image> {
    let (rig, table) = rig_and_table_with_motions("quadruple-paper");
    let elf = built_for(DEFAULT_BOARD, rig, table)?;
    Some(Image::from_elf(&std::fs::read(elf).unwrap()).unwrap())
}

/// Functions of the tick, by parts of their mangled names.
const OF_THE_TICK: [&str; 4] = ["hot_path3act", "hot_path7predict", "SysTick", "12test_sensors"];

#[test]
fn every_bit_of_the_image_is_read_within_a_quarter_of_a_second() {
    let Some(image) = image_with_motions() else { return };
    let (run, begin) = (running(&image), 0x0800_0000);
    let end = begin + image.end() as u32;
    let mut random = Pcg64::seed_from_u64(2);
    for _ in 0..16 {
        let flip = (random.random_range(begin..end), random.random_range(0..8));
        assert!(restarts(&run, &[flip], IMAGE_S), "{flip:x?}");
    }
    // Negative control: behind the image.
    assert!(!restarts(&run, &[(end + 4, 0)], IMAGE_S));
}

/// The constants of a function that the tick does not reach with the motor off change at any time of a pass: also when
/// they have just been read, and wait for the next pass.
#[test]
fn the_code_of_the_tick_is_read_within_a_quarter_of_a_second_from_any_time_on() {
    let Some(image) = image_with_motions() else { return };
    let mut run = running(&image);
    let act = image.object("hot_path3act").unwrap();
    for part in 0..13 {
        run.run(0.055 + 0.008 * f64::from(part));
        assert!(restarts(&run, &[(act.end - 2, 0)], IMAGE_S), "{part}");
    }
}

/// State and fault, if the image reports any, and whether the power stage was ever enabled, after a start and an
/// attempt to clear the fault.
fn started(image: &Image) -> (Option<(State, Option<Fault>)>, bool) {
    let mut run = Powered::with(image, &Conditions::f405(1), RULES);
    run.run(0.06);
    run.ask(1, Request::Clear);
    run.run(0.12);
    let last = run.telemetry.last().map(|telemetry| (telemetry.state, telemetry.fault));
    (last, run.board.driven().enabled > 0)
}

#[test]
fn code_that_is_damaged_before_power_comes_never_arms() {
    let Some(image) = image() else { return };
    let (begin, flash) = (0x0800_0000, image.flash());
    let with_a_flip = |address: u32, bit: u8| {
        let byte = flash[(address - begin) as usize] ^ 1 << bit;
        image.clone().with_bytes(address, vec![byte])
    };
    let mut random = Pcg64::seed_from_u64(3);
    let is_damaged = Some((State::Fault, Some(Fault::Image)));
    for name in OF_THE_TICK {
        let function = image.object(name).unwrap_or_else(|| panic!("no function {name}"));
        let flip = (random.random_range(function), random.random_range(0..8));
        let (reported, was_enabled) = started(&with_a_flip(flip.0, flip.1));
        assert!(!was_enabled, "{name} {flip:x?}");
        // Where it is damaged in what runs with the motor off, it may reset for ever without a word.
        assert!(
            reported == is_damaged || (name == "SysTick" && reported.is_none()),
            "{name} {flip:x?} {reported:?}"
        );
    }
    // An image that the tool has not finished.
    let reference = begin + 4 * REFERENCE.start as u32;
    let bare = image.clone().with_bytes(reference, vec![0; 8]);
    assert_eq!(started(&bare), (is_damaged, false));
    // Negative controls: nothing is damaged, or only what is behind the image.
    let is_sound = (Some((State::Disarmed, None)), false);
    assert_eq!(started(&image), is_sound);
    assert_eq!(started(&image.clone().with_bytes(begin + flash.len() as u32, vec![0])), is_sound);
}
