//! The wiring in the README is the one that the image sets up.

#[path = "../../src/board/f4/wiring.rs"]
#[allow(dead_code, unreachable_pub)]
mod wiring;

use wiring::{LIGHTS, WIRING, Wire};

const README: &str = include_str!("../../README.md");

fn row(wire: &Wire) -> String {
    let pull_up = if wire.pull_up { "pull-up" } else { "" };
    format!("| P{}{} | {} | {} | {pull_up} |", char::from(wire.port), wire.pin, wire.function, wire.signal)
}

/// The rows of the table between the markers, without its two lines of heading.
fn documented(text: &str) -> Vec<&str> {
    let table = text.split_once("<!-- wiring -->").and_then(|(_, rest)| rest.split_once("<!-- /wiring -->"));
    table.expect("README.md has no wiring table").0.trim().lines().skip(2).collect()
}

fn defined() -> Vec<String> {
    WIRING.iter().chain(&LIGHTS).map(row).collect()
}

#[test]
fn the_readme_shows_the_wiring_of_the_image() {
    assert_eq!(documented(README), defined(), "write src/board/f4/wiring.rs's table into README.md");
}

#[test]
fn a_wrong_pin_in_the_readme_is_noticed() {
    assert_ne!(documented(&README.replace("| PB12 |", "| PB11 |")), defined());
}
