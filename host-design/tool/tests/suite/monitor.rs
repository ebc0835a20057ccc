//! The monitor: what it shows, what its keys do, and the whole path to a firmware and back.

use std::io::Write;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use heapless::Vec as List;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use serde::Serialize;
use serde_json::Value;
use upright::board::Contacts;
use upright::protocol::frame::{self, Receiver};
use upright::protocol::message::{
    Answer, Command as Asked, CrashRecord, Info, Message, PROTOCOL, Reply, Request, Reset, Telemetry,
};
use upright::protocol::serial_link::{MAX_COMMAND, MAX_MESSAGE};
use upright::supervision::fault::Fault;
use upright::supervision::homing::Homing;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright::table::{Equilibrium, Law};
use upright_closed_loop::client::{ExpectedRig, Mismatch};
use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::{Gains, TableValues};
use upright_test_support::limits::{PATIENCE, joined, output_of};
use upright_tool::in_the_loop::{RunPlace, serve};
use upright_tool::monitor::{Ended, Monitor, action, view};

const NOW: Duration = Duration::from_secs(1_800_000_000);

fn framed(message: &impl Serialize) -> Vec<u8> {
    frame::encode(message, &mut [0; MAX_MESSAGE], &mut [0; MAX_MESSAGE]).unwrap().to_vec()
}

fn telemetry(tick: u32, state: State, fault: Option<Fault>) -> Telemetry<10, 5> {
    Telemetry {
        tick,
        state,
        law: Law::Lqr,
        fault,
        cause_tick: 7,
        homing: Homing::Homed,
        signs: Signs::Checked,
        motor: MotorSign::Checked,
        arming_inhibits: if fault.is_some() { Inhibits::FAULT } else { Inhibits::NONE },
        swing_up_inhibits: Inhibits::NO_SWING_UP,
        motion_tick: 0,
        contacts: Contacts::default(),
        supply_v: 23.9,
        counts: List::from_slice(&[1, -2, 3, -4, 5]).unwrap(),
        estimate: List::from_slice(&[0.125, 0.0, 0.01, 0.0, 0.02, 0.0, -0.01, 0.0, 0.005, -0.5]).unwrap(),
        innovation: List::from_slice(&[0.0; 5]).unwrap(),
        setpoint_m: 0.05,
        requested_n: 3.5,
        applied_n: 3.25,
        drive: 0.5,
        cycles: 1234,
        worst_cycles: 2345,
    }
}

fn told(monitor: &mut Monitor, telemetry: Telemetry<10, 5>) -> usize {
    monitor.receive(&framed(&Message::Telemetry(telemetry)), NOW).len()
}

/// The commands that the monitor wants to send.
fn asked(monitor: &mut Monitor) -> Vec<Asked> {
    let mut receiver = Receiver::<MAX_COMMAND>::new();
    let bytes = monitor.take_outgoing();
    bytes.into_iter().filter_map(|byte| receiver.push(byte)).map(Result::unwrap).collect()
}

fn answer(monitor: &mut Monitor, id: u64, answer: Answer) {
    monitor.receive(&framed(&Message::<10, 5>::Reply(Reply { id, answer })), NOW);
}

fn met(protocol: u8) -> Monitor {
    let mut monitor = Monitor::new("tcp:here");
    monitor.poll(NOW);
    let first = asked(&mut monitor);
    assert!(matches!(first[..], [Asked { request: Request::Info, .. }]));
    let info = Info {
        protocol,
        version: [1, 2, 3],
        rig_hash: 0xabcd,
        tick_s: 0.001,
        states: 10,
        sensors: 5,
        reset: Reset::Power,
        image: 0x1234_abcd,
    };
    answer(&mut monitor, first[0].id, Answer::Info(info));
    monitor
}

fn screen(monitor: &Monitor) -> String {
    let mut terminal = Terminal::new(TestBackend::new(110, 36)).unwrap();
    terminal.draw(|frame| view::draw(monitor, frame)).unwrap();
    let buffer = terminal.backend().buffer();
    let rows = buffer.content().chunks(110);
    rows.map(|row| row.iter().map(|cell| cell.symbol()).collect::<String>() + "\n").collect()
}

/// Answers every request, until none is left.
fn answer_all(monitor: &mut Monitor) {
    loop {
        let all = asked(monitor);
        if all.is_empty() {
            return;
        }
        all.iter().for_each(|command| answer(monitor, command.id, Answer::Done));
    }
}

/// The requests that a key sends, all of which are answered.
fn press(monitor: &mut Monitor, code: KeyCode) -> Vec<Request> {
    answer_all(monitor);
    monitor.act(action(&KeyEvent::new(code, KeyModifiers::NONE)).unwrap(), NOW);
    let said = asked(monitor);
    said.iter().for_each(|command| answer(monitor, command.id, Answer::Done));
    said.into_iter().map(|command| command.request).collect()
}

#[test]
fn a_held_key_sends_the_jog_again_and_tells_a_refusal_once() {
    let mut monitor = met(PROTOCOL);
    told(&mut monitor, telemetry(1, State::Calibrated, None));
    answer_all(&mut monitor);
    let before = monitor.log.len();
    assert_eq!(press(&mut monitor, KeyCode::Char('m')), [Request::Jog { along: true }]);
    assert_eq!(press(&mut monitor, KeyCode::Char('M')), [Request::Jog { along: false }]);
    assert_eq!(monitor.log.len(), before, "{:?}", monitor.log);
    // It is not repeated by itself: a key that is let go sends nothing.
    monitor.poll(NOW + Duration::from_millis(100));
    assert!(asked(&mut monitor).iter().all(|command| !matches!(command.request, Request::Jog { .. })));
    answer_all(&mut monitor);
    for reasons in [Inhibits::SIGNS, Inhibits::SIGNS.union(Inhibits::HELD), Inhibits::HELD] {
        answer_all(&mut monitor);
        monitor.act(action(&KeyEvent::new(KeyCode::Char('m'), KeyModifiers::NONE)).unwrap(), NOW);
        let id = asked(&mut monitor).last().unwrap().id;
        answer(&mut monitor, id, Answer::NotNow(reasons));
    }
    let refused = monitor.log.iter().filter(|line| line.contains("jog along +x: refused")).count();
    assert_eq!(refused, 1, "{:?}", monitor.log);
    for (motor, what) in [(MotorSign::Reversed, "wrong way"), (MotorSign::Still, "not moved the cart")] {
        told(&mut monitor, Telemetry { motor, ..telemetry(2, State::Calibrated, None) });
        assert!(screen(&monitor).contains(what));
    }
}

#[test]
fn the_screen_shows_state_fault_and_remedy() {
    let mut monitor = met(PROTOCOL);
    for tick in 0..200 {
        assert_eq!(told(&mut monitor, telemetry(20 * tick, State::Balancing, None)), 1);
    }
    let healthy = screen(&monitor);
    println!("{healthy}");
    for words in [
        "balancing",
        "1.2.3",
        "000000000000abcd",
        "0.1250 m",
        "link 4",
        "applied 3.25 N",
        "cycles 1234, worst 2345",
        "image 1234abcd",
        "supply 23.9 V, active inputs: none",
        "law LQR",
    ] {
        assert!(healthy.contains(words), "{words}\n{healthy}");
    }
    assert!(!healthy.contains("remedy"));
    told(&mut monitor, Telemetry { law: Law::PolePlacement, ..telemetry(3990, State::Calibrated, None) });
    assert!(screen(&monitor).contains("law pole placement"));
    told(&mut monitor, telemetry(4000, State::Fault, Some(Fault::EmergencyStop)));
    let faulty = screen(&monitor);
    println!("{faulty}");
    for words in ["fault: motor off", "emergency stop", "remedy: release", "clear it first"] {
        assert!(faulty.contains(words), "{words}\n{faulty}");
    }
    assert!(!faulty.contains("balancing: the motor is on"));
}

#[test]
fn active_contacts_and_the_last_crash_are_shown() {
    let mut monitor = met(PROTOCOL);
    let contacts = Contacts { limit_low: true, driver_fault: true, ..Contacts::default() };
    told(&mut monitor, Telemetry { contacts, ..telemetry(1, State::Disarmed, None) });
    assert!(screen(&monitor).contains("active inputs: limit switch low, driver fault"));
    // Negative control: no crash is shown before the firmware has reported one.
    assert!(!screen(&monitor).contains("PC"));
    let question = loop {
        let [command] = asked(&mut monitor)[..] else { panic!("one at a time") };
        if command.request == Request::Crash {
            break command;
        }
        answer(&mut monitor, command.id, Answer::Done);
    };
    let record = CrashRecord([0x0800_1234, 0x0800_0101, 0x8200, 1 << 30, 0x6000_0004]);
    answer(&mut monitor, question.id, Answer::Crash(Some(record)));
    let line = "crash at PC 0x08001234, LR 0x08000101, CFSR 0x00008200, HFSR 0x40000000, BFAR 0x60000004";
    assert!(screen(&monitor).contains(line) && monitor.log.iter().any(|said| said == line));
}

/// A crash resets the firmware while the monitor is connected: the monitor asks again.
#[test]
fn a_firmware_that_starts_again_is_asked_for_its_crash() {
    let mut monitor = met(PROTOCOL);
    told(&mut monitor, telemetry(500, State::Balancing, None));
    answer_all(&mut monitor);
    told(&mut monitor, telemetry(510, State::Balancing, None));
    assert!(asked(&mut monitor).is_empty());
    told(&mut monitor, telemetry(10, State::Disarmed, None));
    assert!(asked(&mut monitor).iter().any(|command| command.request == Request::Crash));
}

#[test]
fn every_key_gives_its_command() {
    let mut monitor = met(PROTOCOL);
    told(&mut monitor, telemetry(1, State::Calibrated, None));
    for (key, request) in [
        (KeyCode::Char('h'), Request::Home),
        (KeyCode::Char('H'), Request::HomeRail),
        (KeyCode::Char('g'), Request::CheckSigns),
        (KeyCode::Char('a'), Request::Arm),
        (KeyCode::Char('d'), Request::Disarm),
        (KeyCode::Char(' '), Request::Disarm),
        (KeyCode::Char('c'), Request::Clear),
        (KeyCode::Right, Request::Setpoint(0.05 + 0.01)),
        (KeyCode::Char('0'), Request::Setpoint(0.0)),
        (KeyCode::Left, Request::Setpoint(-0.01)),
        (KeyCode::Char('l'), Request::Select(Law::PolePlacement)),
    ] {
        assert_eq!(press(&mut monitor, key), [request], "{key:?}");
    }
    // The links hang: the second one is to stand, and the others keep hanging.
    assert_eq!(press(&mut monitor, KeyCode::Char('2')), [Request::Goto(Equilibrium::of_bits(0b1101))]);
    assert!(press(&mut monitor, KeyCode::Char('6')).is_empty(), "there is no sixth link");
    assert!(press(&mut monitor, KeyCode::Char('q')).is_empty());
    assert_eq!(action(&KeyEvent::new(KeyCode::Char('x'), KeyModifiers::NONE)), None);
}

#[test]
fn beats_begin_with_the_first_setpoint_and_numbers_always_grow() {
    let beats = |monitor: &mut Monitor| -> usize {
        let said: Vec<_> = (1..=100)
            .flat_map(|ms| {
                monitor.poll(NOW + Duration::from_millis(ms));
                let said = asked(monitor);
                said.iter().for_each(|command| answer(monitor, command.id, Answer::Done));
                said
            })
            .collect();
        assert!(said.windows(2).all(|pair| pair[0].id < pair[1].id));
        said.iter().filter(|command| command.request == Request::KeepAlive).count()
    };
    let mut monitor = met(PROTOCOL);
    assert_eq!(beats(&mut monitor), 0);
    press(&mut monitor, KeyCode::Right);
    assert_eq!(beats(&mut monitor), 4);
}

#[test]
fn a_refusal_is_shown_with_all_reasons() {
    let mut monitor = met(PROTOCOL);
    answer_all(&mut monitor);
    monitor.act(action(&KeyEvent::new(KeyCode::Char('a'), KeyModifiers::NONE)).unwrap(), NOW);
    let id = asked(&mut monitor)[0].id;
    answer(&mut monitor, id + 1, Answer::NotNow(Inhibits::TILTED));
    assert!(!screen(&monitor).contains("refused"), "that answers another command");
    answer(&mut monitor, id, Answer::NotNow(Inhibits::TILTED.union(Inhibits::NOT_HOMED)));
    let shown = screen(&monitor);
    assert!(shown.contains("arm: refused") && shown.contains("not upright") && shown.contains("home first"));
}

#[test]
fn another_version_of_the_messages_is_refused_and_nothing_more_is_sent() {
    let mut monitor = met(PROTOCOL + 1);
    assert_eq!(monitor.ended, Some(Ended::Mismatch(Mismatch::Protocol(PROTOCOL + 1))));
    assert_eq!(told(&mut monitor, telemetry(1, State::Balancing, None)), 0);
    assert!(press(&mut monitor, KeyCode::Char('a')).is_empty());
    assert!(screen(&monitor).contains("speaks version"));
}

#[test]
fn the_firmware_of_another_rig_or_tick_is_refused_and_both_are_named() {
    let refused = |hash, tick_s| {
        let mut monitor = met(PROTOCOL);
        monitor.expect_rig(ExpectedRig { hash, tick_s });
        monitor.ended.map(|ended| ended.to_string())
    };
    assert_eq!(refused(0xabcd, 0.001), None);
    let rig = refused(0xabce, 0.002).unwrap();
    assert!(rig.contains("hash 000000000000abcd and runs at a tick of 0.001 s"), "{rig}");
    assert!(rig.contains("the rig file has 000000000000abce and 0.002 s"), "{rig}");
    let tick = refused(0xabcd, 0.002).unwrap();
    assert!(tick.contains("timer makes a tick of 0.001 s instead of 0.002 s"), "{tick}");
}

#[test]
fn garbage_is_counted_and_what_follows_is_read() {
    let mut monitor = met(PROTOCOL);
    let mut damaged = framed(&Message::Telemetry(telemetry(1, State::Armed, None)));
    damaged[9] ^= 0x10;
    let noise: Vec<u8> = (0..5000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    assert!(monitor.receive(&damaged, NOW).is_empty() && monitor.unreadable() == 1);
    assert!(monitor.receive(&noise, NOW).is_empty() && monitor.unreadable() > 1);
    monitor.receive(&[0], NOW);
    assert_eq!(told(&mut monitor, telemetry(2, State::Armed, None)), 1);
}

#[test]
fn a_closed_connection_is_shown() {
    let mut monitor = met(PROTOCOL);
    assert!(!screen(&monitor).contains("closed"));
    monitor.close(&std::io::ErrorKind::UnexpectedEof.into());
    assert!(screen(&monitor).contains("connection is closed"));
}

/// Telemetry from the command, with the firmware in this process and `said` on stdin.
fn monitored(said: &str) -> Vec<Value> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/single-quanser-ip02.toml");
    let mut rig = Rig::from_path(&path).unwrap();
    // The test runs in real time, beside other tests: the monitor may be late by more than the rig's own 0.1 s.
    rig.limits.link_timeout_s = 2.0;
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let server = std::thread::spawn(move || {
        let scenario = Scenario { duration_s: 4.0, ..Scenario::at_rest(&rig, Law::Lqr) };
        serve(&rig, &table, &scenario, RunPlace::Host, &listener)
    });
    let mut monitor = Command::new(env!("CARGO_BIN_EXE_upright"))
        .args(["firmware", "monitor", &port, "--json", "--duration", "3"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    monitor.stdin.take().unwrap().write_all(said.as_bytes()).unwrap();
    let output = output_of(monitor, "the monitor ends after 3 s", PATIENCE);
    joined(server, "the simulation behind the monitor ends").unwrap();
    assert!(output.status.success());
    output
        .stdout
        .split(|&byte| byte == b'\n')
        .filter(|line| !line.is_empty())
        .map(|line| serde_json::from_slice(line).unwrap())
        .collect()
}

#[test]
fn a_set_point_from_the_monitor_moves_the_firmware_and_holds_it() {
    // Negative control: without a request, nothing moves it. Both take real time, so they run at the same time.
    let control = std::thread::spawn(|| monitored(""));
    let moved = monitored("set-point 0.05\n");
    let still = joined(control, "the monitor without a request");
    let last = moved.last().unwrap();
    assert!(moved.len() > 50, "{}", moved.len());
    assert!(moved.iter().all(|telemetry| telemetry["state"] == "Balancing"), "{last}");
    assert!((last["setpoint_m"].as_f64().unwrap() - 0.05).abs() < 1e-6, "{last}");
    assert_eq!(still.last().unwrap()["setpoint_m"], 0.0);
}
