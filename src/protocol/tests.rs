//! The bytes on the line, of a frame of each kind: what is sent must not change unnoticed with the serializer or with a
//! type. A change on purpose raises [`PROTOCOL`].

use std::borrow::ToOwned;
use std::format;
use std::string::String;
use std::vec::Vec;

use super::message::*;
use super::tick_log::{LoggedTick, OFF, TickLog};
use super::*;
use crate::board::{Contacts, Output};
use crate::control::actuator::Drive;
use crate::control::controller::Rejected;
use crate::supervision::fault::{Cause, Fault};
use crate::supervision::homing::Homing;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::jog::MotorSign;
use crate::supervision::shaking::{FORCES, Shaking};
use crate::supervision::sign_check::Signs;
use crate::supervision::supervisor::State;
use crate::table::{Equilibrium, Law};

const GOLDEN: &str = include_str!("frames.txt");

fn frame(message: &impl serde::Serialize) -> String {
    let (mut scratch, mut out) = ([0; 512], [0; 512]);
    let bytes = frame::encode(message, &mut scratch, &mut out).unwrap();
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn requests() -> Vec<Request> {
    let shaking = Shaking { largest_input: 2.5, stiffness: 30.0, damping: 4.0 };
    let mut forces = [0; FORCES];
    (forces[0], forces[FORCES - 1]) = (1, -1);
    std::vec![
        Request::KeepAlive,
        Request::Home,
        Request::HomeRail,
        Request::CheckSigns,
        Request::Arm,
        Request::Disarm,
        Request::Clear,
        Request::Setpoint(0.25),
        Request::Select(Law::PolePlacement),
        Request::Info,
        Request::Cause,
        Request::Crash,
        Request::Statistics,
        Request::ResetStatistics,
        Request::Telemetry(300),
        Request::Goto(Equilibrium::HANGING),
        Request::Jog { along: true },
        Request::Shake(shaking),
        Request::Forces { first: 513, forces },
        Request::Log(true),
        Request::Still,
    ]
}

fn answers() -> Vec<Answer> {
    let info = Info {
        protocol: PROTOCOL,
        version: [1, 2, 3],
        rig_hash: 0x0123_4567_89ab_cdef,
        tick_s: 0.001,
        states: 4,
        sensors: 2,
        reset: Reset::Watchdog,
        image: 0xdead_beef,
    };
    let cause = Cause { fault: Fault::Watchdog, tick: 70_000, sensor: Some(1) };
    let statistics =
        Statistics { ticks: 1, overruns: 2, rejected_samples: 3, dropped: 4, malformed: 5, replayed: 300 };
    std::vec![
        Answer::Done,
        Answer::NotNow(Inhibits::NOT_HOMED),
        Answer::Rejected(InvalidRequest::Controller(Rejected::Setpoint)),
        Answer::Info(info),
        Answer::Cause(Some(cause)),
        Answer::Crash(Some(CrashRecord([1, 2, 3, 4, 0x0800_1234]))),
        Answer::Statistics(statistics),
    ]
}

fn telemetry() -> Telemetry<4, 2> {
    Telemetry {
        tick: 1_000,
        state: State::Balancing,
        law: Law::Lqr,
        fault: Some(Fault::Watchdog),
        cause_tick: 999,
        homing: Homing::Homed,
        signs: Signs::Checked,
        motor: MotorSign::Checked,
        arming_inhibits: Inhibits::TILTED,
        swing_up_inhibits: Inhibits::NOT_HOMED,
        motion_tick: 128,
        contacts: Contacts { driver_fault: true, ..Contacts::default() },
        supply_v: 12.5,
        counts: [-1, 2048].into_iter().collect(),
        estimate: [0.5, -0.25, 1e-3, 0.0].into_iter().collect(),
        innovation: [1e-4, -1e-4].into_iter().collect(),
        setpoint_m: 0.1,
        requested_n: 3.5,
        applied_n: 3.0,
        drive: -0.5,
        cycles: 2_355,
        worst_cycles: 13_457,
    }
}

/// One line for each kind of message: its name and its frame.
fn lines() -> String {
    let log = TickLog::<2> {
        first: 1_000,
        contacts: 5,
        supply_mv: 12_500,
        ticks: [
            LoggedTick::new(&[-1, 2048], &Output::on(Drive::Duty(-0.5), &crate::gains::TABLE.drive)),
            LoggedTick { drive: OFF.to_le_bytes(), ..LoggedTick::new(&[0, 0], &Output::OFF) },
        ]
        .into_iter()
        .collect(),
    };
    let name = |message: &dyn core::fmt::Debug| {
        let text = format!("{message:?}");
        text.split(['(', ' ']).next().unwrap_or_default().to_owned()
    };
    let mut lines: Vec<_> = requests()
        .into_iter()
        .map(|request| format!("request {} {}", name(&request), frame(&Command { id: 300, request })))
        .collect();
    let reply = |answer| frame(&Message::<4, 2>::Reply(Reply { id: 300, answer }));
    lines.extend(answers().into_iter().map(|answer| format!("answer {} {}", name(&answer), reply(answer))));
    lines.push(format!("telemetry {}", frame(&Message::Telemetry(telemetry()))));
    lines.push(format!("log {}", frame(&Message::<4, 2>::Log(log))));
    lines.join("\n") + "\n"
}

#[test]
fn a_frame_of_each_kind_has_the_bytes_that_hosts_and_firmwares_of_this_version_exchange() {
    for (found, golden) in lines().lines().zip(GOLDEN.lines()) {
        assert_eq!(
            found,
            golden,
            "raise PROTOCOL if this is on purpose; src/protocol/frames.txt:\n{}",
            lines()
        );
    }
    assert_eq!(lines().lines().count(), GOLDEN.lines().count(), "{}", lines());
    assert!(GOLDEN.lines().count() == requests().len() + answers().len() + 2);
}

#[test]
fn the_golden_frames_leave_out_no_kind() {
    // The number of a kind follows the id; all other fields are 0.
    let is_known = |number: usize| postcard::from_bytes::<Command>(&after(&[1], number)).is_ok();
    assert!((0..requests().len()).all(is_known) && !is_known(requests().len()));
    let is_known = |number: usize| postcard::from_bytes::<Reply>(&after(&[1], number)).is_ok();
    assert!((0..answers().len()).all(is_known) && !is_known(answers().len()));
    let is_known = |number: usize| postcard::from_bytes::<Message<4, 2>>(&after(&[], number)).is_ok();
    assert!((0..3).all(is_known) && !is_known(3));
}

fn after(begin: &[u8], number: usize) -> Vec<u8> {
    [begin, &[number as u8], &[0; 400]].concat()
}

#[test]
fn the_longest_telemetry_fits_on_the_line_at_every_tick() {
    for microseconds in 119..20_000 {
        let tick_s = microseconds as f32 * 1e-6;
        let ticks = telemetry_ticks(tick_s);
        let bits_per_s = 10.0 * serial_link::MAX_MESSAGE as f32 / (f32::from(ticks) * tick_s);
        assert!(bits_per_s < BAUD as f32, "{tick_s} s, {ticks} ticks: {bits_per_s} Bd");
        // Negative control: at every tenth tick it does not fit if the tick is short.
        let at_tenth = serial_link::MAX_MESSAGE as f32 / tick_s;
        assert_eq!(at_tenth > BAUD as f32, microseconds < 738);
    }
    assert_eq!([0.000_5, 0.001, 0.002, 0.005, 0.02].map(telemetry_ticks), [20, 10, 5, 2, 2]);
}
