//! The twin's page can move a motor: who may, who may not, and what happens when the one in command falls silent.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket, client};
use upright::boards::DEFAULT_BOARD;
use upright::table::Law;
use upright_board::{Conditions, Image};
use upright_design::simulate::{Scenario, Sensing};
use upright_test_support::limits::{PATIENCE, SetAtEnd, until};
use upright_tool::in_the_loop::RunPlace;
use upright_tool::twin::{Server, SimulatedMachine};

use crate::equipment::built;
use crate::published::rig_and_table;
use crate::twin_page::Twin;

type Socket = WebSocket<TcpStream>;

/// Host and path of an address.
fn parts(address: &str) -> (&str, &str) {
    let rest = address.strip_prefix("http://").unwrap();
    rest.split_at(rest.find('/').unwrap())
}

/// A connection to the socket at `path`, from a page at `origin`; the error is the status.
fn connect(host: &str, path: &str, origin: &str) -> Result<Socket, u16> {
    let stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut request = format!("ws://{host}{path}").into_client_request().unwrap();
    request.headers_mut().insert("Origin", HeaderValue::from_str(origin).unwrap());
    match client(request, stream) {
        Ok((socket, _)) => Ok(socket),
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
            Err(answer.status().as_u16())
        }
        Err(error) => panic!("{error}"),
    }
}

fn page(twin: &Twin) -> Socket {
    page_at(&twin.address)
}

fn page_at(address: &str) -> Socket {
    let (host, path) = parts(address);
    connect(host, &format!("{path}socket"), &format!("http://{host}")).unwrap()
}

fn ask(socket: &mut Socket, request: &Value) {
    socket.send(Message::text(request.to_string())).unwrap();
}

/// Reads until `holds` for a message; if `alive`, tells the server so at each message.
fn read_until(socket: &mut Socket, alive: bool, holds: impl Fn(&Value) -> bool) -> Value {
    let begin = Instant::now();
    loop {
        assert!(begin.elapsed() < PATIENCE, "the message that is waited for never comes");
        let message: Value = match socket.read().unwrap() {
            Message::Text(text) => serde_json::from_str(&text).unwrap(),
            _ => continue,
        };
        if alive {
            ask(socket, &json!({ "ask": "alive" }));
        }
        if holds(&message) {
            return message;
        }
    }
}

/// State of the supervisor in a message, if it is a picture with telemetry.
fn state(message: &Value) -> Option<&str> {
    message["picture"]["telemetry"].as_array()?.last()?["state"].as_str()
}

fn balancing(message: &Value) -> bool {
    state(message) == Some("Balancing")
}

fn off(message: &Value) -> bool {
    state(message).is_some_and(|state| state != "Balancing")
}

#[test]
fn a_foreign_page_and_a_wrong_secret_are_refused() {
    let twin = Twin::start("single-quanser-ip02", &[]);
    let (host, path) = parts(&twin.address);
    let own = format!("http://{host}");
    assert_eq!(connect(host, &format!("{path}socket"), "http://evil.example").err(), Some(403));
    assert_eq!(connect(host, "/socket", &own).err(), Some(404));
    let wrong = path.replace(|digit: char| digit.is_ascii_digit(), "x");
    assert_eq!(connect(host, &format!("{wrong}socket"), &own).err(), Some(404));
    assert!(connect(host, &format!("{path}socket"), &own).is_ok());
    // A foreign name that resolves to this machine.
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: evil.example\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 421"), "{answer}");
}

/// 60 connections that send a byte now and then do not keep a person out, and are cut.
#[test]
fn slow_connections_keep_nobody_out() {
    let twin = Twin::start("single-quanser-ip02", &[]);
    let (host, path) = parts(&twin.address);
    let still_open = |slow: &mut [TcpStream]| {
        for stream in slow.iter_mut() {
            let _ = stream.write_all(b"G");
        }
        slow.iter().filter(|stream| is_open(stream)).count()
    };
    // On a busy machine they may all have been cut before the person asks: then they come again.
    let mut slow = until("a person is served while slow connections are open", || {
        let mut slow: Vec<TcpStream> = (0..60).map(|_| TcpStream::connect(host).unwrap()).collect();
        assert!(connect(host, &format!("{path}socket"), &format!("http://{host}")).is_ok());
        (still_open(&mut slow) > 0).then_some(slow)
    });
    until("all slow connections are cut", || {
        std::thread::sleep(Duration::from_millis(300));
        (still_open(&mut slow) == 0).then_some(())
    });
}

fn is_open(stream: &TcpStream) -> bool {
    stream.set_nonblocking(true).unwrap();
    let mut peeked = [0; 1];
    let is_waiting =
        matches!(stream.peek(&mut peeked), Err(error) if error.kind() == std::io::ErrorKind::WouldBlock);
    stream.set_nonblocking(false).unwrap();
    is_waiting
}

#[test]
fn a_second_viewer_sees_and_stops_but_does_not_command() {
    let twin = Twin::start("single-quanser-ip02", &[]);
    let mut first = page(&twin);
    read_until(&mut first, true, balancing);
    let mut second = page(&twin);
    ask(
        &mut second,
        &json!({ "ask": "machine", "what": { "do": "pull", "body": 1, "along": 1.0, "x": 9.0, "y": 0.0 } }),
    );
    ask(&mut second, &json!({ "ask": "say", "line": "set-point 0.1" }));
    read_until(&mut second, false, |message| message["notice"].is_string());
    let seen = read_until(&mut first, true, balancing);
    assert!(seen["picture"]["machine"]["pull"].is_null(), "{seen}");
    let wanted = seen["picture"]["wanted_m"].as_f64().unwrap_or(0.0);
    assert!(wanted.abs() < 0.05, "{wanted}");
    ask(&mut second, &json!({ "ask": "say", "line": "disarm" }));
    read_until(&mut first, true, off);
}

#[test]
fn garbage_and_floods_end_the_connection_and_nothing_else() {
    let twin = Twin::start("single-quanser-ip02", &[]);
    let mut first = page(&twin);
    read_until(&mut first, true, balancing);
    for garbage in ["{", "{\"ask\":\"fly\"}", "{\"ask\":\"alive\",\"x\":1}", "[1,2,3]", &"x".repeat(100_000)]
    {
        let mut other = page(&twin);
        let _ = other.send(Message::text(garbage));
        let ended = (0..10_000).find_map(|_| match other.read() {
            Ok(Message::Close(_)) | Err(_) => Some(()),
            Ok(_) => None,
        });
        assert!(ended.is_some(), "it goes on after {}", &garbage[..garbage.len().min(20)]);
        read_until(&mut first, true, balancing);
    }
    let mut flood = page(&twin);
    for _ in 0..20_000 {
        if flood.send(Message::text(json!({ "ask": "say", "line": "arm" }).to_string())).is_err() {
            break;
        }
    }
    read_until(&mut first, true, balancing);
    let mut raw = TcpStream::connect(parts(&twin.address).0).unwrap();
    raw.write_all(&[0xff; 20_000]).unwrap_or_default();
    read_until(&mut first, true, balancing);
}

/// The machine's time in a message (s).
fn time_s(message: &Value) -> f64 {
    message["picture"]["machine"]["t_s"].as_f64().unwrap()
}

/// Time of the machine from `leave`, which takes the page in command away or silences it, until a second page sees the
/// motor off (s).
fn time_to_off_s(leave: impl FnOnce(Socket) -> Option<Socket>) -> f64 {
    let twin = Twin::start("single-quanser-ip02", &[]);
    let mut commands = page(&twin);
    read_until(&mut commands, true, balancing);
    let mut watching = page(&twin);
    let last = read_until(&mut watching, false, balancing);
    let _kept = leave(commands);
    time_s(&read_until(&mut watching, false, off)) - time_s(&last)
}

#[test]
fn the_motor_is_turned_off_when_the_page_in_command_is_closed_or_sleeps() {
    // All of it takes real time, so it happens at the same time.
    std::thread::scope(|scope| {
        let closed = scope.spawn(|| time_to_off_s(|_| None));
        // A computer that sleeps keeps its connection and says nothing.
        let sleeping = scope.spawn(|| time_to_off_s(Some));
        // Negative control: with a page that is alive, the motor stays on for longer than that.
        let twin = Twin::start("single-quanser-ip02", &[]);
        let mut alive = page(&twin);
        let begin_s = time_s(&read_until(&mut alive, true, balancing));
        let mut stays_on_until = |is_over: &dyn Fn(f64) -> bool| {
            read_until(&mut alive, true, |message| {
                assert!(!off(message), "{message}");
                balancing(message) && is_over(time_s(message) - begin_s)
            });
        };
        stays_on_until(&|_| closed.is_finished() && sleeping.is_finished());
        let times = [closed, sleeping].map(|thread| thread.join().unwrap());
        let longest_s = times.into_iter().fold(0.0, f64::max);
        assert!(longest_s < 5.0, "{times:?}");
        stays_on_until(&|passed_s| passed_s > longest_s + 1.0);
    });
}

#[test]
fn the_flashed_image_balances_behind_the_page_and_obeys_it() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let (rig, table) = rig_and_table("quadruple-paper").clone();
    let scenario = Scenario { sensing: Sensing::Encoders, ..Scenario::at_rest(&rig, Law::Lqr) };
    let place = RunPlace::Board { image: &image, conditions: Conditions::f405(1) };
    let server = Server::listen(([127, 0, 0, 1], 0).into()).unwrap();
    let address = server.address().unwrap();
    let stop = AtomicBool::new(false);
    let goes_on = || !stop.load(Ordering::Relaxed);
    std::thread::scope(|scope| {
        let _stop = SetAtEnd(&stop);
        let machine = SimulatedMachine { rig: &rig, table: &table, scenario: &scenario };
        let twin = scope.spawn(move || server.simulate(machine, place, true, &goes_on));
        let mut socket = page_at(&address);
        let greeting = read_until(&mut socket, true, |message| message["hello"].is_object());
        let defects = greeting["hello"]["defects"].to_string();
        assert!(
            defects.contains("\"hard-fault\"") && !defects.contains("\"supply-not-a-number\""),
            "{defects}"
        );
        read_until(&mut socket, true, balancing);
        ask(&mut socket, &json!({ "ask": "say", "line": "disarm" }));
        read_until(&mut socket, true, off);
        stop.store(true, Ordering::Relaxed);
        twin.join().unwrap().unwrap();
    });
}
