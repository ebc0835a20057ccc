//! The boards, their pins and their ticks in docs/board.md are those of the image. This file is the test `boards` of
//! the package; the image does not contain it.

#![allow(
    dead_code,
    unreachable_pub,
    unexpected_cfgs,
    reason = "the test uses only the tables of these files"
)]

mod boards;
mod ticks;
mod wiring;

use boards::ALL;
use boards::data::{BoardData, ChipFamily, HseSource};
use wiring::{STANDARD, Signal, Wire, encoders};

const PAGE: &str = include_str!("../../../../docs/board.md");

fn connected_to(signal: Signal) -> String {
    match signal {
        Signal::Encoder(0, channel) => format!("cart encoder, {}", char::from(channel)),
        Signal::Encoder(link, channel) => format!("link {link} encoder, {}", char::from(channel)),
        Signal::Pwm => "power stage, PWM: high drives; or STEP".to_owned(),
        Signal::Direction => "power stage, direction: high pushes along +x".to_owned(),
        Signal::Enable => "power stage, enable: high; 10 kΩ to ground".to_owned(),
        Signal::DriverFault => "power stage, fault: low; open drain".to_owned(),
        Signal::EmergencyStop => "emergency stop: opens when pressed".to_owned(),
        Signal::LimitLow => "limit switch, low end: opens when pressed".to_owned(),
        Signal::LimitHigh => "limit switch, high end: opens when pressed".to_owned(),
        Signal::Supply => "supply voltage through 22 kΩ; 1 kΩ to ground".to_owned(),
        Signal::AngleSelect => "absolute sensors, select (CSn)".to_owned(),
        Signal::AngleClock => "absolute sensors, clock (CLK)".to_owned(),
        Signal::AngleCommand => "absolute sensors, command (MOSI)".to_owned(),
        Signal::Transmit => "serial line to the host".to_owned(),
        Signal::Receive => "serial line from the host".to_owned(),
        Signal::Tick => "oscilloscope: high while a tick runs".to_owned(),
        Signal::StatusLed => "status LED".to_owned(),
    }
}

fn pin(wire: &Wire) -> String {
    format!("P{}{}", char::from(wire.port), wire.pin)
}

fn row(wire: &Wire, has_bus: bool) -> String {
    let pull_up = if wire.pull_up { "pull-up" } else { "" };
    let data = match wire.signal {
        Signal::Encoder(_, b'A') if has_bus => "; or MISO",
        Signal::Encoder(1, b'B') if has_bus => "; or wiper",
        _ => "",
    };
    format!("| {} | {} | {}{data} | {pull_up} |", pin(wire), wire.function, connected_to(wire.signal))
}

fn board_row(board: &BoardData) -> String {
    let chip = match board.chip {
        ChipFamily::F405OrF407 => "STM32F405 or F407",
        ChipFamily::F446 => "STM32F446",
    };
    let sources = board.sources.iter().map(|source| match source {
        HseSource::Crystal => "crystal",
        HseSource::Clock => "clock input",
    });
    let led = if board.status_led_is_low { "low" } else { "high" };
    let [shortest_ms, longest_ms] = ticks::TICK_US.map(|us| f64::from(us) / 1e3);
    format!(
        "| `{}` | {} | {chip} | {} | {shortest_ms} to {longest_ms} ms | {} MHz {} | {}, on while {led} |",
        board.name,
        board.title,
        encoders(board.wiring) - 1,
        board.crystal_hz / 1_000_000,
        sources.collect::<Vec<_>>().join(", else "),
        pin(&board.status_led),
    )
}

fn notes_row(board: &BoardData) -> String {
    format!("| `{}` | {} V | {} |", board.name, board.reference_v, board.special)
}

/// The lines of the table between the markers of `name`.
fn documented<'a>(text: &'a str, name: &str) -> Vec<&'a str> {
    let table = text
        .split_once(&format!("<!-- {name} -->"))
        .and_then(|(_, rest)| rest.split_once(&format!("<!-- /{name} -->")));
    table.unwrap_or_else(|| panic!("docs/board.md has no table {name}")).0.trim().lines().collect()
}

/// The lines of a table with these heads of its columns.
fn table(heads: &[&str], rows: impl Iterator<Item = String>) -> Vec<String> {
    let lines = [format!("| {} |", heads.join(" | ")), format!("|{}", "---|".repeat(heads.len()))];
    lines.into_iter().chain(rows).collect()
}

fn defined(wiring: &[Wire]) -> Vec<String> {
    let has_bus = wiring.iter().any(|wire| matches!(wire.signal, Signal::AngleSelect));
    let heads = ["pin", "function", "connected to", "inside"];
    table(&heads, wiring.iter().map(|wire| row(wire, has_bus)))
}

#[test]
fn the_page_shows_the_wiring_of_the_image() {
    for board in ALL {
        let table = if board.name == "feather-f405" { "wiring of the Feather" } else { "wiring" };
        assert_eq!(documented(PAGE, table), defined(board.wiring), "write its table into docs/board.md");
    }
}

#[test]
fn a_wrong_pin_on_the_page_is_noticed() {
    assert_ne!(documented(&PAGE.replace("| PB12 |", "| PB11 |"), "wiring"), defined(&STANDARD));
}

#[test]
fn the_page_shows_the_boards_of_the_image() {
    let heads = ["`--board`", "board", "chip", "links", "tick", "clock at HSE", "status LED"];
    let boards = table(&heads, ALL.into_iter().map(board_row));
    assert_eq!(documented(PAGE, "boards"), boards, "write src/image/board/f4/boards/ into docs/board.md");
    assert_ne!(documented(&PAGE.replace("| tick | clock", "| clock | tick"), "boards"), boards);
    let notes = table(&["`--board`", "supply of the chip", "special"], ALL.into_iter().map(notes_row));
    assert_eq!(documented(PAGE, "notes"), notes, "write src/image/board/f4/boards/ into docs/board.md");
    assert_ne!(documented(&PAGE.replace("| 3 V |", "| 3.3 V |"), "notes"), notes);
}
