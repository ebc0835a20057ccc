//! Tests of whole ticks of the firmware.

use heapless::spsc::Queue;

use super::control_task::{COMMANDS, ControlTask, MESSAGES};
use super::*;
use crate::board::Board;
use crate::control::actuator::Drive;
use crate::gains::{SENSORS, STATES, TABLE, TICK_S};
use crate::protocol::message::{Answer, Message, Request, Reset};
use crate::supervision::inhibits::Inhibits;
use crate::table::{ReadingMap, SensorKind};

fn firmware<'t>(table: &'t GainTable<STATES, SENSORS>, reset: Reset) -> Firmware<'t, STATES, SENSORS> {
    Firmware::new(table, &NoSwingUp, [CounterWidth::Bits32; SENSORS], reset)
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
        board_fault: false,
    },
};

/// Number of ticks until a fault, and the fault.
fn ticks_to_fault(firmware: &mut Firmware<'_, STATES, SENSORS>) -> Option<(u32, Fault)> {
    (1..2000).find_map(|tick| {
        firmware.control(&INPUTS);
        firmware.finish(None, 0);
        firmware.supervisor.fault().map(|fault| (tick, fault))
    })
}

#[test]
fn a_table_that_changes_in_memory_is_found_within_one_pass() {
    let sound = TABLE;
    let mut damaged = TABLE;
    damaged.sensors[2].sign_counts ^= 1 << 20;
    assert_eq!(firmware(&damaged, Reset::Power).supervisor.fault(), Some(Fault::Table));
    let mut firmware = firmware(&sound, Reset::Power);
    assert_eq!(ticks_to_fault(&mut firmware), None);
    firmware.table = &damaged;
    let (tick, fault) = ticks_to_fault(&mut firmware).unwrap();
    assert_eq!(fault, Fault::Table);
    // One word per tick, after the rest of the pass in progress.
    assert!(tick < 1000, "{tick}");
}

#[test]
fn a_reset_by_the_watchdog_starts_disarmed_and_tells_why() {
    for (reset, fault) in [(Reset::Watchdog, Fault::Watchdog), (Reset::Software, Fault::Crash)] {
        let mut firmware = firmware(&TABLE, reset);
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
fn a_fault_of_motor_or_encoder_puts_the_motors_sign_in_doubt_and_no_other_does() {
    for entry in Fault::ALL {
        let mut firmware = firmware(&TABLE, Reset::Power);
        let sign_counts = TABLE.sensors[0].sign_counts;
        firmware.jog.hold();
        firmware.jog.begin(true, 0);
        assert_eq!(firmware.jog.update(sign_counts, sign_counts, TICK_S), None);
        assert_eq!(firmware.motor_sign(), MotorSign::Checked);
        firmware.trip(entry.fault, None);
        let doubted =
            [Fault::Encoder, Fault::Frozen, Fault::Motor, Fault::Disturbed, Fault::Watchdog, Fault::Crash];
        assert_eq!(firmware.motor_sign() == MotorSign::Unchecked, doubted.contains(&entry.fault));
    }
}

/// The cart's counts while it is pushed from one of these positions to the next.
fn pushed(ends: &[i32]) -> impl Iterator<Item = i32> {
    ends.windows(2).flat_map(|ends| (1..=1000).map(|part| ends[0] + (ends[1] - ends[0]) / 1000 * part))
}

#[test]
fn the_cart_is_homed_between_its_switches() {
    let mut firmware = firmware(&TABLE, Reset::Power);
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
    for cart in pushed(&[0, -90_000, 0]) {
        assert_eq!(step(cart, None).0, State::Homing);
    }
    let mut last = (State::Homing, [0; SENSORS]);
    for cart in pushed(&[0, 110_000, 20_000]).chain([20_000; 600]) {
        last = step(cart, None);
    }
    // The middle was found at 10 000.
    assert_eq!((last.0, last.1[0], last.1[1]), (State::Calibrated, 10_000, 2048));
}

#[test]
fn homing_by_switches_tells_that_a_link_hangs_elsewhere_than_at_its_zero() {
    let homed = |zero_counts: i32| {
        let mut table = TABLE;
        table.sensors[1].kind = SensorKind::Absolute(ReadingMap { bits: 12, zero_counts });
        table.crc = table.checksum();
        let mut firmware = firmware(&table, Reset::Power);
        let command = Command { id: 1, request: Request::HomeRail };
        firmware.control(&INPUTS);
        firmware.finish(Some(&command), 0);
        let travel = table.limits.travel_counts[0];
        for cart in pushed(&[0, travel / 1000 * 1000]).chain([travel; 3]).chain([travel - 1; 1000]) {
            let contacts = Contacts { limit_low: cart < 1000, limit_high: cart == travel, ..INPUTS.contacts };
            let mut raw_counts = [0; SENSORS];
            raw_counts[0] = cart as u32;
            firmware.control(&Inputs { raw_counts, contacts, ..INPUTS });
            firmware.finish(None, 0);
        }
        let told = firmware.calibration.homing();
        let refused = firmware.home(&TABLE.sensors.map(|sensor| sensor.rest_counts));
        firmware.trip(Fault::EmergencyStop, None);
        (told, refused, firmware.home(&TABLE.sensors.map(|sensor| sensor.rest_counts)))
    };
    use crate::supervision::homing::Homing;
    // While homing is forbidden, that is the reason, whatever the zeros.
    let forbidden = Err(Inhibits::FAULT);
    assert_eq!(homed(500), (Homing::OtherZero, Err(Inhibits::OTHER_ZERO), forbidden));
    assert_eq!(homed(3), (Homing::Homed, Ok(()), forbidden));
}

#[test]
fn a_rail_of_another_length_is_not_homed() {
    let mut firmware = firmware(&TABLE, Reset::Power);
    let command = Command { id: 1, request: Request::HomeRail };
    firmware.control(&INPUTS);
    firmware.finish(Some(&command), 0);
    for cart in pushed(&[0, 150_000, 100_000]) {
        let contacts = Contacts { limit_low: cart < 1000, limit_high: cart == 150_000, ..INPUTS.contacts };
        let mut raw_counts = INPUTS.raw_counts;
        raw_counts[0] = cart as u32;
        firmware.control(&Inputs { raw_counts, contacts, ..INPUTS });
        firmware.finish(None, 0);
    }
    assert_eq!(
        (firmware.state(), firmware.calibration.homing()),
        (State::Disarmed, crate::supervision::homing::Homing::WrongTravel)
    );
}

/// Ticks of balancing in [`cause_of`], at the end of a pass of the table's checksum.
const TICKS: u32 = 12;
/// What takes three ticks in a row begins here.
const LAST_THREE: u32 = TICKS - 2;

/// Two tables. The limits of the first one catch only a jump of the first link's encoder and a push of the second link,
/// because they take three measurements in a row. Those of the second one catch each of `faults` that is found with a
/// table.
fn calm_and_strict(faults: &[Fault]) -> [GainTable<STATES, SENSORS>; 2] {
    let due = |fault| faults.contains(&fault);
    let mut calm = TABLE;
    calm.limits.angle_rad = f32::MAX;
    calm.thresholds.innovation = [f32::MAX; SENSORS];
    calm.thresholds.push = [1e30; SENSORS];
    calm.thresholds.motor.energy = f32::MAX;
    if due(Fault::Encoder) {
        calm.thresholds.innovation[1] = 0.1;
    }
    if due(Fault::Disturbed) {
        (calm.thresholds.innovation[2], calm.thresholds.push[2]) = (0.002, 0.002);
    }
    let mut strict = calm;
    let (limits, thresholds) = (&mut strict.limits, &mut strict.thresholds);
    (limits.supply_ticks, limits.link_ticks, limits.saturated_ticks) = (2, TICKS, 0);
    limits.rail_m = if due(Fault::Rail) { [5.0, 6.0] } else { limits.rail_m };
    limits.angle_rad = if due(Fault::Angle) { -1.0 } else { limits.angle_rad };
    limits.speed_m_per_s = if due(Fault::Speed) { -1.0 } else { limits.speed_m_per_s };
    if due(Fault::Frozen) {
        thresholds.innovation[3] = -1.0;
    }
    if due(Fault::Motor) {
        (thresholds.motor.ratio, thresholds.motor.energy) = (f32::MIN, 0.0);
    }
    strict.crc ^= u32::from(due(Fault::Table));
    [calm, strict]
}

/// The cause that is latched when all of `faults` are due in the same tick of balancing, the last of [`TICKS`].
fn cause_of(faults: &[Fault], ticks_of_a_pass: u32) -> Option<Cause> {
    let due = |fault| faults.contains(&fault);
    let [calm, strict] = calm_and_strict(faults);
    let mut firmware = firmware(&TABLE, Reset::Power);
    // If a table fault is due, the pass ends in the last tick. Otherwise it ends later: it would find that the tables
    // differ.
    let sooner = if due(Fault::Table) { 0 } else { 10 };
    for _ in 0..ticks_of_a_pass - TICKS - sooner {
        firmware.control(&INPUTS);
        firmware.finish(None, 0);
    }
    firmware.supervisor.complete_homing().unwrap();
    firmware.supervisor.arm(Inhibits::NONE).unwrap();
    firmware.start_balancing(&[0; SENSORS]);
    // To make the controller request a force that the motor test can find missing.
    firmware.controller.set_setpoint(0.5).unwrap();
    // The missing force of a single tick explains the jump of the cart in the next one, at whose end it is found.
    let mut unmoved = calm;
    unmoved.thresholds.motor.b = [0.0; 2];
    let mut lacking = calm;
    lacking.thresholds.motor = strict.thresholds.motor;
    let mut inputs = INPUTS;
    let show = |inputs: &mut Inputs<SENSORS>, tick: u32| {
        inputs.contacts.overrun = due(Fault::Overrun) && tick >= LAST_THREE;
        inputs.supply_v = if due(Fault::Supply) && tick >= LAST_THREE { -1.0 } else { INPUTS.supply_v };
        let [cart, first, second, ..] = &mut inputs.raw_counts;
        *cart = if due(Fault::Motor) && tick >= TICKS - 1 { 20 } else { 0 };
        *first = if due(Fault::Encoder) && tick >= LAST_THREE { 500 } else { 0 };
        // About 1.5 mrad per tick, which is no jump.
        *second = if due(Fault::Disturbed) { (tick + 2).saturating_sub(LAST_THREE) } else { 0 };
    };
    for tick in 1..TICKS {
        show(&mut inputs, tick);
        firmware.table = if tick < TICKS - 2 { &unmoved } else { &calm };
        firmware.control(&inputs);
        firmware.table = if tick == TICKS - 1 { &lacking } else { firmware.table };
        firmware.finish(None, 0);
        assert_eq!(firmware.state(), State::Balancing, "{:?}", firmware.cause());
    }
    show(&mut inputs, TICKS);
    inputs.contacts.clock_fault = due(Fault::Clock);
    inputs.contacts.board_fault = due(Fault::Board);
    inputs.contacts.emergency_stop = due(Fault::EmergencyStop);
    inputs.contacts.driver_fault = due(Fault::Driver);
    inputs.contacts.limit_high = due(Fault::LimitSwitch);
    inputs.supply_v = if due(Fault::NotFinite) { f32::NAN } else { inputs.supply_v };
    firmware.setpoint_commanded = due(Fault::LinkLost);
    if due(Fault::Saturated) {
        let mut leaning = *firmware.controller.estimate();
        leaning[2] = 0.3;
        firmware.controller.start_in_state(&leaning);
    }
    firmware.table = &strict;
    firmware.control(&inputs);
    firmware.finish(None, 0);
    firmware.cause()
}

#[test]
fn of_several_faults_in_one_tick_the_first_of_the_precedence_is_latched() {
    let mut damaged = TABLE;
    damaged.crc ^= 1;
    let mut other = firmware(&TABLE, Reset::Power);
    other.table = &damaged;
    let (ticks_of_a_pass, _) = ticks_to_fault(&mut other).unwrap();
    // A balancing rig follows no motion.
    let all: std::vec::Vec<Fault> =
        Fault::PRECEDENCE.into_iter().filter(|fault| *fault != Fault::TrackingError).collect();
    for (index, &first) in all.iter().enumerate() {
        let cause = cause_of(&all[index..], ticks_of_a_pass);
        assert_eq!(cause.map(|cause| (cause.fault, cause.tick)), Some((first, ticks_of_a_pass - 1)));
        let alone = cause_of(&[first], ticks_of_a_pass);
        assert_eq!(alone.map(|cause| cause.fault), Some(first), "alone");
    }
    assert_eq!(cause_of(&[], ticks_of_a_pass), None, "nothing is due, nothing is found");
}

/// Whether arming is refused as a held key's command, when `request` has been repeated in every tick since a fault was
/// cleared.
fn is_held_after_repeating(request: Request) -> bool {
    let mut firmware = firmware(&TABLE, Reset::Power);
    let mut id = 0;
    let mut inhibits = |firmware: &mut Firmware<'_, STATES, SENSORS>, request| {
        id += 1;
        firmware.control(&INPUTS);
        let (_, reply) = firmware.finish(Some(&Command { id, request }), 0);
        match reply.map(|reply| reply.answer) {
            Some(Answer::NotNow(inhibits)) => inhibits,
            _ => Inhibits::NONE,
        }
    };
    firmware.trip(Fault::Angle, None);
    inhibits(&mut firmware, request);
    inhibits(&mut firmware, Request::Clear);
    for _ in 0..TABLE.limits.still_ticks + 10 {
        inhibits(&mut firmware, request);
    }
    inhibits(&mut firmware, Request::Arm).contains(Inhibits::HELD)
}

#[test]
fn a_held_key_keeps_the_motor_off_whatever_else_refuses_its_command() {
    assert!(is_held_after_repeating(Request::Arm));
    assert!(is_held_after_repeating(Request::Goto(Equilibrium::UPRIGHT)), "there is no swing-up");
    assert!(!is_held_after_repeating(Request::KeepAlive), "which turns no motor on");
}

/// A board whose timer is set to `tick_s`, and that gives pulses or not.
struct Timed<const PULSES: bool> {
    tick_s: f32,
    output: Output,
}

impl<const PULSES: bool> Board<SENSORS> for Timed<PULSES> {
    const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits32; SENSORS];
    const GIVES_PULSES: bool = PULSES;

    fn tick_s(&self) -> f32 {
        self.tick_s
    }

    fn inputs(&mut self) -> Inputs<SENSORS> {
        INPUTS
    }

    fn drive(&mut self, output: &Output) {
        self.output = *output;
    }

    fn feed_watchdog(&mut self) {}

    fn cycles(&self) -> u32 {
        0
    }
}

#[test]
fn a_damaged_image_never_arms_and_says_so() {
    for is_damaged in [false, true] {
        let mut firmware = firmware(&TABLE, Reset::Power);
        firmware.compare_memory(true, is_damaged);
        firmware.compare_board(TICK_S, false);
        firmware.control(&INPUTS);
        let (_, reply) = firmware.finish(Some(&Command { id: 1, request: Request::Clear }), 0);
        let answer = if is_damaged { Answer::NotNow(Inhibits::TABLE) } else { Answer::Done };
        assert_eq!(reply.map(|reply| reply.answer), Some(answer));
        assert_eq!(firmware.supervisor.fault(), is_damaged.then_some(Fault::Image));
    }
}

/// The latched fault after Clear, and the tick that the firmware reports, on a board with this tick.
fn on_a_board_with(tick_s: f32) -> (Option<Fault>, f32) {
    on_board::<false>(&TABLE, tick_s)
}

fn on_board<const PULSES: bool>(table: &GainTable<STATES, SENSORS>, tick_s: f32) -> (Option<Fault>, f32) {
    let (mut commands, mut messages) = (Queue::<_, COMMANDS>::new(), Queue::<_, MESSAGES>::new());
    let ((mut to_task, commands), (messages, mut from_task)) = (commands.split(), messages.split());
    let board = Timed::<PULSES> { tick_s, output: Output::OFF };
    let mut task = ControlTask::new(firmware(table, Reset::Power), board, commands, messages);
    for (id, request) in [(1, Request::Clear), (2, Request::Info)] {
        to_task.enqueue(Command { id, request }).unwrap();
        task.tick();
    }
    let tick_s = core::iter::from_fn(|| from_task.dequeue()).find_map(|message| match message {
        Message::Reply(Reply { answer: Answer::Info(info), .. }) => Some(info.tick_s),
        _ => None,
    });
    (task.firmware().supervisor.fault(), tick_s.unwrap())
}

#[test]
fn a_timer_with_another_tick_than_the_tables_keeps_the_motor_off_and_is_reported() {
    assert_eq!(on_a_board_with(TICK_S), (None, TICK_S));
    assert_eq!(on_a_board_with(TICK_S * 1.0005), (None, TICK_S), "whole cycles");
    assert_eq!(on_a_board_with(2.0 * TICK_S), (Some(Fault::Table), 2.0 * TICK_S));
    assert_eq!(on_a_board_with(f32::NAN).0, Some(Fault::Table));
}

#[test]
fn a_drive_with_pulses_stays_off_on_a_board_that_gives_none() {
    let map = crate::table::StepMap {
        step_m: 1e-5,
        acceleration_limit_m_per_s2: 10.0,
        speed_limit_m_per_s: 0.5,
        ..crate::table::StepMap::ideal(TICK_S)
    };
    let mut table = GainTable { drive: crate::table::DriveMap::Pulses(map), ..TABLE };
    table.crc = table.checksum();
    assert_eq!(table.check(), Ok(()));
    assert_eq!(on_board::<false>(&table, TICK_S).0, Some(Fault::Table));
    assert_eq!(on_board::<true>(&table, TICK_S).0, None);
}

#[test]
fn the_output_carries_the_duty_that_a_board_sets() {
    assert_eq!((Output::OFF.enable, Output::OFF.duty), (false, 0.0));
    let output = Output::on(Drive::Force(-5.0), &TABLE.drive);
    assert_eq!((output.enable, output.duty), (true, -0.25));
    assert_eq!(Output::on(Drive::Duty(0.5), &TABLE.drive).duty, 0.5);
}
