//! A trip that comes in the middle of any other function of the header is never lost.

use std::process::Command;

use super::avr::sent_by;
use super::program::{Dialect, Program, is_there};
use crate::published::rig_and_table;
use upright_design::export::c_header;
use upright_test_support::limits;

const PROGRAM: &str = include_str!("interrupts.c");

/// Functions that the program interrupts, `upright_control` four times and `upright_disarm` twice.
const CALLS: u32 = 10;

/// The header with HOOK after every statement.
fn with_hooks(header: &str) -> String {
    let (declarations, functions) = header.split_once("/* ---- Parts of a tick ---- */").unwrap();
    let hooked = functions.lines().map(|line| {
        let is_statement = line.starts_with(' ') && line.ends_with(';');
        if is_statement { format!("{line} HOOK;\n") } else { format!("{line}\n") }
    });
    format!("{declarations}{}", hooked.collect::<String>())
}

/// The header with the trip that it once had: it changed what the interrupted function changes.
fn with_a_trip_that_changes_the_state(header: &str) -> String {
    let old = header.replace("{ c->tripped = 1; }", "{ upright_trip_at(c, UPRIGHT_CALLER, 0); }");
    assert_ne!(old, header);
    old
}

/// Number of moments, of lost trips, and of calls that were interrupted on this machine.
fn on_the_host(header: &str) -> [u32; 3] {
    let program = Program::new(&with_hooks(header), PROGRAM);
    let output = program.compiled(Dialect { compiler: "gcc", flags: &["-std=c99", "-O1", "-w"] });
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = limits::output(&mut Command::new(program.path())).stdout;
    let said = String::from_utf8_lossy(&said).into_owned();
    let numbers: Vec<u32> = said.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let [moments, lost, calls, _] = numbers.try_into().unwrap();
    [moments, lost, calls]
}

#[test]
fn a_trip_between_any_two_statements_turns_the_motor_off() {
    if !is_there("gcc") {
        return;
    }
    for name in ["single-quanser-ip02", "single-stepper", "single-absolute"] {
        let (rig, table) = rig_and_table(name);
        let header = c_header(rig, table).unwrap();
        let [moments, lost, calls] = on_the_host(&header);
        println!("{name}: {moments} moments");
        assert!(moments > 300 && calls == CALLS, "{name}: {moments} {calls}");
        assert_eq!(lost, 0, "{name} of {moments}");
        let [_, lost, _] = on_the_host(&with_a_trip_that_changes_the_state(&header));
        assert!(lost > 0, "{name}: negative control");
    }
}

#[test]
fn a_trip_by_a_timers_interrupt_on_an_arduino_uno_turns_the_motor_off() {
    if !is_there("avr-gcc") || !is_there("simavr") {
        return;
    }
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let header = c_header(rig, table).unwrap();
    let [moments, lost, calls, _] = sent_by(&Program::new(&header, PROGRAM), "");
    println!("{moments} moments");
    assert!(moments > 500 && calls >= 9, "{moments} {calls}");
    assert_eq!(lost, 0, "of {moments}");
    let old = with_a_trip_that_changes_the_state(&header);
    assert!(sent_by(&Program::new(&old, PROGRAM), "")[1] > 0, "negative control");
}
