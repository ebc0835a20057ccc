//! A bit of memory that nobody writes changes: the background task of the flashed image finds it.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright::protocol::message::{Answer, Reply, Request};
use upright_board::{Conditions, Image, Input};
use upright_design::conversation::words;
use upright_tool::in_the_loop::RULES;

use crate::powered::{Powered, image};

/// The time until the table is found to have changed, and the watchdog's longest time after it.
const TABLE_S: f64 = 0.02;
/// Two passes over the image, and the watchdog.
const IMAGE_S: f64 = 0.9;

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
    // Negative control: the table has changed in flash, too, so that nothing differs.
    let flash = image.symbol("__sidata").unwrap() + table.start - image.symbol("__sdata").unwrap();
    assert!(!restarts(&run, &[(table.start + 5, 3), (flash + 5, 3)], TABLE_S));
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

#[test]
fn every_bit_of_the_image_is_read_within_a_second() {
    let Some(image) = image() else { return };
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
