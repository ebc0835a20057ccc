//! The wiring in docs/board.md is the one that the image sets up.

#[path = "../../src/board/f4/wiring.rs"]
#[allow(dead_code, unreachable_pub)]
mod image;

use image::{STATUS_LEDS, WIRING, Wire};

const PAGE: &str = include_str!("../../docs/board.md");

fn row(wire: &Wire) -> String {
    let pull_up = if wire.pull_up { "pull-up" } else { "" };
    format!("| P{}{} | {} | {} | {pull_up} |", char::from(wire.port), wire.pin, wire.function, wire.signal)
}

/// The rows of the table between the markers, without its two header lines.
fn documented(text: &str) -> Vec<&str> {
    let table = text.split_once("<!-- wiring -->").and_then(|(_, rest)| rest.split_once("<!-- /wiring -->"));
    table.expect("docs/board.md has no wiring table").0.trim().lines().skip(2).collect()
}

fn defined() -> Vec<String> {
    WIRING.iter().chain(&STATUS_LEDS).map(row).collect()
}

#[test]
fn the_page_shows_the_wiring_of_the_image() {
    assert_eq!(documented(PAGE), defined(), "write src/board/f4/wiring.rs's table into docs/board.md");
}

#[test]
fn a_wrong_pin_on_the_page_is_noticed() {
    assert_ne!(documented(&PAGE.replace("| PB12 |", "| PB11 |")), defined());
}
