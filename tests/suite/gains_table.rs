//! `src/gains.rs` is what the tool writes for its rig, and what the firmware accepts.

use crate::bench::{rig_of_the_firmware, table};
use crate::gains::{RIG, RIG_HASH, SENSORS, STATES, TABLE, TICK_S, TOOL_VERSION};
use upright::control::controller::Controller;
use upright::control::encoder::CounterWidth;
use upright::table::TableError;
use upright_design::rig::Rig;
use upright_design::table::gains_source;

const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits32; SENSORS];

/// The first difference: line number and contents.
fn difference(found: &str, wanted: &str) -> Option<String> {
    if found == wanted {
        return None;
    }
    let lines = found.lines().zip(wanted.lines()).enumerate();
    let differing = lines.filter(|(_, (found, wanted))| found != wanted).map(|(line, (found, wanted))| {
        format!("src/gains.rs:{}: found\n{found}\nbut the tool writes\n{wanted}", line + 1)
    });
    differing.take(1).next().or(Some("src/gains.rs: another number of lines".to_owned()))
}

fn committed() -> String {
    std::fs::read_to_string(upright_test_support::repository().join("src/gains.rs")).unwrap()
}

fn written(rig: &Rig) -> String {
    gains_source(rig, &table(rig))
}

#[test]
fn the_committed_table_is_what_the_tool_writes_for_its_rig() {
    if let Some(difference) = difference(&committed(), &written(&rig_of_the_firmware())) {
        panic!("{difference}\nrun `cargo upright design` with the rig file of {RIG:?} again");
    }
}

#[test]
fn any_changed_value_of_the_rig_changes_the_table() {
    let rig = rig_of_the_firmware();
    let committed = committed();
    let other = |change: &dyn Fn(&mut Rig)| {
        let mut rig = rig.clone();
        change(&mut rig);
        difference(&committed, &written(&rig))
    };
    assert_eq!(other(&|_| ()), None);
    assert!(other(&|rig| rig.tick.period_s *= 1.001).is_some());
    assert!(other(&|rig| rig.name.push('2')).is_some());
    // Limits affect no gain, but a controller and a host must agree about them too: the hash changes.
    let hash = other(&|rig| rig.limits.angle_rad = Some(0.123)).unwrap();
    assert!(hash.contains("RIG_HASH"), "{hash}");
}

#[test]
fn a_changed_byte_of_the_file_is_noticed() {
    let good = committed();
    for at in [0, good.len() / 3, good.len() - 2] {
        let mut bytes = good.clone().into_bytes();
        bytes[at] ^= 1;
        assert!(difference(std::str::from_utf8(&bytes).unwrap(), &good).is_some());
    }
    assert!(difference(&format!("{good}\n"), &good).is_some());
    assert!(difference(good.trim_end(), &good).is_some());
}

#[test]
fn the_firmware_accepts_the_committed_table() {
    assert!(Controller::new(&TABLE, WIDTHS).is_ok());
}

#[test]
fn a_flipped_bit_of_any_committed_gain_is_refused() {
    for entry in 0..STATES {
        for bit in 0..32 {
            let mut damaged = TABLE;
            for law in damaged.laws.present_mut() {
                law.k[entry] = f32::from_bits(law.k[entry].to_bits() ^ 1 << bit);
            }
            assert_eq!(Controller::new(&damaged, WIDTHS).err(), Some(TableError::Crc));
        }
    }
}

#[test]
fn the_committed_constants_are_those_of_the_rig() {
    let rig = rig_of_the_firmware();
    assert_eq!(RIG, rig.name);
    assert_eq!((RIG_HASH, STATES), (rig.hash(), rig.states()));
    assert_eq!(TICK_S, rig.tick.period_s as f32);
    assert_eq!(TOOL_VERSION, env!("CARGO_PKG_VERSION"));
    assert_eq!(TABLE, table(&rig).table::<STATES, SENSORS>());
}
