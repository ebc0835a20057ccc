//! Counters that jump while the controller does not run.

use super::*;

/// Seven and a half turns of the first link, after which an ESP32's pulse counter is cleared.
const CLEARED: u32 = (TABLE.limits.turn_counts[1] / 2 * 15) as u32;

/// A tick in which the first link's counter has moved by `moved` from hanging.
fn tick(firmware: &mut Firmware<'_, STATES, SENSORS>, moved: u32, request: Option<Request>) {
    let mut inputs = INPUTS;
    inputs.raw_counts[1] = moved;
    firmware.control(&inputs);
    let command = request.map(|request| Command { id: 1, request });
    firmware.finish(command.as_ref(), 0);
}

/// The firmware, homed with its links hanging, after a while.
fn homed() -> Firmware<'static, STATES, SENSORS> {
    let mut firmware = firmware(&TABLE, Reset::Power);
    tick(&mut firmware, 0, None);
    firmware.home(&TABLE.limits.rest_counts).unwrap();
    for _ in 0..TABLE.limits.arm_ticks {
        tick(&mut firmware, 0, None);
    }
    firmware
}

fn first_link(firmware: &Firmware<'_, STATES, SENSORS>) -> i32 {
    firmware.controller.encoders().counts()[1]
}

#[test]
fn a_counter_that_is_cleared_while_the_links_hang_is_a_fault_and_never_turns_the_motor_on() {
    let mut firmware = homed();
    let rest = TABLE.limits.rest_counts[1];
    for _ in 0..2 {
        tick(&mut firmware, CLEARED, None);
        assert_eq!((firmware.state(), first_link(&firmware)), (State::Calibrated, rest));
        assert!(firmware.arming_inhibits().contains(Inhibits::TILTED.union(Inhibits::MOVING)));
    }
    tick(&mut firmware, CLEARED, None);
    let cause = firmware.cause().map(|cause| (cause.fault, cause.sensor));
    assert_eq!((firmware.state(), cause), (State::Fault, Some((Fault::Encoder, Some(1)))));
    assert_eq!(firmware.statistics().rejected_samples, 3);
    // The rig has to be homed again.
    tick(&mut firmware, CLEARED, Some(Request::Clear));
    assert_eq!(firmware.state(), State::Disarmed);
    tick(&mut firmware, 0, None);
    assert_eq!(firmware.state(), State::Disarmed);
}

#[test]
fn an_armed_rig_does_not_start_in_the_tick_of_a_jump_and_a_single_one_is_rejected() {
    let mut firmware = homed();
    // Upright for a while, armed with the whole table checked.
    let position = [0; SENSORS];
    firmware.controller.encoders_mut().home(&INPUTS.raw_counts, &position);
    firmware.supervisor.arm(Inhibits::NONE).unwrap();
    firmware.calibration.restart_slow(&position);
    firmware.is_checked = true;
    for _ in 0..TABLE.limits.arm_ticks - 1 {
        tick(&mut firmware, 0, None);
    }
    tick(&mut firmware, CLEARED, None);
    assert_eq!((firmware.state(), first_link(&firmware)), (State::Armed, 0));
    for _ in 0..TABLE.limits.arm_ticks - 1 {
        tick(&mut firmware, 0, None);
        assert_eq!((firmware.state(), first_link(&firmware)), (State::Armed, 0));
    }
    tick(&mut firmware, 0, None);
    assert_eq!((firmware.state(), firmware.statistics().rejected_samples), (State::Balancing, 1));
}

#[test]
fn a_counter_that_jumps_behind_another_fault_or_while_homing_loses_the_positions() {
    let mut firmware = homed();
    firmware.trip(Fault::EmergencyStop, None);
    (0..3).for_each(|_| tick(&mut firmware, CLEARED, None));
    assert_eq!(firmware.cause().map(|cause| cause.fault), Some(Fault::EmergencyStop), "the first cause");
    tick(&mut firmware, CLEARED, Some(Request::Clear));
    assert_eq!(firmware.state(), State::Disarmed);

    let mut firmware = homed();
    tick(&mut firmware, 0, Some(Request::HomeRail));
    assert_eq!(firmware.state(), State::Homing);
    (0..3).for_each(|_| tick(&mut firmware, CLEARED, None));
    assert_eq!(firmware.cause().map(|cause| cause.fault), Some(Fault::Encoder));
    // Before anything is homed, a counter may read what it likes.
    let mut firmware = super::firmware(&TABLE, Reset::Power);
    (0..9).for_each(|number| tick(&mut firmware, number * CLEARED, None));
    assert_eq!((firmware.state(), firmware.cause()), (State::Disarmed, None));
}
