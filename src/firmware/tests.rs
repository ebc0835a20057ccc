//! Tests of whole ticks of the firmware.

use super::*;
use crate::gains::{RIG_HASH, SENSORS, STATES, TABLE, TICK_S};
use crate::protocol::message::{Answer, Request};
use crate::supervision::inhibits::Inhibits;

const BUILD: Build = Build { rig_hash: RIG_HASH, tick_s: TICK_S };

fn firmware<'t>(
    table: &'t GainTable<STATES, SENSORS>,
    reset: Reset,
) -> Result<Firmware<'t, STATES, SENSORS>, TableError> {
    Firmware::new(table, &BUILD, [CounterWidth::Bits32; SENSORS], reset)
}

const INPUTS: Inputs<SENSORS> = Inputs {
    raw_counts: [0; SENSORS],
    supply_v: 12.0,
    contacts: Contacts {
        limit_low: false,
        limit_high: false,
        emergency_stop: false,
        driver_fault: false,
        overrun: false,
        clock_fault: false,
    },
};

/// Ticks until a fault.
fn ticks_to_fault(firmware: &mut Firmware<'_, STATES, SENSORS>) -> Option<(u32, Fault)> {
    (1..2000).find_map(|tick| {
        firmware.control(&INPUTS);
        firmware.finish(None, 0);
        firmware.supervisor.fault().map(|fault| (tick, fault))
    })
}

#[test]
fn a_table_that_changes_in_memory_is_found_within_one_pass() {
    let sound = TABLE.clone();
    let mut damaged = TABLE.clone();
    damaged.limits.sign_counts[2] ^= 1 << 20;
    assert_eq!(firmware(&damaged, Reset::Power).err(), Some(TableError::Crc));
    let mut firmware = firmware(&sound, Reset::Power).unwrap();
    assert_eq!(ticks_to_fault(&mut firmware), None);
    firmware.table = &damaged;
    let (tick, fault) = ticks_to_fault(&mut firmware).unwrap();
    assert_eq!(fault, Fault::Table);
    // One word a tick, and what was left of the pass before.
    assert!(tick < 1000, "{tick}");
}

#[test]
fn a_reset_by_the_watchdog_starts_disarmed_and_tells_why() {
    for (reset, fault) in [(Reset::Watchdog, Fault::Watchdog), (Reset::Software, Fault::Crash)] {
        let mut firmware = firmware(&TABLE, reset).unwrap();
        assert_eq!(firmware.control(&INPUTS), Output::OFF);
        assert_eq!(
            (firmware.state(), firmware.cause().map(|cause| cause.fault)),
            (State::Disarmed, Some(fault))
        );
        let request = Command { id: 1, request: Request::Arm };
        let (_, reply) = firmware.finish(Some(&request), 0);
        assert_eq!((firmware.state(), firmware.supervisor.fault()), (State::Disarmed, None));
        let Some(Reply { answer: Answer::NotNow(inhibits), .. }) = reply else { panic!("{reply:?}") };
        assert!(inhibits.contains(Inhibits::NOT_HOMED.union(Inhibits::SIGNS)));
    }
}

#[test]
fn the_cart_is_homed_between_its_switches() {
    let mut firmware = firmware(&TABLE, Reset::Power).unwrap();
    let mut step = |cart: i32, request: Option<Request>| {
        let contacts =
            Contacts { limit_low: cart <= -90_000, limit_high: cart >= 110_000, ..INPUTS.contacts };
        let mut raw_counts = INPUTS.raw_counts;
        raw_counts[0] = cart as u32;
        firmware.control(&Inputs { raw_counts, contacts, ..INPUTS });
        let command = request.map(|request| Command { id: 1, request });
        firmware.finish(command.as_ref(), 0);
        (firmware.state(), *firmware.controller.encoders().counts())
    };
    step(0, Some(Request::HomeRail));
    for cart in [0, -90_000, 0] {
        assert_eq!(step(cart, None).0, State::Homing);
    }
    let mut last = step(110_000, None);
    for _ in 0..600 {
        last = step(20_000, None);
    }
    // The middle was found at 10 000.
    assert_eq!((last.0, last.1[0], last.1[1]), (State::Calibrated, 10_000, 2048));
}

#[test]
fn a_rail_of_another_length_is_not_homed() {
    let mut firmware = firmware(&TABLE, Reset::Power).unwrap();
    let command = Command { id: 1, request: Request::HomeRail };
    firmware.control(&INPUTS);
    firmware.finish(Some(&command), 0);
    for (cart, limit_low, limit_high) in [(0, true, false), (150_000, false, true), (100_000, false, false)] {
        let contacts = Contacts { limit_low, limit_high, ..INPUTS.contacts };
        let mut raw_counts = INPUTS.raw_counts;
        raw_counts[0] = cart;
        firmware.control(&Inputs { raw_counts, contacts, ..INPUTS });
        firmware.finish(None, 0);
    }
    assert_eq!(
        (firmware.state(), firmware.calibration.homing()),
        (State::Disarmed, crate::supervision::homing::Homing::WrongTravel)
    );
}
